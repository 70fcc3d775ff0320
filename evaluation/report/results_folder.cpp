#include "feeler/evaluation/report/results_folder.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/evaluation/harness/experiment_output.h"
#include "feeler/evaluation/report/embedded_picture.h"
#include "feeler/evaluation/report/record_line.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

std::string Slurp(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Discarded if it is no JSON, or nested deeper than anything of ours.
json Parse(const std::string& text) { return ParseJsonText<json>(text); }

class FolderReader {
 public:
  explicit FolderReader(fs::path root) : root_(std::move(root)) {}

  Results Read() {
    std::vector<fs::path> files;
    std::error_code error;
    for (fs::recursive_directory_iterator it(root_, fs::directory_options::skip_permission_denied, error), end;
         !error && it != end; it.increment(error)) {
      if (it->is_regular_file(error)) files.push_back(it->path());
    }
    if (error) Add(root_.string(), "cannot be read to the end: " + error.message(), "check its permissions");
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
      const std::string name = file.filename().string();
      if (name.ends_with(".partial.jsonl")) continue;
      if (name.ends_with(".scene.json")) {
        ReadScene(file);
      } else if (name.ends_with(".jsonl")) {
        ReadRecords(file);
      } else if (name.ends_with(".json") && name != "manifest.json") {
        ReadExperiment(file);
      } else if (name.ends_with(".csv") && !fs::exists(fs::path(file).replace_extension(".json"), error)) {
        Add(Relative(file), "stands without " + file.stem().string() + ".json", "run the experiment again");
      }
    }
    return std::move(results_);
  }

 private:
  std::string Relative(const fs::path& file) const { return file.lexically_relative(root_).generic_string(); }

  void Add(std::string where, std::string what, std::string mend) {
    results_.faults.push_back({std::move(where), std::move(what), std::move(mend)});
  }

  json ParseFile(const fs::path& file) {
    json document = Parse(Slurp(file));
    if (document.is_discarded()) {
      Add(Relative(file), "is cut off, or no JSON", "run what wrote it again");
      return nullptr;
    }
    return document;
  }

  void ReadScene(const fs::path& file) {
    json scene = ParseFile(file);
    if (scene.is_null()) return;
    for (const char* key : {"bodies", "geoms", "meshes"}) {
      if (!scene.is_object() || !scene.contains(key) || !scene[key].is_array() || !scene.contains("task") ||
          !scene["task"].is_string()) {
        return Add(Relative(file), std::string("is no scene: no \"") + key + "\" or no \"task\"",
                   "run the episodes again, or move it away");
      }
    }
    const std::string task = scene["task"].get<std::string>();
    results_.scenes.emplace(task, std::move(scene));
  }

  void ReadRecords(const fs::path& file) {
    ReportedRecords records;
    records.file = Relative(file);
    std::ifstream in(file);
    std::map<std::pair<std::string, std::int64_t>, int> line_of;
    int dry = 0;
    json record;
    int number = 0;
    for (std::string line; std::getline(in, line);) {
      ++number;
      if (line.empty()) continue;
      const std::string where = records.file + " line " + std::to_string(number);
      try {
        ReportedEpisode episode = ReadRecordLine(line, record);
        if (episode.dry) {
          ++dry;
          continue;
        }
        if (records.episodes.empty()) {
          records.task = record["task"];
          records.policy = record["policy"];
          records.noise = record["noise"];
          records.seed = record["seed"];
        } else if (records.task != record["task"] || records.policy != record["policy"] ||
                   records.noise != record["noise"] || records.seed != record["seed"]) {
          throw std::invalid_argument("is of another run than the lines before it");
        }
        const auto [first, is_new] =
            line_of.emplace(std::pair(episode.started, record["episode"].get<std::int64_t>()), number);
        if (!is_new) throw std::invalid_argument("is the episode of line " + std::to_string(first->second) + " again");
        records.episodes.push_back(std::move(episode));
      } catch (const std::invalid_argument& fault) {
        Add(where, fault.what(), "remove the line, or run the episode again");
      }
    }
    if (dry > 0) {
      Add(records.file, "holds " + std::to_string(dry) + " of dry runs, in which nothing moved: left out",
          "remove them, or let them be");
    }
    if (number == 0) Add(records.file, "holds no episode", "run the episodes again, or move it away");
    if (!records.episodes.empty()) results_.records.push_back(std::move(records));
  }

  void ReadExperiment(const fs::path& file) {
    const fs::path csv = fs::path(file).replace_extension(".csv");
    std::error_code error;
    const bool has_csv = fs::exists(csv, error);
    const std::string text = Slurp(file);
    json document = Parse(text);
    if (document.is_discarded()) {
      // A cut-off file is somebody's result if a table stands beside it; else it may be anything.
      return Add(Relative(file), "is cut off, or no JSON", "run what wrote it again");
    }
    const auto has = [&](const char* key) { return document.is_object() && document.contains(key); };
    if (!has("columns") && !has("rows") && !has_csv) return;  // a policy, a problem: not ours
    if (!has("name") || !document["name"].is_string() || !has("columns") || !document["columns"].is_array() ||
        !has("rows") || !document["rows"].is_array()) {
      return Add(Relative(file), "is no result of an experiment: name, columns or rows are missing",
                 "run the experiment again");
    }
    ReportedExperiment experiment;
    experiment.name = document["name"];
    experiment.folder = Relative(file.parent_path());
    if (experiment.folder == ".") experiment.folder.clear();
    experiment.columns = document["columns"];
    experiment.rows = json::array();
    ResultTable table;
    for (const json& column : experiment.columns) {
      table.columns.push_back(column.is_string() ? column.get<std::string>() : column.dump());
    }
    std::size_t number = 0;
    for (json& row : document["rows"]) {
      ++number;
      if (!row.is_array() || row.size() != experiment.columns.size()) {
        Add(Relative(file), "row " + std::to_string(number) + " has another number of cells than there are columns",
            "run the experiment again");
        continue;
      }
      table.rows.emplace_back(row.begin(), row.end());
      experiment.rows.push_back(std::move(row));
    }
    if (has_csv && Slurp(csv) != ToCsv(table)) {
      Add(Relative(csv), "does not say the same as " + file.filename().string() + ": one of them was edited",
          "run the experiment again; the page shows " + file.filename().string());
    }
    ReadDetails(file, document, experiment);
    results_.experiments.push_back(std::move(experiment));
  }

  void ReadDetails(const fs::path& file, const json& document, ReportedExperiment& experiment) {
    const json details = document.value("details", json::object());
    const auto find = [&](const char* key) -> json {
      if (document.contains(key)) return document.at(key);
      return details.is_object() && details.contains(key) ? details.at(key) : json();
    };
    experiment.manifest = find("manifest");
    std::error_code error;
    if (const fs::path beside = file.parent_path() / "manifest.json";
        experiment.manifest.is_null() && fs::exists(beside, error)) {
      experiment.manifest = ParseFile(beside);
    }
    if (!experiment.manifest.is_object()) {
      experiment.manifest = nullptr;
      Add(Relative(file), "does not say where it came from (no manifest)", "run the experiment again");
    } else if (const json version = experiment.manifest.value("version", json()); version != FEELER_VERSION) {
      Add(Relative(file),
          "was made by version " + (version.is_string() ? version.get<std::string>() : version.dump()) +
              " of feeler, this is " FEELER_VERSION,
          "run the experiment again in a new folder, or compare with care");
    }
    experiment.details = {{"title", find("title")}};
    if (details.is_object() && details.contains("rows") && details["rows"].is_array()) {
      for (const json& row : details["rows"]) {
        if (row.is_object() && row.contains("failures") && row["failures"].is_object() && !row["failures"].empty()) {
          experiment.details["failures"].push_back(
              {{"row", row.value("row", json())}, {"size", row.value("size", json())}, {"failures", row["failures"]}});
        }
      }
    }
    ReadFigures(file, find("figures"), experiment);
    ReadPictures(file, find("pictures"), experiment);
  }

  void ReadFigures(const fs::path& file, const json& figures, ReportedExperiment& experiment) {
    experiment.figures = json::array();
    if (figures.is_null()) return;
    const auto is_figure = [](const json& figure) {
      if (!figure.is_object() || !figure.contains("series") || !figure["series"].is_array()) return false;
      for (const json& series : figure["series"]) {
        if (!series.is_object() || !series.contains("points") || !series["points"].is_array()) return false;
        for (const json& point : series["points"]) {
          if (!point.is_object() || !point.contains("x") || !point["x"].is_number() || !point.contains("y"))
            return false;
        }
      }
      return true;
    };
    for (const json& figure : figures.is_array() ? figures : json::array({figures})) {
      if (is_figure(figure)) {
        experiment.figures.push_back(figure);
      } else {
        Add(Relative(file), "holds a figure without series of points {x, y}", "run the experiment again");
      }
    }
  }

  void ReadPictures(const fs::path& file, const json& pictures, ReportedExperiment& experiment) {
    experiment.pictures = json::array();
    if (!pictures.is_array()) return;
    for (const json& picture : pictures) {
      if (!picture.is_object() || !picture.contains("file") || !picture["file"].is_string()) {
        Add(Relative(file), "names a picture without a file", "run the experiment again");
        continue;
      }
      const std::string name = picture["file"];
      const fs::path path = (file.parent_path() / name).lexically_normal();
      const std::string inside = path.lexically_relative(root_).generic_string();
      const std::string source = inside.starts_with("..") ? "" : PictureDataUrl(path.string());
      if (source.empty()) {
        Add(Relative(file), "names the picture " + name + ", which is not there or no PNG or JPEG",
            "run the experiment again");
        continue;
      }
      experiment.pictures.push_back({{"source", source}, {"caption", picture.value("caption", json(""))}});
    }
  }

  fs::path root_;
  Results results_;
};

}  // namespace

std::string ToString(const Fault& fault) { return fault.where + ": " + fault.what + " (" + fault.mend + ")"; }

Results ReadResults(const std::string& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (error && status.type() != fs::file_type::not_found) {
    throw InputError(folder, "cannot be read: " + error.message(), "check the name and the permissions");
  }
  if (!fs::exists(status)) {
    throw InputError(folder, "there is no such folder", "give the --out of feeler experiment, or a folder of records");
  }
  if (!fs::is_directory(status)) throw InputError(folder, "is a file", "give the folder that it is in");
  Results results = FolderReader(folder).Read();
  if (results.experiments.empty() && results.records.empty()) {
    std::string what = "holds neither an experiment nor a record of an episode";
    if (!results.faults.empty()) what += " that can be read; the first fault: " + ToString(results.faults.front());
    throw InputError(folder, what, "fill it with feeler experiment --out or feeler run --out");
  }
  return results;
}

}  // namespace feeler::evaluation
