#include "feeler/evaluation/studies/noise_price.h"

#include <fmt/format.h>

#include <atomic>
#include <mutex>

#include "feeler/core/worker_pool.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/planner/belief/slot_lattice.h"
#include "feeler/planner/noise/carry_out.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "feeler/planner/solve.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;
using NamedProblem = std::pair<std::string, planner::Problem>;

constexpr const char* kKinds[] = {"missed contact", "false stop", "slip"};

planner::Noise NoiseOf(int kind, double level) {
  planner::Noise noise;
  (kind == 0 ? noise.missed_contact : kind == 1 ? noise.false_stop : noise.slip) = level;
  return noise;
}

struct Measured {
  std::size_t problem = 0;
  int kind = 0;
  double level = 0.0;
};

std::string CellOf(const std::vector<NamedProblem>& problems, const Measured& m) {
  return fmt::format("{} {} {}", problems[m.problem].first, kKinds[m.kind], m.level);
}

/// Null if it was cancelled.
json Measure(const planner::Problem& problem, const planner::Noise& noise, const NoisePriceProtocol& protocol,
             const ExperimentRequest& request) {
  planner::SolverOptions options;
  options.gap = protocol.gap;
  options.seed = request.seed;
  options.cancellation = request.cancellation;
  options.canonical_translation = false;
  options.expansion_limit = 100'000;
  options.first_policy_in_any_case = true;
  const planner::SolverResult unaware = planner::Solve(problem, options);
  if (!unaware.complete()) return nullptr;
  options.expansion_limit = protocol.expansion_limit;
  const planner::NoisyProblem noisy{problem, noise, {}};
  const planner::NoisyResult aware = planner::SolveNoisy(noisy, options);
  if (aware.status == planner::SolverStatus::kCancelled) return nullptr;
  const planner::NoisyEvaluation carried = planner::CarryOut(noisy, *unaware.policy);
  return {{"status", planner::ToString(aware.status)},
          {"cost", aware.evaluation.expected_cost},
          {"lower", aware.lower_bound},
          {"right", aware.evaluation.right},
          {"cpu_s", aware.cpu_s},
          {"expansions", aware.expansions},
          {"nodes", aware.policy.nodes.size()},
          {"unaware_cost", carried.expected_cost},
          {"unaware_right", carried.right},
          {"unaware_cpu_s", unaware.cpu_s},
          {"noise_free_cost", unaware.expected_cost}};
}

void Fill(const std::vector<NamedProblem>& problems, const std::vector<Measured>& all, const CellStore& cells,
          ExperimentResult& result) {
  result.table.columns = {"problem",       "hypotheses",    "noise",       "level", "cost",
                          "lower",         "ratio",         "right",       "cpu_s", "unaware_cost",
                          "unaware_right", "unaware_cpu_s", "policy_nodes"};
  result.text = fmt::format("{:<12} {:<15} {:>6} | {:>9} {:>9} {:>7} {:>7} {:>8} | {:>12} {:>13}\n", "problem", "noise",
                            "level", "cost", "lower", "ratio", "right", "CPU s", "unaware cost", "unaware right");
  for (std::size_t p = 0; p < problems.size(); ++p) {
    result.figures.push_back(
        {"Price of noise: " + problems[p].first, "probability a step", "expected cost", false, false, {}});
  }
  Figure times{"CPU time against noise", "probability a step", "CPU s", false, true, {}};
  for (const Measured& m : all) {
    const auto& [name, problem] = problems[m.problem];
    const json& cell = *cells.Find(CellOf(problems, m));
    const double cost = cell.at("cost");
    const double lower = cell.at("lower");
    const double unaware = cell.at("unaware_cost");
    const double cpu_s = cell.at("cpu_s");
    result.table.rows.push_back({name, problem.hypotheses.size(), kKinds[m.kind], m.level, cost, lower, cost / lower,
                                 cell.at("right"), cpu_s, unaware, cell.at("unaware_right"), cell.at("unaware_cpu_s"),
                                 cell.at("nodes")});
    result.text +=
        fmt::format("{:<12} {:<15} {:>6} | {:>9.3f} {:>9.3f} {:>7.4f} {:>7.4f} {:>8.2f} | {:>12.3f} {:>13.4f}\n", name,
                    kKinds[m.kind], m.level, cost, lower, cost / lower, cell.at("right").get<double>(), cpu_s, unaware,
                    cell.at("unaware_right").get<double>());
    Figure& figure = result.figures[m.problem];
    const auto series = static_cast<std::size_t>(2 * m.kind);
    if (figure.series.size() < series + 2) {
      figure.series.push_back({fmt::format("{}, known", kKinds[m.kind]), {}});
      figure.series.push_back({fmt::format("{}, not known", kKinds[m.kind]), {}});
      times.series.push_back({fmt::format("{}, {}", name, kKinds[m.kind]), {}});
    }
    figure.series[series].points.push_back({m.level, cost, lower, cost});
    figure.series[series + 1].points.push_back({m.level, unaware, unaware, unaware});
    if (cpu_s > 0.0) times.series.back().points.push_back({m.level, cpu_s, cpu_s, cpu_s});
    result.details["statuses"][CellOf(problems, m)] = cell.at("status");
  }
  result.figures.push_back(std::move(times));
}

}  // namespace

ExperimentResult RunNoisePriceOn(const std::vector<NamedProblem>& problems, const NoisePriceProtocol& protocol,
                                 const ExperimentRequest& request) {
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kNoisePriceName},
                     {"version", FEELER_VERSION},
                     {"quick", request.quick},
                     {"levels", protocol.levels},
                     {"gap", protocol.gap},
                     {"expansion_limit", protocol.expansion_limit},
                     {"confidence", planner::Declaration{}.confidence},
                     {"wrong_cells", planner::Declaration{}.wrong_cells},
                     {"seeds", result.seeds}};
  std::vector<Measured> all;
  for (std::size_t p = 0; p < problems.size(); ++p) {
    result.settings["problems"].push_back(problems[p].first);
    for (int kind = 0; kind < 3; ++kind) {
      for (const double level : protocol.levels) all.push_back({p, kind, level});
    }
  }
  CellStore cells(PartialFile(request, kNoisePriceName), result.settings);
  std::mutex mutex;  // guards done
  std::int64_t done = 0;
  std::atomic<bool> cancelled = false;
  const auto measure = [&](std::size_t i) {
    const Measured& m = all[i];
    if (cancelled) return;
    if (cells.Find(CellOf(problems, m)) == nullptr) {
      json cell = Measure(problems[m.problem].second, NoiseOf(m.kind, m.level), protocol, request);
      if (cell.is_null()) {
        cancelled = true;
        return;
      }
      cells.Put(CellOf(problems, m), std::move(cell));
    }
    const std::lock_guard lock(mutex);
    ++done;
    if (request.progress) request.progress(done, static_cast<std::int64_t>(all.size()));
  };
  if (!ParallelFor(all.size(), request.jobs, measure, {}, request.cancellation) || cancelled) return result;
  result.complete = true;
  Fill(problems, all, cells, result);
  return result;
}

ExperimentResult RunNoisePrice(const ExperimentRequest& request) {
  NoisePriceProtocol protocol;
  std::vector<NamedProblem> problems = {{"slot", planner::MakeLatticeProblem(planner::WallWithSlot(4, 4))}};
  const PlanningCase plug = LoadPlanningCase("plug", false, request);
  std::vector<std::string> extents = {"3x3x3", "5x5x5", "7x7x7"};
  if (request.quick) {
    extents = {"3x3x3"};
    protocol.levels = {0.0, 0.02};
    protocol.expansion_limit = 5000;
  }
  for (const std::string& text : extents) {
    problems.emplace_back("plug " + text,
                          planner::MakeCuboidProblem(plug.task, plug.map, planner::ParseExtents(text, plug.task)));
  }
  return RunNoisePriceOn(problems, protocol, request);
}

}  // namespace feeler::evaluation
