#include "feeler/evaluation/harness/paper_results.h"

#include <fstream>
#include <iterator>

#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"

namespace feeler::evaluation {
namespace {

/// The last three columns of a row.
PrintedRow Values(const nlohmann::json& row) {
  const std::size_t size = row.size();
  return {row[size - 3].get<double>(), row[size - 2].get<double>(), row[size - 1].get<double>()};
}

}  // namespace

const nlohmann::json& PaperResults() {
  static const nlohmann::json kResults = [] {
    const std::string file = FindData("evaluation/paper_results.json").string();
    std::ifstream in(file);
    auto document = ParseJsonText<nlohmann::json>(std::string{std::istreambuf_iterator<char>(in), {}});
    if (!document.is_object()) {
      throw InputError(file, "damaged", "restore it from the source of feeler");
    }
    return document;
  }();
  return kResults;
}

std::optional<PrintedRow> PrintedSolver(const std::string& table, const std::string& solver, double epsilon) {
  for (const nlohmann::json& row : PaperResults().at(table).at("rows")) {
    if (row[0] == solver && row[1].get<double>() == epsilon) return Values(row);
  }
  return std::nullopt;
}

std::optional<PrintedRow> PrintedVariant(const std::string& table, const std::string& variant) {
  for (const nlohmann::json& row : PaperResults().at(table).at("rows")) {
    if (row[0] == variant) return Values(row);
  }
  return std::nullopt;
}

}  // namespace feeler::evaluation
