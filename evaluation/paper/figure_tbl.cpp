#include "feeler/evaluation/paper/figure_tbl.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/core/worker_pool.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"
#include "feeler/policies/touch/kinematic_walk.h"
#include "feeler/version.h"
#include "feeler/workflow/setup/planning_setup.h"
#include "feeler/workflow/setup/policy_registry.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

struct Protocol {
  std::vector<int> cells = {2, 3, 5, 7, 9, 11, 13, 15};  ///< per uncertain axis
  int truths = 120;                                      ///< walked from, where there are more hypotheses
  int mesh_truths = 2;                                   ///< of `tbl-mesh`: it is run for its planning time
  int mesh_most_cells = 15;
  double gap = 1.2;  ///< of the database policy: the default of `feeler preprocess`
  std::int64_t online_expansions = 3000;
};

Protocol ProtocolOf(bool quick) {
  Protocol protocol;
  if (quick) {
    protocol.cells = {3, 5, 7};
    protocol.truths = 20;
    protocol.mesh_truths = 1;
    protocol.mesh_most_cells = 5;
  }
  return protocol;
}

constexpr const char* kReference = "database";
constexpr const char* kMesh = "tbl-mesh";
const std::vector<std::string>& Policies() {
  static const std::vector<std::string> kPolicies = {kReference,     "online",         "tbl",   kMesh,
                                                     "tbl-per-cost", "tbl-submodular", "random"};
  return kPolicies;
}

/// The walks of one policy over the truths of one problem.
struct Cell {
  CostKind cost;
  int cells;
  std::string policy;
  std::string Key() const { return fmt::format("{} {} {}", ToString(cost), cells, policy); }
};

struct World {
  std::map<CostKind, std::shared_ptr<const workflow::PlanningSetup>> setups;
  Protocol protocol;
  std::uint64_t seed = 1;

  planner::Extents ExtentsFor(int cells) const {
    const Task& task = setups.at(CostKind::kDistance)->task();
    std::vector<int> counts;
    for (const UncertainAxis& axis : task.axes) counts.push_back(std::min(cells, axis.max_cells));
    return planner::ExtentsAlong(planner::AxesOf(task), counts);
  }
};

/// Indices of the truths: all, or distinct ones drawn; the same for every policy and cost.
std::vector<std::size_t> TruthsOf(std::size_t hypotheses, int most, std::uint64_t seed) {
  std::vector<std::size_t> order(hypotheses);
  std::iota(order.begin(), order.end(), std::size_t{0});
  RandomStream random(seed, hypotheses, "truths of figure-tbl");
  for (std::size_t i = 0; i + 1 < order.size(); ++i) std::swap(order[i], order[i + random.Index(order.size() - i)]);
  order.resize(std::min(order.size(), static_cast<std::size_t>(most)));
  return order;
}

json Measure(const World& world, const Cell& cell) {
  const workflow::PlanningSetup& setup = *world.setups.at(cell.cost);
  const planner::Extents extents = world.ExtentsFor(cell.cells);
  const planner::Problem problem = planner::MakeCuboidProblem(setup.task(), setup.map, extents);
  json result = {{"hypotheses", problem.hypotheses.size()}};

  std::shared_ptr<const planner::PolicyGraph> stored;
  workflow::PolicyFactory factory;
  if (cell.policy == kReference) {
    planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
    options.gap = world.protocol.gap;
    const planner::SolverResult solved = planner::Solve(problem, options);
    if (!solved.policy) throw NegativeResult(kFigureTblName, "no policy for " + planner::ToString(extents));
    stored = std::make_shared<const planner::PolicyGraph>(*solved.policy);
    result["offline_cpu_s"] = solved.cpu_s;
    result["exact_cost"] = solved.expected_cost;
    result["lower_bound"] = solved.lower_bound;
  } else {
    workflow::PolicyOptions options;
    options.online.expansion_limit = world.protocol.online_expansions;
    factory = workflow::MakePolicyFactory(cell.policy, nullptr, options);
    factory({problem, extents, setup, world.seed, 0});  // what a factory makes once and shares is not planning online
  }
  const int most = cell.policy == kMesh ? world.protocol.mesh_truths : world.protocol.truths;
  const std::vector<std::size_t> truths = TruthsOf(problem.hypotheses.size(), most, world.seed);
  std::map<std::string, int> failures;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    const std::unique_ptr<policies::Policy> policy =
        stored ? std::make_unique<policies::DatabasePolicy>(stored) : factory({problem, extents, setup, world.seed, i});
    const policies::KinematicWalk walk = policies::Walk(problem, *policy, problem.hypotheses[truths[i]]);
    if (!walk.localized) ++failures[walk.reason];
    result["costs"].push_back(walk.cost);
    result["moves"].push_back(walk.moves);
    result["contacts"].push_back(walk.contacts);
    result["cpu_s"].push_back(walk.cpu_s);
  }
  result["failures"] = failures;
  return result;
}

std::vector<Cell> CellsOf(const Protocol& protocol) {
  std::vector<Cell> cells;
  for (const CostKind cost : {CostKind::kDistance, CostKind::kTime}) {
    for (const int n : protocol.cells) {
      for (const std::string& policy : Policies()) {
        if (policy == kMesh && (cost == CostKind::kTime || n > protocol.mesh_most_cells)) continue;
        cells.push_back({cost, n, policy});
      }
    }
  }
  return cells;
}

/// Measures the cells that are missing. False: cancelled.
bool MeasureAll(const World& world, const std::vector<Cell>& cells, const ExperimentRequest& request,
                CellStore& store) {
  const auto measure = [&](std::size_t i) {
    if (request.shard && static_cast<int>(i) % request.shard->count != request.shard->index - 1) return;
    if (store.Find(cells[i].Key()) == nullptr) store.Put(cells[i].Key(), Measure(world, cells[i]));
  };
  return ParallelFor(cells.size(), request.jobs, measure, request.progress, request.cancellation);
}

std::vector<double> Values(const json& cell, const char* key) { return cell.at(key).get<std::vector<double>>(); }

/// Cost relative to the database policy over the truths that both walked from.
Estimate CostRelativeTo(const json& cell, const json& reference) {
  std::vector<double> costs = Values(cell, "costs");
  std::vector<double> base = Values(reference, "costs");
  base.resize(std::min(base.size(), costs.size()));
  costs.resize(base.size());
  return BootstrapRatio(costs, base);
}

FigurePoint Point(double x, const Estimate& y) { return {x, y.value, y.low, y.high}; }

}  // namespace

ExperimentResult RunFigureTbl(const ExperimentRequest& request) {
  World world;
  world.protocol = ProtocolOf(request.quick);
  world.seed = request.seed;
  const std::string task = request.task.empty() ? "plug" : request.task;
  for (const CostKind cost : {CostKind::kDistance, CostKind::kTime}) {
    workflow::PlanningSetupOptions options;
    options.cost_kind = cost;
    options.jobs = request.jobs;
    options.progress = request.map_progress;
    world.setups[cost] = std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup(task, options));
  }
  const Protocol& protocol = world.protocol;
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kFigureTblName},
                     {"version", FEELER_VERSION},
                     {"task", world.setups.at(CostKind::kDistance)->task().name},
                     {"fingerprint", world.setups.at(CostKind::kDistance)->fingerprint},
                     {"cells_per_axis", protocol.cells},
                     {"truths", protocol.truths},
                     {"mesh_truths", protocol.mesh_truths},
                     {"tbl_actions", workflow::PolicyOptions().tbl_actions},
                     {"gap", protocol.gap},
                     {"online_expansions", protocol.online_expansions},
                     {"seed", request.seed}};
  const std::vector<Cell> cells = CellsOf(protocol);
  CellStore store(PartialFile(request, kFigureTblName), result.settings);
  store.Adopt(PartialFilesOf(request, kFigureTblName), result.settings);
  if (!MeasureAll(world, cells, request, store) || request.shard) return result;

  result.complete = true;
  result.table.columns = {"cost",        "cells_per_axis", "hypotheses",   "policy",        "walks",      "localized",
                          "cost_mean",   "relative_cost",  "relative_low", "relative_high", "plan_cpu_s", "plan_low_s",
                          "plan_high_s", "offline_cpu_s",  "moves_mean",   "contacts_mean", "printed"};
  result.text = fmt::format(
      "Localization by touch: cost and planning time against the number of hypotheses, task {}, seed {}. Kinematic:\n"
      "targets at hypotheses, outcomes from the contact map. Cost relative to the database policy (certified to "
      "{:g}),\n"
      "planning CPU of a whole episode, online. Intervals: 95 %, bootstrap. The paper prints no values: both grow.\n\n"
      "{:<9} {:>6} {:<15} {:>6} {:>9} {:>10} {:>22} {:>26} {:>7}\n",
      result.settings["task"].get<std::string>(), request.seed, protocol.gap, "cost", "hyp.", "policy", "walks",
      "localized", "mean cost", "relative", "planning, ms", "moves");
  std::map<std::string, FigureSeries> relative[2], planning;
  for (const Cell& cell : cells) {
    const json& value = *store.Find(cell.Key());
    const json& reference = *store.Find(Cell{cell.cost, cell.cells, kReference}.Key());
    const std::vector<double> costs = Values(value, "costs");
    int failed = 0;
    for (const auto& [reason, count] : value.at("failures").items()) failed += count.get<int>();
    const int walks = static_cast<int>(costs.size());
    const auto hypotheses = value.at("hypotheses").get<double>();
    const Estimate cost_ratio = CostRelativeTo(value, reference);
    const Estimate cpu = BootstrapMean(Values(value, "cpu_s"));
    const double moves = Mean(Values(value, "moves"));
    const std::string cost_name(ToString(cell.cost));
    result.table.rows.push_back({cost_name, cell.cells, hypotheses, cell.policy, walks, walks - failed, Mean(costs),
                                 cost_ratio.value, cost_ratio.low, cost_ratio.high, cpu.value, cpu.low, cpu.high,
                                 value.value("offline_cpu_s", 0.0), moves, Mean(Values(value, "contacts")), json()});
    result.text +=
        fmt::format("{:<9} {:>6g} {:<15} {:>6} {:>9} {:>10.2f} {:>22} {:>26} {:>7.1f}\n", cost_name, hypotheses,
                    cell.policy, walks, walks - failed, Mean(costs),
                    fmt::format("{:.2f} [{:.2f}, {:.2f}]", cost_ratio.value, cost_ratio.low, cost_ratio.high),
                    fmt::format("{:.2f} [{:.2f}, {:.2f}]", 1e3 * cpu.value, 1e3 * cpu.low, 1e3 * cpu.high), moves);
    result.details["cells"].push_back({{"key", cell.Key()},
                                       {"failures", value.at("failures")},
                                       {"exact_cost", value.value("exact_cost", json())},
                                       {"lower_bound", value.value("lower_bound", json())}});
    if (cell.policy != kMesh) {
      FigureSeries& series = relative[cell.cost == CostKind::kTime ? 1 : 0][cell.policy];
      series.name = cell.policy;
      series.points.push_back(Point(hypotheses, cost_ratio));
    }
    if (cell.cost == CostKind::kDistance) {
      FigureSeries& series = planning[cell.policy];
      series.name = cell.policy;
      series.points.push_back(Point(hypotheses, cpu));
    }
  }
  const auto add_figure = [&](const std::string& title, const std::string& y_label, bool y_log,
                              const std::map<std::string, FigureSeries>& by_policy) {
    Figure figure{title, "hypotheses", y_label, true, y_log, {}};
    for (const std::string& policy : Policies()) {
      const auto series = by_policy.find(policy);
      if (series != by_policy.end()) figure.series.push_back(series->second);
    }
    result.figures.push_back(std::move(figure));
  };
  add_figure("Cost against the number of hypotheses: distance", "distance relative to the database policy", false,
             relative[0]);
  add_figure("Cost against the number of hypotheses: time", "seconds relative to the database policy", false,
             relative[1]);
  add_figure("Planning time online, of an episode", "CPU seconds", true, planning);
  return result;
}

}  // namespace feeler::evaluation
