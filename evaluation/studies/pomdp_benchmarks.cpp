#include "feeler/evaluation/studies/pomdp_benchmarks.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <optional>
#include <system_error>

#include "feeler/core/error.h"
#include "feeler/core/worker_pool.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/model/rock_sample.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

/// Tiger (Kaelbling, Littman and Cassandra 1998), with a discount of 0.95.
constexpr const char* kTiger = R"(discount: 0.95
values: reward
states: tiger-left tiger-right
actions: listen open-left open-right
observations: tiger-left tiger-right
T: listen identity
T: open-left uniform
T: open-right uniform
O: listen
0.85 0.15
0.15 0.85
O: open-left uniform
O: open-right uniform
R: listen : * : * : * -1
R: open-left : tiger-left : * : * -100
R: open-left : tiger-right : * : * 10
R: open-right : tiger-left : * : * 10
R: open-right : tiger-right : * : * -100
)";

/// Bounds that SARSOP (APPL) reaches in 60 s on one core.
struct Printed {
  const char* model;
  double lower;
  double upper;
};
constexpr Printed kSarsop[] = {{"Tiger", 19.3711, 19.3721},
                               {"Hallway", 0.9883, 1.2132},
                               {"Hallway2", 0.3449, 0.9068},
                               {"TagAvoid", -6.201, -1.813},
                               {"RockSample_7_8", 21.11, 24.61}};

std::optional<Printed> SarsopOn(const std::string& model) {
  for (const Printed& printed : kSarsop) {
    if (model == printed.model) return printed;
  }
  return std::nullopt;
}

planner::Pomdp RockSampleOf(int size, int rocks, std::uint64_t seed) {
  planner::RockSample problem = planner::DrawRockSample(size, rocks, seed);
  if (size == 7 && rocks == 8) {  // the rocks that are commonly used
    problem.start = {0, 3};
    problem.rocks = {{2, 0}, {0, 1}, {3, 1}, {6, 3}, {2, 4}, {3, 4}, {5, 5}, {1, 6}};
  }
  planner::Pomdp pomdp = planner::MakeRockSample(problem);
  pomdp.name = fmt::format("RockSample_{}_{}", size, rocks);
  return pomdp;
}

std::vector<planner::Pomdp> ModelsOf(const std::string& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    throw InputError("--pomdps", folder + " is no folder", "give a folder of .pomdp and .pomdpx files");
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".pomdp" || entry.path().extension() == ".pomdpx") files.push_back(entry.path());
  }
  if (error || files.empty()) {
    throw InputError("--pomdps", folder + " holds no .pomdp or .pomdpx", "give a folder of such files");
  }
  std::ranges::sort(files);
  std::vector<planner::Pomdp> models;
  for (const std::filesystem::path& file : files) {
    models.push_back(planner::ReadPomdp(file.string()));
    models.back().name = file.stem().string();
  }
  return models;
}

json FiniteNumber(double value) { return std::isfinite(value) ? json(value) : json(); }

/// Null if it was cancelled.
json BoundsOf(const planner::Pomdp& pomdp, const PomdpBenchmarksProtocol& protocol, const ExperimentRequest& request) {
  planner::PomdpSolverOptions options;
  options.kind = planner::PomdpSolverOptions::DefaultKind(pomdp);
  options.time_limit_s = protocol.time_limit_s;
  options.seed = request.seed;
  options.cancellation = request.cancellation;
  json curve = json::array();
  options.on_bounds = [&](const planner::ValueBounds& row) {
    curve.push_back({row.wall_s, FiniteNumber(row.lower), FiniteNumber(row.upper)});
  };
  const planner::PomdpResult result = planner::SolvePomdp(pomdp, options);
  if (result.status == planner::SolverStatus::kCancelled) return nullptr;
  return {{"status", planner::ToString(result.status)},
          {"lower", FiniteNumber(result.value_lower)},
          {"upper", FiniteNumber(result.value_upper)},
          {"cpu_s", result.cpu_s},
          {"curve", curve}};
}

json RtdpBelOn(const planner::Pomdp& pomdp, const PomdpBenchmarksProtocol& protocol, const ExperimentRequest& request) {
  planner::PomdpSolverOptions options;
  options.kind = planner::PomdpSolverKind::kRtdpBel;
  options.levels = protocol.levels;
  options.time_limit_s = protocol.bel_time_limit_s;
  options.simulate = protocol.episodes;
  options.seed = request.seed;
  options.cancellation = request.cancellation;
  const planner::PomdpResult result = planner::SolvePomdp(pomdp, options);
  if (result.status == planner::SolverStatus::kCancelled) return nullptr;
  json cell = {{"status", planner::ToString(result.status)},
               {"value", FiniteNumber(result.value_lower)},
               {"cpu_s", result.cpu_s}};
  if (result.simulated) {
    cell["mean"] = result.simulated->mean;
    cell["half_width"] = result.simulated->half_width;
    cell["episodes"] = result.simulated->episodes;
  }
  return cell;
}

std::string NumberText(const json& number, const char* format) {
  return number.is_number() ? fmt::format(fmt::runtime(format), number.get<double>()) : "-";
}

double WidthOf(const json& bounds) {
  if (!bounds.at("lower").is_number() || !bounds.at("upper").is_number()) return std::nan("");
  return bounds.at("upper").get<double>() - bounds.at("lower").get<double>();
}

void AddRow(const planner::Pomdp& pomdp, const json& cell, ExperimentResult& result) {
  const json& bounds = cell.at("bounds");
  const json& bel = cell.at("rtdp_bel");
  const std::optional<Printed> printed = SarsopOn(pomdp.name);
  const double width = WidthOf(bounds);
  const json ratio = printed ? FiniteNumber(width / (printed->upper - printed->lower)) : json();
  const auto bel_number = [&](const char* key) { return bel.contains(key) ? bel.at(key) : json(); };
  result.table.rows.push_back({pomdp.name, pomdp.state_count(), pomdp.action_count(), pomdp.observation_count(),
                               pomdp.discount, bounds.at("lower"), bounds.at("upper"), FiniteNumber(width),
                               bounds.at("cpu_s"), printed ? json(printed->lower) : json(),
                               printed ? json(printed->upper) : json(), ratio, bel.at("value"), bel_number("mean"),
                               bel_number("half_width"), bel.at("cpu_s")});
  result.text += fmt::format(
      "{:<16} {:>7} {:>10} {:>10} {:>8} {:>8} | {:>19} {:>7} | {:>9} {:>9} {:>7} {:>8}\n", pomdp.name,
      pomdp.state_count(), NumberText(bounds.at("lower"), "{:.4f}"), NumberText(bounds.at("upper"), "{:.4f}"),
      NumberText(FiniteNumber(width), "{:.4f}"), NumberText(bounds.at("cpu_s"), "{:.1f}"),
      printed ? fmt::format("{:g} to {:g}", printed->lower, printed->upper) : "-", NumberText(ratio, "{:.2f}"),
      NumberText(bel.at("value"), "{:.3f}"), NumberText(bel_number("mean"), "{:.3f}"),
      NumberText(bel_number("half_width"), "{:.3f}"), NumberText(bel.at("cpu_s"), "{:.1f}"));
  FigureSeries series{pomdp.name, {}};
  for (const json& row : bounds.at("curve")) {
    if (!row[1].is_number() || !row[2].is_number()) continue;
    const double gap = row[2].get<double>() - row[1].get<double>();
    if (row[0].get<double>() > 0.0 && gap > 0.0) series.points.push_back({row[0].get<double>(), gap, gap, gap});
  }
  result.figures.front().series.push_back(std::move(series));
}

}  // namespace

ExperimentResult RunPomdpBenchmarksOn(const std::vector<planner::Pomdp>& models,
                                      const PomdpBenchmarksProtocol& protocol, const ExperimentRequest& request) {
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kPomdpBenchmarksName},
                     {"version", FEELER_VERSION},
                     {"time_limit_s", protocol.time_limit_s},
                     {"rtdp_bel_time_limit_s", protocol.bel_time_limit_s},
                     {"levels", protocol.levels},
                     {"episodes", protocol.episodes},
                     {"seeds", result.seeds}};
  for (const planner::Pomdp& pomdp : models) result.settings["models"].push_back(pomdp.name);
  CellStore cells(PartialFile(request, kPomdpBenchmarksName), result.settings);
  std::atomic<bool> cancelled = false;
  std::mutex mutex;  // guards done
  std::int64_t done = 0;
  const auto solve = [&](std::size_t i) {
    const planner::Pomdp& pomdp = models[i];
    if (cells.Find(pomdp.name) == nullptr) {
      json bounds = BoundsOf(pomdp, protocol, request);
      json bel = bounds.is_null() ? json() : RtdpBelOn(pomdp, protocol, request);
      if (bel.is_null()) {
        cancelled = true;
        return;
      }
      cells.Put(pomdp.name, {{"bounds", std::move(bounds)}, {"rtdp_bel", std::move(bel)}});
    }
    const std::lock_guard lock(mutex);
    ++done;
    if (request.progress) request.progress(done, static_cast<std::int64_t>(models.size()));
  };
  if (!ParallelFor(models.size(), request.jobs, solve, {}, request.cancellation) || cancelled) return result;

  result.complete = true;
  result.table.columns = {"model",      "states",    "actions",         "observations", "discount",     "lower",
                          "upper",      "width",     "cpu_s",           "sarsop_lower", "sarsop_upper", "width_ratio",
                          "rtdp_value", "rtdp_mean", "rtdp_half_width", "rtdp_cpu_s"};
  result.figures.push_back({"Width of the proven interval", "wall seconds", "upper - lower", true, true, {}});
  result.text = fmt::format(
      "General POMDPs: proven interval after {:g} s, SARSOP's after 60 s, and RTDP-Bel ({} levels, {:g} s): the exact "
      "value of its controller, and the mean of {} episodes of it\n\n"
      "{:<16} {:>7} {:>10} {:>10} {:>8} {:>8} | {:>19} {:>7} | {:>9} {:>9} {:>7} {:>8}\n",
      protocol.time_limit_s, protocol.levels, protocol.bel_time_limit_s, protocol.episodes, "model", "states", "lower",
      "upper", "width", "CPU s", "SARSOP", "ratio", "RTDP-Bel", "episodes", "+-", "CPU s");
  for (const planner::Pomdp& pomdp : models) {
    const json& cell = *cells.Find(pomdp.name);
    AddRow(pomdp, cell, result);
    result.details["statuses"][pomdp.name] = {{"bounds", cell.at("bounds").at("status")},
                                              {"rtdp-bel", cell.at("rtdp_bel").at("status")}};
  }
  return result;
}

ExperimentResult RunPomdpBenchmarks(const ExperimentRequest& request) {
  PomdpBenchmarksProtocol protocol;
  std::vector<planner::Pomdp> models;
  if (!request.pomdps.empty()) models = ModelsOf(request.pomdps);
  const auto add = [&](planner::Pomdp pomdp) {
    const bool there = std::ranges::any_of(models, [&](const planner::Pomdp& m) { return m.name == pomdp.name; });
    if (!there) models.push_back(std::move(pomdp));
  };
  add(planner::ParseCassandraPomdp(kTiger, "Tiger"));
  models.back().name = "Tiger";
  add(RockSampleOf(4, 4, request.seed));
  if (request.quick) {
    protocol.time_limit_s = 5.0;
    protocol.bel_time_limit_s = 5.0;
    protocol.episodes = 1000;
  } else {
    add(RockSampleOf(5, 5, request.seed));
    add(RockSampleOf(7, 8, request.seed));
  }
  return RunPomdpBenchmarksOn(models, protocol, request);
}

}  // namespace feeler::evaluation
