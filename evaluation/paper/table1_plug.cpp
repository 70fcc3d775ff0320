#include "feeler/evaluation/paper/table1_plug.h"

#include <fmt/format.h>

namespace feeler::evaluation {

DatabaseTable Table1Plug() {
  DatabaseTable table;
  table.name = kTable1PlugName;
  table.title = "Table I, success, speed and cost of RTDP-Bel and E-RTDP-Bel on the plug";
  const auto add = [&](planner::SolverKind solver, double epsilon) {
    const std::string name(planner::ToString(solver));
    table.rows.push_back({{fmt::format("{} {:g}", name, epsilon), "paper", planner::PaperSetting(solver, epsilon)},
                          PrintedSolver("table1_plug_database", name, epsilon)});
  };
  for (const double epsilon : {1.0, 2.0, 3.0, 5.0}) add(planner::SolverKind::kRtdpBel, epsilon);
  for (const double epsilon : {2.0, 3.0, 5.0}) add(planner::SolverKind::kERtdpBel, epsilon);
  table.rows.push_back(FastRtdpBelRow());
  table.rows.push_back(FastCertifiedRow());
  table.base = 0;
  table.reference = table.rows.size() - 1;
  table.family_rows = {OverFamily(FastCertifiedRow())};
  table.family_base = table.family_reference = table.family_rows.size() - 1;
  return table;
}

ExperimentResult RunTable1Plug(const ExperimentRequest& request) {
  const PlanningCase planning = LoadPlanningCase("plug", false, request);
  return RunDatabaseTable(planning, WithPrintedValuesOf(Table1Plug(), planning.task.name), ProtocolFor(request.quick),
                          request);
}

}  // namespace feeler::evaluation
