#include "evaluation/experiments/database_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "evaluation/statistics.h"
#include "workflow/planning_setup.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

/// A row, measured.
struct Measured {
  Rate success;
  int limited = 0;  ///< attempts without a policy
  Speedup speedup;
  RelativeCost cost;            ///< to the base, where both solved
  RelativeCost rest_cost;       ///< to the reference, where the base has no policy
  RelativeCost reference_cost;  ///< to the reference, over all solved
  double cpu_s = 0.0;
  std::int64_t expansions = 0;
};

Measured Measure(const SolverSweep& sweep, const DatabaseTable& table, std::size_t row) {
  const std::vector<SolveRecord> records = sweep.Records(row);
  const std::vector<SolveRecord> base = sweep.Records(table.base);
  const std::vector<SolveRecord> reference = sweep.Records(table.reference);
  Measured measured;
  int solved = 0;
  for (const SolveRecord& record : records) {
    solved += record.complete ? 1 : 0;
    measured.cpu_s += record.cpu_s;
    measured.expansions += record.expansions;
  }
  const int attempts = static_cast<int>(records.size());
  measured.success = WilsonRate(solved, attempts);
  measured.limited = attempts - solved;
  measured.speedup = SpeedupOf(base, records);
  if (row == table.base) measured.speedup.bound = BoundKind::kExact;  // 1 by definition
  measured.cost = RelativeCostOf(base, records);
  measured.rest_cost = RelativeCostOfRest(reference, base, records);
  measured.reference_cost = RelativeCostOf(reference, records);
  return measured;
}

json MeanJson(const RelativeCost& cost) { return cost.attempts > 0 ? json(cost.mean) : json(); }

ResultTable MakeTable(const DatabaseTable& table, const std::vector<Measured>& measured) {
  ResultTable result;
  result.columns = {"row",
                    "solver",
                    "setting",
                    "epsilon_or_gap",
                    "attempts",
                    "solved",
                    "success_percent",
                    "success_low_percent",
                    "success_high_percent",
                    "relative_speedup_cpu",
                    "relative_speedup_expansions",
                    "relative_speedup_cpu_geometric",
                    "relative_speedup_expansions_geometric",
                    "relative_speedup_bound",
                    "attempts_at_limit",
                    "relative_cost_to_base",
                    "relative_cost_to_base_attempts",
                    "rest_cost_to_certified",
                    "rest_cost_to_certified_attempts",
                    "cost_to_certified",
                    "cost_to_certified_attempts",
                    "cpu_s",
                    "expansions",
                    "printed_success_percent",
                    "printed_relative_speedup",
                    "printed_relative_cost"};
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const TableRow& row = table.rows[i];
    const Measured& m = measured[i];
    const planner::SolverOptions& options = row.solver.options;
    const auto printed = [&](double PrintedRow::*field) { return row.printed ? json((*row.printed).*field) : json(); };
    result.rows.push_back({row.solver.label,
                           planner::ToString(options.solver),
                           row.solver.setting,
                           options.solver == planner::SolverKind::kCertified ? options.gap : options.epsilon,
                           m.success.trials,
                           m.success.successes,
                           100.0 * m.success.value,
                           100.0 * m.success.low,
                           100.0 * m.success.high,
                           m.speedup.cpu,
                           m.speedup.expansions,
                           m.speedup.cpu_geometric,
                           m.speedup.expansions_geometric,
                           ToString(m.speedup.bound),
                           m.limited,
                           MeanJson(m.cost),
                           m.cost.attempts,
                           MeanJson(m.rest_cost),
                           m.rest_cost.attempts,
                           MeanJson(m.reference_cost),
                           m.reference_cost.attempts,
                           m.cpu_s,
                           m.expansions,
                           printed(&PrintedRow::success_percent),
                           printed(&PrintedRow::relative_speedup),
                           printed(&PrintedRow::relative_cost)});
  }
  return result;
}

std::string SpeedText(double value, BoundKind bound) {
  const char* mark = bound == BoundKind::kLower     ? ">="
                     : bound == BoundKind::kUpper   ? "<="
                     : bound == BoundKind::kUnknown ? "~"
                                                    : "";
  return mark + (value >= 100.0 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value));
}

std::string CostText(const RelativeCost& cost) {
  return cost.attempts == 0 ? "-" : fmt::format("{:.3f} ({})", cost.mean, cost.attempts);
}

std::string MakeText(const DatabaseTable& table, const std::vector<Measured>& measured, const PlanningCase& planning,
                     const planner::ProblemFamily& sample, const SampleProtocol& protocol) {
  std::string text = fmt::format("{}\n{}: {} problems ({}), {} seeds, {} s an attempt; relative to {}\n\n", table.title,
                                 planning.task.name, sample.problems.size(), sample.spec, protocol.solver_seeds,
                                 protocol.time_limit_s, table.rows[table.base].solver.label);
  text += fmt::format("{:<20} {:<5} | {:>20} {:>7} | {:>9} {:>10} {:>7} | {:>12} {:>7} {:>12} {:>12}\n", "", "",
                      "success % [95 %]", "printed", "speed CPU", "expansions", "printed", "cost", "printed",
                      "cost rest", "certified");
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const TableRow& row = table.rows[i];
    const Measured& m = measured[i];
    const auto printed = [&](double PrintedRow::*field) {
      return row.printed ? fmt::format("{:g}", (*row.printed).*field) : std::string("-");
    };
    text += fmt::format(
        "{:<20} {:<5} | {:>20} {:>7} | {:>9} {:>10} {:>7} | {:>12} {:>7} {:>12} {:>12}\n", row.solver.label,
        row.solver.setting,
        fmt::format("{:.1f} [{:.0f}, {:.0f}]", 100 * m.success.value, 100 * m.success.low, 100 * m.success.high),
        printed(&PrintedRow::success_percent), SpeedText(m.speedup.cpu, m.speedup.bound),
        SpeedText(m.speedup.expansions, m.speedup.bound), printed(&PrintedRow::relative_speedup), CostText(m.cost),
        printed(&PrintedRow::relative_cost), CostText(m.rest_cost), CostText(m.reference_cost));
  }
  text += fmt::format(
      "\nspeed: sum over attempts of {0} / of the row. An attempt without a policy counts with what it had used when\n"
      "  its limit struck: >= only {0} was cut short, <= only the row was, ~ both (the true ratio may lie either way)\n"
      "cost: mean ratio to {0} over the attempts that both solved (how many)\n"
      "cost rest: mean ratio to {1} over the solved attempts where {0} has no policy; certified: over all solved\n"
      "printed: the paper's value (500 s an attempt, its own task and machine)\n",
      table.rows[table.base].solver.label, table.rows[table.reference].solver.label);
  return text;
}

}  // namespace

SampleProtocol QuickProtocol() {
  SampleProtocol protocol;
  protocol.per_stratum = 2;
  protocol.solver_seeds = 1;
  protocol.time_limit_s = 2.0;
  return protocol;
}

TableRow FastCertifiedRow() {
  SolverRow row{"certified 1.2", "fast", planner::FastSetting(planner::SolverKind::kCertified, 1.2)};
  row.options.gap = 1.2;
  return {row, std::nullopt};
}

TableRow FastRtdpBelRow() {
  return {{"rtdp-bel 1.2 fast", "fast", planner::FastSetting(planner::SolverKind::kRtdpBel, 1.2)}, std::nullopt};
}

ExperimentResult RunDatabaseTable(const PlanningCase& planning_case, DatabaseTable table,
                                  const SampleProtocol& protocol, const ExperimentRequest& request) {
  const planner::ProblemFamily family =
      protocol.family.empty() ? planner::FamilyOf(planning_case.task) : planner::ParseProblemFamily(protocol.family);
  const planner::ProblemFamily sample = DrawSample(family, protocol.strata, protocol.per_stratum, request.seed);
  ExperimentResult result;
  for (int i = 0; i < protocol.solver_seeds; ++i) result.seeds.push_back(request.seed + static_cast<unsigned>(i));
  std::vector<SolverRow> rows;
  json row_settings = json::array();
  for (TableRow& row : table.rows) {
    row.solver.options.time_limit_s = protocol.time_limit_s;
    row.solver.options.expansion_limit = protocol.expansion_limit;
    rows.push_back(row.solver);
    row_settings.push_back(ToJson(row.solver));
  }
  json problems = json::array();
  for (const planner::Extents& extents : sample.problems) problems.push_back(planner::ToString(extents));
  result.settings = {{"experiment", table.name},
                     {"version", FEELER_VERSION},
                     {"task", planning_case.task.name},
                     {"fingerprint", planning_case.fingerprint},
                     {"quick", request.quick},
                     {"sample", sample.spec},
                     {"problems", problems},
                     {"seeds", result.seeds},
                     {"rows", row_settings}};

  CellStore cells(PartialFile(request, table.name), result.settings);
  SolverSweep sweep(planning_case, sample, rows, result.seeds,
                    {&cells, request.jobs, request.cancellation, request.progress});
  if (!sweep.Run()) return result;
  std::vector<Measured> measured;
  for (std::size_t i = 0; i < rows.size(); ++i) measured.push_back(Measure(sweep, table, i));
  result.complete = true;
  result.table = MakeTable(table, measured);
  result.details = {{"title", table.title},
                    {"base", table.rows[table.base].solver.label},
                    {"reference", table.rows[table.reference].solver.label},
                    {"attempts", sweep.RecordsJson()}};
  result.text = MakeText(table, measured, planning_case, sample, protocol);
  return result;
}

PlanningCase LoadPlanningCase(const std::string& task, bool open, const ExperimentRequest& request) {
  workflow::PlanningSetupOptions options;
  options.opening = open ? env::Opening::kOpen : env::Opening::kClosed;
  options.jobs = request.jobs;
  options.progress = request.map_progress;
  const workflow::PlanningSetup setup = workflow::LoadPlanningSetup(task, options);
  return {setup.task(), setup.map, setup.fingerprint};
}

}  // namespace feeler::evaluation
