#include "feeler/evaluation/harness/database_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "feeler/evaluation/records/statistics.h"
#include "feeler/version.h"
#include "feeler/workflow/setup/planning_setup.h"

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

/// Rows measured on the same problems, relative to one of them.
struct Section {
  std::string problems;  ///< "sample" or "family"
  const std::vector<TableRow>* rows = nullptr;
  std::size_t base = 0;
  std::size_t reference = 0;
  std::vector<Measured> measured;
};

Measured Measure(const SolverSweep& sweep, const Section& section, std::size_t row) {
  const std::vector<SolveRecord> records = sweep.Records(row);
  const std::vector<SolveRecord> base = sweep.Records(section.base);
  const std::vector<SolveRecord> reference = sweep.Records(section.reference);
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
  if (row == section.base) measured.speedup.bound = BoundKind::kExact;  // 1 by definition
  measured.cost = RelativeCostOf(base, records);
  measured.rest_cost = RelativeCostOfRest(reference, base, records);
  measured.reference_cost = RelativeCostOf(reference, records);
  return measured;
}

json MeanJson(const RelativeCost& cost) { return cost.attempts > 0 ? json(cost.mean) : json(); }

ResultTable MakeTable(const std::vector<Section>& sections) {
  ResultTable result;
  result.columns = {"row",
                    "solver",
                    "setting",
                    "problems",
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
  for (const Section& section : sections) {
    for (std::size_t i = 0; i < section.rows->size(); ++i) {
      const TableRow& row = (*section.rows)[i];
      const Measured& m = section.measured[i];
      const planner::SolverOptions& options = row.solver.options;
      const auto printed = [&](double PrintedRow::*field) {
        return row.printed ? json((*row.printed).*field) : json();
      };
      result.rows.push_back({row.solver.label,
                             planner::ToString(options.solver),
                             row.solver.setting,
                             section.problems,
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

std::string SectionText(const Section& section) {
  std::string text =
      fmt::format("{:<24} {:<5} | {:>20} {:>7} | {:>9} {:>10} {:>7} | {:>12} {:>7} {:>12} {:>13} | {:>8}\n", "", "",
                  "success % [95 %]", "printed", "speed CPU", "expansions", "printed", "cost", "printed", "cost rest",
                  "certified", "CPU s");
  for (std::size_t i = 0; i < section.rows->size(); ++i) {
    const TableRow& row = (*section.rows)[i];
    const Measured& m = section.measured[i];
    const auto printed = [&](double PrintedRow::*field) {
      return row.printed ? fmt::format("{:g}", (*row.printed).*field) : std::string("-");
    };
    text += fmt::format(
        "{:<24} {:<5} | {:>20} {:>7} | {:>9} {:>10} {:>7} | {:>12} {:>7} {:>12} {:>13} | {:>8.1f}\n", row.solver.label,
        row.solver.setting,
        fmt::format("{:.1f} [{:.0f}, {:.0f}]", 100 * m.success.value, 100 * m.success.low, 100 * m.success.high),
        printed(&PrintedRow::success_percent), SpeedText(m.speedup.cpu, m.speedup.bound),
        SpeedText(m.speedup.expansions, m.speedup.bound), printed(&PrintedRow::relative_speedup), CostText(m.cost),
        printed(&PrintedRow::relative_cost), CostText(m.rest_cost), CostText(m.reference_cost), m.cpu_s);
  }
  return text;
}

/// The problems of a family of at most so many cells per axis; 0: no limit.
planner::ProblemFamily UpTo(planner::ProblemFamily family, int most, int other_most) {
  if (most == 0 || (other_most > 0 && other_most < most)) most = other_most;
  if (most == 0) return family;
  std::erase_if(family.problems, [most](const planner::Extents& e) {
    return std::max({e.nx, e.ny, e.nz, e.n_yaw, e.n_pitch}) > most;
  });
  family.spec += fmt::format(" up to {} cells per axis", most);
  return family;
}

/// How far the heuristic of a row lies below the cost of the reference, at the starts of the sample.
struct HeuristicGap {
  double mean = 0.0;
  double low = 0.0;
  double high = 0.0;
};

HeuristicGap MeasureGap(SolverSweep& sweep, std::size_t row, std::size_t reference) {
  const std::vector<double> heuristics = sweep.StartHeuristics(row);
  const std::vector<SolveRecord> records = sweep.Records(reference);  // those of the first seed come first
  HeuristicGap gap;
  int count = 0;
  for (std::size_t i = 0; i < heuristics.size(); ++i) {
    if (!records[i].complete || heuristics[i] <= 0.0) continue;
    const double ratio = records[i].expected_cost / heuristics[i];
    gap.mean += ratio;
    gap.low = count == 0 ? ratio : std::min(gap.low, ratio);
    gap.high = std::max(gap.high, ratio);
    ++count;
  }
  if (count > 0) gap.mean /= count;
  return gap;
}

std::string MakeText(const DatabaseTable& table, const std::vector<Section>& sections, const PlanningCase& planning,
                     const planner::ProblemFamily& sample, const planner::ProblemFamily& whole, std::size_t seeds,
                     const HeuristicGap& gap, const SampleProtocol& protocol) {
  const std::string& base = table.rows[table.base].solver.label;
  const std::string& reference = table.rows[table.reference].solver.label;
  std::string text = fmt::format("{}\n{}: {} problems ({}), {} seeds, {} s of CPU an attempt; relative to {}\n\n{}",
                                 table.title, planning.task.name, sample.problems.size(), sample.spec, seeds,
                                 protocol.cpu_limit_s, base, SectionText(sections[0]));
  if (sections.size() > 1) {
    text += fmt::format("\nAll {} problems of {}, one seed; relative to {}\n\n{}", whole.problems.size(), whole.spec,
                        table.family_rows[table.family_base].solver.label, SectionText(sections[1]));
  }
  text += fmt::format(
      "\nspeed: sum over attempts of {0} / of the row. An attempt without a policy counts with what it had used when\n"
      "  its limit struck: >= only {0} was cut short, <= only the row was, ~ both (the true ratio may lie either way)\n"
      "cost: mean ratio to {0} over the attempts that both solved (how many)\n"
      "cost rest: mean ratio to {1} over the solved attempts where {0} has no policy; certified: over all solved\n"
      "printed: the paper's value (500 s an attempt, its own task and machine)\n"
      "heuristic of {0} at the start: cost of {1} is {2:.3f} times it (mean; {3:.3f} to {4:.3f})\n",
      base, reference, gap.mean, gap.low, gap.high);
  return text;
}

}  // namespace

SampleProtocol QuickProtocol() {
  SampleProtocol protocol;
  protocol.per_stratum = 2;
  protocol.solver_seeds = 1;
  protocol.cpu_limit_s = 2.0;
  protocol.most_cells = 4;
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

planner::SolverOptions CertificateSetting(planner::SolverKind solver, double epsilon) {
  planner::SolverOptions options = planner::PaperSetting(solver, epsilon);
  options.heuristic = planner::HeuristicKind::kCertificate;
  return options;
}

DatabaseTable WithPrintedValuesOf(DatabaseTable table, const std::string& task) {
  if (task == "plug") return table;
  const bool pipe = task.starts_with("pipe") || task.starts_with("elbow");
  for (TableRow& row : table.rows) {
    const planner::SolverOptions& options = row.solver.options;
    const bool solver = row.printed && table.rows[table.base].solver.options.solver == planner::SolverKind::kRtdpBel;
    row.printed = pipe && solver ? PrintedSolver("table4_pipe_database", std::string(planner::ToString(options.solver)),
                                                 options.epsilon)
                                 : std::nullopt;
  }
  return table;
}

TableRow OverFamily(TableRow row) {
  row.solver.label += " family";
  row.printed.reset();
  return row;
}

ExperimentResult RunDatabaseTable(const PlanningCase& planning_case, DatabaseTable table,
                                  const SampleProtocol& protocol, const ExperimentRequest& request) {
  const planner::ProblemFamily family = protocol.family.empty()
                                            ? planner::FamilyOf(planning_case.task)
                                            : planner::ParseProblemFamily(protocol.family, planning_case.task);
  const planner::ProblemFamily sample = DrawSample(family, protocol.strata, protocol.per_stratum, request.seed);
  ExperimentResult result;
  const int solver_seeds = request.solver_seeds > 0 ? request.solver_seeds : protocol.solver_seeds;
  for (int i = 0; i < solver_seeds; ++i) result.seeds.push_back(request.seed + static_cast<unsigned>(i));
  json row_settings = json::array();
  const auto with_limits = [&](std::vector<TableRow>& rows) {
    std::vector<SolverRow> limited;
    for (TableRow& row : rows) {
      row.solver.options.cpu_limit_s = protocol.cpu_limit_s;
      row.solver.options.expansion_limit = protocol.expansion_limit;
      limited.push_back(row.solver);
      row_settings.push_back(ToJson(row.solver));
    }
    return limited;
  };
  const std::vector<SolverRow> rows = with_limits(table.rows);
  const std::vector<SolverRow> family_rows = with_limits(table.family_rows);
  const planner::ProblemFamily whole = UpTo(family, table.family_most_cells, protocol.most_cells);
  json problems = json::array();
  for (const planner::Extents& extents : sample.problems) problems.push_back(planner::ToString(extents));
  result.settings = {{"experiment", table.name},
                     {"version", FEELER_VERSION},
                     {"task", planning_case.task.name},
                     {"fingerprint", planning_case.fingerprint},
                     {"quick", request.quick},
                     {"sample", sample.spec},
                     {"problems", problems},
                     {"whole", whole.spec},
                     {"rows", row_settings}};

  CellStore cells(PartialFile(request, table.name), result.settings);  // more seeds may be added to finished ones
  cells.Adopt(PartialFilesOf(request, table.name), result.settings);
  result.settings["seeds"] = result.seeds;
  SweepContext context{&cells, request.jobs, request.cancellation, request.progress};
  context.shard = request.shard;
  context.store = request.store;
  SolverSweep sweep(planning_case, sample, rows, result.seeds, context);
  context.keep_policies = false;
  SolverSweep family_sweep(planning_case, whole, family_rows, {request.seed}, context);
  const bool has_family = family_sweep.Run();
  if (!has_family && !request.shard) return result;
  if (!sweep.Run() || !has_family) return result;

  std::vector<Section> sections = {{"sample", &table.rows, table.base, table.reference, {}}};
  for (std::size_t i = 0; i < rows.size(); ++i) sections[0].measured.push_back(Measure(sweep, sections[0], i));
  if (!family_rows.empty()) {
    sections.push_back({"family", &table.family_rows, table.family_base, table.family_reference, {}});
    for (std::size_t i = 0; i < family_rows.size(); ++i) {
      sections[1].measured.push_back(Measure(family_sweep, sections[1], i));
    }
  }
  const HeuristicGap gap = MeasureGap(sweep, table.base, table.reference);
  result.complete = true;
  result.table = MakeTable(sections);
  result.details = {{"title", table.title},
                    {"base", table.rows[table.base].solver.label},
                    {"reference", table.rows[table.reference].solver.label},
                    {"cost_over_start_heuristic", {{"mean", gap.mean}, {"low", gap.low}, {"high", gap.high}}},
                    {"attempts", sweep.RecordsJson()},
                    {"family_attempts", family_sweep.RecordsJson()}};
  result.text = MakeText(table, sections, planning_case, sample, whole, result.seeds.size(), gap, protocol);
  return result;
}

PlanningCase LoadPlanningCase(const std::string& task, bool open, const ExperimentRequest& request) {
  workflow::PlanningSetupOptions options;
  options.opening = open ? env::Opening::kOpen : env::Opening::kClosed;
  options.jobs = request.jobs;
  options.progress = request.map_progress;
  const workflow::PlanningSetup setup =
      workflow::LoadPlanningSetup(request.task.empty() ? task : request.task, options);
  return {setup.task(), setup.map, setup.fingerprint};
}

}  // namespace feeler::evaluation
