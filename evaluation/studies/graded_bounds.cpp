#include "feeler/evaluation/studies/graded_bounds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "feeler/evaluation/harness/database_table.h"
#include "feeler/evaluation/harness/paper_results.h"
#include "feeler/evaluation/harness/solver_sweep.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

struct Bound {
  std::string name;
  planner::HeuristicKind kind;
  double share;
};

std::vector<Bound> GradedBoundsOf(const GradedBoundsProtocol& protocol) {
  std::vector<Bound> bounds = {{"first contact", planner::HeuristicKind::kFirstContact, 1.0},
                               {"lines", planner::HeuristicKind::kLines, 1.0}};
  for (const double share : protocol.shares) {
    bounds.push_back({fmt::format("certificates {:g}", share), planner::HeuristicKind::kCertificate, share});
  }
  return bounds;
}

/// One row of a table of the paper, under every bound. Speeds are relative to row `base` of the same bound.
struct Variant {
  const char* name;
  planner::SolverKind solver;
  double epsilon;
  planner::ExperienceKind experience;
  planner::ProblemOrder order;
  std::size_t base;
  std::optional<PrintedRow> printed;
};

std::vector<Variant> Variants() {
  using planner::ExperienceKind;
  using planner::ProblemOrder;
  using planner::SolverKind;
  std::vector<Variant> variants;
  const auto add = [&](const char* name, SolverKind solver, double epsilon) {
    variants.push_back({name, solver, epsilon, ExperienceKind::kRollout, ProblemOrder::kUncertainty, 0,
                        PrintedSolver("table1_plug_database", std::string(planner::ToString(solver)), epsilon)});
  };
  add("rtdp-bel 1", SolverKind::kRtdpBel, 1.0);
  add("rtdp-bel 2", SolverKind::kRtdpBel, 2.0);
  add("rtdp-bel 3", SolverKind::kRtdpBel, 3.0);
  add("rtdp-bel 5", SolverKind::kRtdpBel, 5.0);
  add("e-rtdp-bel 2", SolverKind::kERtdpBel, 2.0);
  add("e-rtdp-bel 3", SolverKind::kERtdpBel, 3.0);
  add("e-rtdp-bel 5", SolverKind::kERtdpBel, 5.0);
  constexpr std::size_t kOurs = 4;
  variants.push_back({"naive", SolverKind::kERtdpBel, 2.0, ExperienceKind::kNaive, ProblemOrder::kUncertainty, kOurs,
                      PrintedVariant("table3_ablation_plug", "naive")});
  variants.push_back({"random", SolverKind::kERtdpBel, 2.0, ExperienceKind::kRollout, ProblemOrder::kRandom, kOurs,
                      PrintedVariant("table3_ablation_plug", "random")});
  return variants;
}

/// Row of variant v under bound b is b * variants + v; the reference, whose costs stand for V*, is the last.
std::vector<SolverRow> GradedRowsOf(const std::vector<Bound>& bounds, const std::vector<Variant>& variants,
                                    std::int64_t expansion_limit) {
  std::vector<SolverRow> rows;
  for (const Bound& bound : bounds) {
    for (const Variant& variant : variants) {
      SolverRow row;
      row.label = fmt::format("{}: {}", bound.name, variant.name);
      row.setting = "paper";
      row.options = planner::PaperSetting(variant.solver, variant.epsilon);
      row.options.heuristic = bound.kind;
      row.options.expansion_limit = expansion_limit;
      row.experience = variant.experience;
      row.order = variant.order;
      row.heuristic_share = bound.share;
      rows.push_back(std::move(row));
    }
  }
  rows.push_back(FastCertifiedRow().solver);
  return rows;
}

struct VariantResult {
  Rate success;
  Speedup speed;
};

/// Fixed before any run: a success is met if the printed one lies in the measured interval, a speed if the two are
/// within a factor of 2, or if what the limits cut short on one side may be.
bool MeetsSuccess(const Variant& variant, const VariantResult& m) {
  const double printed = 0.01 * variant.printed.value().success_percent;
  return m.success.low - 1e-9 <= printed && printed <= m.success.high + 1e-9;
}
bool MeetsSpeed(const Variant& variant, const VariantResult& m) {
  constexpr double kFactor = 2.0;
  const double ratio = variant.printed.value().relative_speedup / m.speed.expansions;
  const bool low_enough = ratio <= kFactor || m.speed.bound == BoundKind::kLower;
  const bool high_enough = ratio >= 1.0 / kFactor || m.speed.bound == BoundKind::kUpper;
  return m.speed.bound != BoundKind::kUnknown && low_enough && high_enough;
}

/// How far a bound lies below the optimum at the start, and what it comes to.
struct Graded {
  Bound bound;
  double ratio = 0.0;  ///< mean over problems of V* / heur
  std::vector<VariantResult> measured;
  std::vector<std::string> missed;  ///< printed values that are not met
  int values = 0;                   ///< printed values
};

Graded Grade(SolverSweep& sweep, const Bound& bound, std::size_t first, const std::vector<Variant>& variants) {
  Graded graded{bound, 0.0, {}, {}, 0};
  const std::vector<double> start = sweep.StartHeuristics(first);
  const std::vector<SolveRecord> reference = sweep.Records(sweep.rows().size() - 1);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (reference[i].complete && start[i] > 0.0) ratios.push_back(reference[i].expected_cost / start[i]);
  }
  graded.ratio = Mean(ratios);
  for (std::size_t v = 0; v < variants.size(); ++v) {
    const Variant& variant = variants[v];
    const std::vector<SolveRecord> records = sweep.Records(first + v);
    const auto solved = std::ranges::count_if(records, &SolveRecord::complete);
    VariantResult m{WilsonRate(static_cast<int>(solved), static_cast<int>(records.size())),
                    SpeedupOf(sweep.Records(first + variant.base), records)};
    const auto judge = [&](bool met, const char* what) {
      ++graded.values;
      if (!met) graded.missed.push_back(fmt::format("{} of {}", what, variant.name));
    };
    if (variant.printed) {
      judge(MeetsSuccess(variant, m), "success");
      if (v != variant.base) judge(MeetsSpeed(variant, m), "speed");
    }
    graded.measured.push_back(std::move(m));
  }
  return graded;
}

const char* Mark(BoundKind kind) {
  return kind == BoundKind::kLower ? ">=" : kind == BoundKind::kUpper ? "<=" : kind == BoundKind::kUnknown ? "~" : "";
}

void AddTable(const std::vector<Graded>& all, const std::vector<Variant>& variants, ExperimentResult& result) {
  result.table.columns = {"bound",
                          "share",
                          "optimum_over_bound",
                          "row",
                          "attempts",
                          "solved",
                          "success",
                          "success_low",
                          "success_high",
                          "speed_expansions",
                          "speed_cpu",
                          "speed_bound",
                          "printed_success_percent",
                          "printed_speed"};
  result.text += fmt::format("{:<18} {:>7} |", "bound", "V*/heur");
  for (const Variant& variant : variants) result.text += fmt::format(" {:>16} |", variant.name);
  result.text += "\n";
  for (const Graded& graded : all) {
    result.text += fmt::format("{:<18} {:>7.2f} |", graded.bound.name, graded.ratio);
    for (std::size_t v = 0; v < variants.size(); ++v) {
      const VariantResult& m = graded.measured[v];
      const auto printed = [&](double PrintedRow::*field) {
        return variants[v].printed ? json((*variants[v].printed).*field) : json();
      };
      result.table.rows.push_back({graded.bound.name, graded.bound.share, graded.ratio, variants[v].name,
                                   m.success.trials, m.success.successes, m.success.value, m.success.low,
                                   m.success.high, m.speed.expansions, m.speed.cpu, ToString(m.speed.bound),
                                   printed(&PrintedRow::success_percent), printed(&PrintedRow::relative_speedup)});
      result.text += fmt::format(" {:>4.0f} % {:>9} |", 100.0 * m.success.value,
                                 fmt::format("{}{:.3g}", Mark(m.speed.bound), m.speed.expansions));
    }
    result.text += "\n";
  }
  result.text += fmt::format("{:<18} {:>7} |", "printed", "");
  for (const Variant& variant : variants) {
    result.text += variant.printed ? fmt::format(" {:>4.0f} % {:>9.3g} |", variant.printed->success_percent,
                                                 variant.printed->relative_speedup)
                                   : fmt::format(" {:>16} |", "-");
  }
  result.text += "\n";
}

/// VariantResult values against V*/heur, and the printed ones as level lines.
void AddFigures(std::vector<Graded> all, const std::vector<Variant>& variants, ExperimentResult& result) {
  std::ranges::sort(all, {}, &Graded::ratio);
  const auto add = [&](const char* title, const char* y_label, bool y_log, std::size_t first, std::size_t last,
                       const auto& value, double PrintedRow::*printed, double unit) {
    Figure figure{title, "cost of the best policy over the bound at the start", y_label, true, y_log, {}};
    for (std::size_t v = first; v < last; ++v) {
      FigureSeries series{variants[v].name, {}};
      for (const Graded& graded : all) {
        const Estimate y = value(graded.measured[v]);
        series.points.push_back({graded.ratio, y.value, y.low, y.high});
      }
      figure.series.push_back(std::move(series));
      if (!variants[v].printed) continue;
      const double level = unit * (*variants[v].printed).*printed;
      figure.series.push_back({fmt::format("{}, printed", variants[v].name),
                               {{all.front().ratio, level, level, level}, {all.back().ratio, level, level, level}}});
    }
    result.figures.push_back(std::move(figure));
  };
  const auto success = [](const VariantResult& m) { return Estimate{m.success.value, m.success.low, m.success.high}; };
  const auto speed = [](const VariantResult& m) {
    return Estimate{m.speed.expansions, m.speed.expansions, m.speed.expansions};
  };
  constexpr std::size_t kExperience = 4;
  constexpr std::size_t kAblation = 7;
  add("Success of RTDP-Bel", "share of problems with a policy", false, 0, kExperience, success,
      &PrintedRow::success_percent, 0.01);
  add("Speed relative to RTDP-Bel at epsilon 1", "expansions of it over those of the row", true, 1, kAblation, speed,
      &PrintedRow::relative_speedup, 1.0);
  add("Naive experience and random order relative to the paper's choices", "expansions of those over these", true,
      kAblation, variants.size(), speed, &PrintedRow::relative_speedup, 1.0);
}

/// Which bound meets the most printed values, and what it does not.
void AddStatement(const std::vector<Graded>& all, ExperimentResult& result) {
  const auto best = std::ranges::min_element(all, {}, [](const Graded& g) { return g.missed.size(); });
  for (const Graded& graded : all) {
    result.details["missed"].push_back({{"bound", graded.bound.name},
                                        {"optimum_over_bound", graded.ratio},
                                        {"values", graded.values},
                                        {"missed", graded.missed}});
  }
  const auto met = static_cast<std::size_t>(best->values) - best->missed.size();
  result.text += fmt::format(
      "\nspeed: expansions of rtdp-bel 1 (naive, random: of e-rtdp-bel 2) over those of the row; >= and <=: limits "
      "cut\n"
      "  attempts of one side short, ~ of both\n"
      "met: a printed success in the interval of the measured one, a printed speed within a factor of 2 of it, ~ "
      "never\n"
      "{}: {} of {} printed values are met at best, by {} (V*/heur {:.2f})\n",
      best->missed.empty() ? "The printed picture appears" : "No strength shows the printed picture", met, best->values,
      best->bound.name, best->ratio);
  if (!best->missed.empty()) result.text += fmt::format("  not met there: {}\n", fmt::join(best->missed, ", "));
}

}  // namespace

ExperimentResult RunGradedBoundsOf(const GradedBoundsProtocol& protocol, const ExperimentRequest& request) {
  const PlanningCase planning = LoadPlanningCase("plug", false, request);
  const planner::ProblemFamily family = protocol.family.empty()
                                            ? planner::FamilyOf(planning.task)
                                            : planner::ParseProblemFamily(protocol.family, planning.task);
  const planner::ProblemFamily sample = DrawSample(family, protocol.strata, protocol.per_stratum, request.seed);
  const std::vector<Bound> bounds = GradedBoundsOf(protocol);
  const std::vector<Variant> variants = Variants();
  const std::vector<SolverRow> rows = GradedRowsOf(bounds, variants, protocol.expansion_limit);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kGradedBoundsName},
                     {"version", FEELER_VERSION},
                     {"task", planning.task.name},
                     {"fingerprint", planning.fingerprint},
                     {"quick", request.quick},
                     {"sample", sample.spec},
                     {"seeds", result.seeds}};
  for (const SolverRow& row : rows) result.settings["rows"].push_back(ToJson(row));
  CellStore cells(PartialFile(request, kGradedBoundsName), result.settings);
  SweepContext context{&cells, request.jobs, request.cancellation, request.progress};
  context.store = request.store;
  SolverSweep sweep(planning, sample, rows, result.seeds, context);
  if (!sweep.Run()) return result;

  std::vector<Graded> all;
  for (std::size_t b = 0; b < bounds.size(); ++b) all.push_back(Grade(sweep, bounds[b], b * variants.size(), variants));
  result.complete = true;
  result.text = fmt::format(
      "Tables I and III over bounds of graded strength: plug, {} problems ({}), {} expansions an attempt\n\n",
      sample.problems.size(), sample.spec, protocol.expansion_limit);
  AddTable(all, variants, result);
  AddFigures(all, variants, result);
  AddStatement(all, result);
  return result;
}

ExperimentResult RunGradedBounds(const ExperimentRequest& request) {
  GradedBoundsProtocol protocol;
  if (request.quick) {
    protocol.family = "2..4x2..4x2..4";
    protocol.strata = 2;
    protocol.per_stratum = 2;
    protocol.shares = {0.5, 1.0};
    protocol.expansion_limit = 5000;
  }
  return RunGradedBoundsOf(protocol, request);
}

}  // namespace feeler::evaluation
