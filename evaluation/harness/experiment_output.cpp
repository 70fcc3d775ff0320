#include "feeler/evaluation/harness/experiment_output.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/json_depth.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return "";
  const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

nlohmann::json Machine() {
  std::string processor = "unknown";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    if (line.starts_with("model name")) {
      processor = line.substr(line.find(':') + 2);
      break;
    }
  }
  utsname system{};
  uname(&system);
  return {{"processor", processor},
          {"cores", std::thread::hardware_concurrency()},
          {"memory_bytes", static_cast<std::int64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGE_SIZE)},
          {"system", std::string(system.sysname) + " " + system.machine}};
}

}  // namespace

nlohmann::json ManifestJson(const Manifest& manifest) {
  return {{"version", FEELER_VERSION},
          {"command", manifest.command},
          {"settings", manifest.settings},
          {"seeds", manifest.seeds},
          {"machine", Machine()}};
}

nlohmann::json ToJson(const Figure& figure) {
  nlohmann::json document = {{"title", figure.title}, {"x_label", figure.x_label}, {"y_label", figure.y_label},
                             {"x_log", figure.x_log}, {"y_log", figure.y_log},     {"series", nlohmann::json::array()}};
  for (const FigureSeries& series : figure.series) {
    nlohmann::json points = nlohmann::json::array();
    for (const FigurePoint& p : series.points) {
      points.push_back({{"x", p.x}, {"y", p.y}, {"low", p.low}, {"high", p.high}});
    }
    document["series"].push_back({{"name", series.name}, {"points", std::move(points)}});
  }
  return document;
}

namespace {

std::string HeaderOf(const std::vector<std::string>& columns) {
  std::string csv;
  for (std::size_t i = 0; i < columns.size(); ++i) csv += (i == 0 ? "" : ",") + CsvCell(columns[i]);
  return csv;
}

std::string Slurp(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

void RequireOwnCsv(const std::string& folder, const std::string& name) {
  const std::string path = folder + "/" + name + ".csv";
  std::ifstream in(path, std::ios::binary);
  std::string first;
  if (!in || !std::getline(in, first)) return;
  const auto document = ParseJsonText<nlohmann::json>(Slurp(folder + "/" + name + ".json"));
  const nlohmann::json columns = document.is_object() ? document.value("columns", nlohmann::json()) : nlohmann::json();
  const auto is_text = [](const nlohmann::json& column) { return column.is_string(); };
  if (columns.is_array() && std::all_of(columns.begin(), columns.end(), is_text) &&
      HeaderOf(columns.get<std::vector<std::string>>()) == first) {
    return;
  }
  throw InputError(path, "exists and is not the table of experiment " + name + ": it is not overwritten",
                   "choose another folder, or move this file away");
}

std::string ToCsv(const ResultTable& table) {
  std::string csv = HeaderOf(table.columns) + "\n";
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) csv += (i == 0 ? "" : ",") + CsvCell(row[i]);
    csv += "\n";
  }
  return csv;
}

void WriteExperiment(const std::string& folder, const std::string& name, const ResultTable& table,
                     const nlohmann::json& details, const Manifest& manifest, const std::vector<Figure>& figures) {
  for (const auto& row : table.rows) {
    if (row.size() != table.columns.size()) {
      throw InputError(
          "experiment " + name,
          "a row has " + std::to_string(row.size()) + " cells for " + std::to_string(table.columns.size()) + " columns",
          "give one cell a column");
    }
  }
  RequireOwnCsv(folder, name);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError(folder, "cannot be created: " + error.message(), "choose another folder");
  nlohmann::json document = {{"name", name}, {"columns", table.columns}, {"rows", table.rows}, {"details", details}};
  document["figures"] = nlohmann::json::array();
  for (const Figure& figure : figures) document["figures"].push_back(ToJson(figure));
  WriteFileAtomically(folder + "/" + name + ".csv", ToCsv(table));
  WriteFileAtomically(folder + "/" + name + ".json", document.dump(2) + "\n");
  WriteFileAtomically(folder + "/manifest.json", ManifestJson(manifest).dump(2) + "\n");
}

}  // namespace feeler::evaluation
