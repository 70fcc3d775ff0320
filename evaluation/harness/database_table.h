#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"
#include "feeler/evaluation/harness/paper_results.h"
#include "feeler/evaluation/harness/solver_sweep.h"

namespace feeler::evaluation {

/// The protocol of the tables that compare solvers on a sample of a problem family. The defaults were fixed before any
/// run.
struct SampleProtocol {
  std::string family;         ///< empty: the whole family of the task
  int most_cells = 0;         ///< cells per axis of family rows, if the table does not set fewer; 0: no limit
  int strata = 5;             ///< quintiles of the number of hypotheses
  int per_stratum = 8;        ///< problems drawn from each
  int solver_seeds = 3;       ///< repetitions
  double cpu_limit_s = 30.0;  ///< CPU time, so that a busy machine does not change who succeeds
  std::int64_t expansion_limit = std::numeric_limits<std::int64_t>::max();
};
/// Two problems a quintile, one seed, 2 s.
SampleProtocol QuickProtocol();
inline SampleProtocol ProtocolFor(bool quick) { return quick ? QuickProtocol() : SampleProtocol(); }

/// A row of such a table.
struct TableRow {
  SolverRow solver;
  std::optional<PrintedRow> printed;
};

/// Success, effort and cost of solvers on the same problems, relative to row `base`.
struct DatabaseTable {
  std::string name;   ///< of the experiment
  std::string title;  ///< for people
  std::vector<TableRow> rows;
  std::size_t base = 0;       ///< speed and cost are relative to this row
  std::size_t reference = 0;  ///< solves every problem; cost is relative to it where the base has none
  /// Rows measured over a complete family, with the first solver seed, relative to `family_base`: the problems of at
  /// most `family_most_cells` cells per axis (0: all).
  std::vector<TableRow> family_rows;
  int family_most_cells = 0;
  std::size_t family_base = 0;
  std::size_t family_reference = 0;
};

/// Rows of the reference solvers in the fast setting: certified to 1.2 and RTDP-Bel at epsilon 1.2.
TableRow FastCertifiedRow();
TableRow FastRtdpBelRow();
/// The paper's algorithms with the bound that seeds experience where orientations are uncertain, too (setting `certs`).
planner::SolverOptions CertificateSetting(planner::SolverKind solver, double epsilon);
/// The printed values that belong to a task: those of the plug for "plug", those of Table IV for solvers of pipe tasks,
/// none for other tasks.
DatabaseTable WithPrintedValuesOf(DatabaseTable table, const std::string& task);
/// The same row for a whole family.
TableRow OverFamily(TableRow row);

/// Measures a table; the limits of the protocol replace those of the rows.
ExperimentResult RunDatabaseTable(const PlanningCase& planning_case, DatabaseTable table,
                                  const SampleProtocol& protocol, const ExperimentRequest& request);

/// The requested task, or else `task`, with its socket closed or open while localizing. Throws InputError.
PlanningCase LoadPlanningCase(const std::string& task, bool open, const ExperimentRequest& request);

}  // namespace feeler::evaluation
