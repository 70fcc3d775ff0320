#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace feeler::evaluation {

/// The values that the paper prints: evaluation/paper_results.json. Throws InputError if the file is missing or
/// damaged.
const nlohmann::json& PaperResults();

/// A row of the paper's Tables I, III and IV.
struct PrintedRow {
  double success_percent = 0.0;
  double relative_speedup = 0.0;
  double relative_cost = 0.0;
};
/// The row of a solver at an epsilon in "table1_plug_database" or "table4_pipe_database", if it is printed.
std::optional<PrintedRow> PrintedSolver(const std::string& table, const std::string& solver, double epsilon);
/// The row of a variant in "table3_ablation_plug", if it is printed.
std::optional<PrintedRow> PrintedVariant(const std::string& table, const std::string& variant);

}  // namespace feeler::evaluation
