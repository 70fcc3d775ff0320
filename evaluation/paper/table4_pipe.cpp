#include "feeler/evaluation/paper/table4_pipe.h"

#include <fmt/format.h>

namespace feeler::evaluation {

DatabaseTable Table4Pipe() {
  DatabaseTable table;
  table.name = kTable4PipeName;
  table.title = "Table IV, success, speed and cost of RTDP-Bel and E-RTDP-Bel on the pipe";
  const auto add = [&](planner::SolverKind solver, double epsilon) {
    const std::string name(planner::ToString(solver));
    table.rows.push_back({{fmt::format("{} {:g}", name, epsilon), "certs", CertificateSetting(solver, epsilon)},
                          PrintedSolver("table4_pipe_database", name, epsilon)});
  };
  // The medium bound of the paper setting, to show what it does here. Rows are run from the last to the first.
  table.rows.push_back(
      {{"e-rtdp-bel 5 lines", "paper", planner::PaperSetting(planner::SolverKind::kERtdpBel, 5.0)}, std::nullopt});
  table.base = table.rows.size();
  for (const double epsilon : {1.0, 2.0, 3.0, 5.0}) add(planner::SolverKind::kRtdpBel, epsilon);
  for (const double epsilon : {2.0, 3.0, 5.0}) add(planner::SolverKind::kERtdpBel, epsilon);
  table.rows.push_back(FastRtdpBelRow());
  table.rows.push_back(FastCertifiedRow());
  table.reference = table.rows.size() - 1;
  return table;
}

ExperimentResult RunTable4Pipe(const ExperimentRequest& request) {
  const PlanningCase planning = LoadPlanningCase("pipe-into-elbow", false, request);
  return RunDatabaseTable(planning, Table4Pipe(), ProtocolFor(request.quick), request);
}

}  // namespace feeler::evaluation
