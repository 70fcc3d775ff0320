#include "feeler/evaluation/paper/table3_ablation.h"

namespace feeler::evaluation {
namespace {

DatabaseTable Ablation(const std::string& setting, const planner::SolverOptions& options) {
  DatabaseTable table;
  table.name = kTable3AblationName;
  table.title = "Table III, what the choice of experience and the order of problems do for E-RTDP-Bel at epsilon 2";
  const auto add = [&](const std::string& variant, planner::ExperienceKind experience, planner::ProblemOrder order) {
    table.rows.push_back(
        {{variant, setting, options, order, experience}, PrintedVariant("table3_ablation_plug", variant)});
  };
  add("ours", planner::ExperienceKind::kRollout, planner::ProblemOrder::kUncertainty);
  add("naive", planner::ExperienceKind::kNaive, planner::ProblemOrder::kUncertainty);
  add("random", planner::ExperienceKind::kRollout, planner::ProblemOrder::kRandom);
  for (const TableRow& row : table.rows) table.family_rows.push_back(OverFamily(row));
  table.rows.push_back(FastCertifiedRow());
  table.family_rows.push_back(OverFamily(FastCertifiedRow()));
  table.base = 0;
  table.reference = table.rows.size() - 1;
  table.family_most_cells = 9;  // 512 problems: neighbours differ by one cell, as in a complete preprocessing
  table.family_base = table.base;
  table.family_reference = table.family_rows.size() - 1;
  return table;
}

}  // namespace

DatabaseTable Table3Ablation() { return Ablation("paper", planner::PaperSetting(planner::SolverKind::kERtdpBel, 2.0)); }

DatabaseTable Table3AblationWithOrientations() {
  return Ablation("certs", CertificateSetting(planner::SolverKind::kERtdpBel, 2.0));
}

ExperimentResult RunTable3Ablation(const ExperimentRequest& request) {
  const PlanningCase planning = LoadPlanningCase("plug", false, request);
  const DatabaseTable table = planning.map->orientations() > 1 ? Table3AblationWithOrientations() : Table3Ablation();
  return RunDatabaseTable(planning, WithPrintedValuesOf(table, planning.task.name), ProtocolFor(request.quick),
                          request);
}

}  // namespace feeler::evaluation
