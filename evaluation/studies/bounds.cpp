#include "feeler/evaluation/studies/bounds.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <mutex>

#include "feeler/core/worker_pool.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

struct Curve {
  std::size_t socket = 0;
  planner::Extents extents;
};

std::string CellOf(const std::string& socket, const planner::Extents& extents) {
  return socket + " " + planner::ToString(extents);
}

json FiniteOrNull(double value) { return std::isfinite(value) ? json(value) : json(); }

/// {"status", "curve": [[wall_s, trials, expansions, lower, upper or null], ...]}, or null if it was cancelled.
json MeasureCurve(const PlanningCase& planning, const planner::Extents& extents, planner::SolverOptions options,
                  std::shared_ptr<const planner::PlanningTables> tables) {
  json curve = json::array();
  options.on_bounds = [&](const planner::BoundsRow& row) {
    curve.push_back(
        {row.wall_s, row.trials, row.expansions, FiniteOrNull(row.lower_bound), FiniteOrNull(row.upper_bound)});
  };
  const planner::Problem problem = planner::MakeCuboidProblem(planning.task, planning.map, extents);
  const planner::SolverResult result = planner::Solve(problem, options, std::move(tables));
  if (result.status == planner::SolverStatus::kCancelled) return nullptr;
  return {{"status", planner::ToString(result.status)}, {"curve", curve}};
}

json RatioOf(const json& row) {
  if (row[4].is_null() || row[3].is_null()) return nullptr;
  const double lower = row[3].get<double>();
  const double upper = row[4].get<double>();
  return lower > 0.0 ? json(upper / lower) : upper == lower ? json(1.0) : json();
}

std::string Text(const json& number, const char* format) {
  return number.is_null() ? "-" : fmt::format(fmt::runtime(format), number.get<double>());
}

/// The certified ratio when `seconds` had passed.
json RatioAt(const json& curve, double seconds) {
  json ratio;
  for (const json& row : curve) {
    if (row[0].get<double>() <= seconds) ratio = RatioOf(row);
  }
  return ratio;
}

}  // namespace

ExperimentResult RunBoundsOn(const std::vector<std::pair<std::string, PlanningCase>>& sockets,
                             const BoundsProtocol& protocol, const ExperimentRequest& request) {
  planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
  options.gap = protocol.gap;
  options.time_limit_s = protocol.time_limit_s;
  options.expansion_limit = protocol.expansion_limit;
  options.first_policy_in_any_case = true;  // the curves begin with it
  options.seed = request.seed;
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kBoundsName},
                     {"version", FEELER_VERSION},
                     {"quick", request.quick},
                     {"extents", protocol.extents},
                     {"solver", ToJson(SolverRow{"certified", "fast", options})},
                     {"seeds", result.seeds}};
  std::vector<Curve> curves;
  for (std::size_t i = 0; i < sockets.size(); ++i) {
    result.settings["sockets"].push_back({{"opening", sockets[i].first},
                                          {"task", sockets[i].second.task.name},
                                          {"fingerprint", sockets[i].second.fingerprint}});
    for (const std::string& extents : protocol.extents) curves.push_back({i, planner::ParseExtents(extents)});
  }

  CellStore cells(PartialFile(request, kBoundsName), result.settings);
  options.cancellation = request.cancellation;
  const auto cell_of = [&](const Curve& curve) { return CellOf(sockets[curve.socket].first, curve.extents); };
  std::vector<std::shared_ptr<const planner::PlanningTables>> tables(sockets.size());
  std::int64_t done = 0;
  for (const Curve& curve : curves) {
    if (cells.Find(cell_of(curve)) != nullptr) {
      ++done;
      continue;
    }
    auto& socket_tables = tables[curve.socket];
    if (socket_tables) continue;
    const PlanningCase& planning = sockets[curve.socket].second;
    socket_tables =
        planner::BuildPlanningTables(planner::MakeCuboidProblem(planning.task, planning.map, curve.extents), options);
  }
  std::mutex mutex;  // guards done
  std::atomic<bool> cancelled = false;
  const auto measure = [&](std::size_t i) {
    const Curve& curve = curves[i];
    if (cancelled || cells.Find(cell_of(curve)) != nullptr) return;
    json cell = MeasureCurve(sockets[curve.socket].second, curve.extents, options, tables[curve.socket]);
    if (cell.is_null()) {
      cancelled = true;
      return;
    }
    cells.Put(cell_of(curve), std::move(cell));
    const std::lock_guard lock(mutex);
    ++done;
    if (request.progress) request.progress(done, static_cast<std::int64_t>(curves.size()));
  };
  if (!ParallelFor(curves.size(), request.jobs, measure, {}, request.cancellation) || cancelled) return result;

  result.complete = true;
  result.table.columns = {"opening",    "extents", "hypotheses", "time_s", "trials",
                          "expansions", "lower",   "upper",      "ratio"};
  result.text = fmt::format(
      "Bounds of the certified solver over time (fast setting, {:g} s a problem); ratio = cost / proven lower bound\n\n"
      "{:<8} {:<10} {:>10} | {:>9} {:>9} {:>9} {:>9} | {:>9} {:>9} {:>9} {:>12}  {}\n",
      protocol.time_limit_s, "opening", "extents", "hypotheses", "at 0.1 s", "at 1 s", "at 10 s", "at end", "lower",
      "upper", "time s", "expansions", "status");
  for (const Curve& curve : curves) {
    const json& cell = *cells.Find(cell_of(curve));
    const std::string& opening = sockets[curve.socket].first;
    for (const json& row : cell.at("curve")) {
      result.table.rows.push_back({opening, planner::ToString(curve.extents), curve.extents.Count(), row[0], row[1],
                                   row[2], row[3], row[4], RatioOf(row)});
    }
    const json& last = cell.at("curve").back();
    result.details["statuses"][cell_of(curve)] = cell.at("status");
    result.text += fmt::format(
        "{:<8} {:<10} {:>10} | {:>9} {:>9} {:>9} {:>9} | {:>9} {:>9} {:>9} {:>12}  {}\n", opening,
        planner::ToString(curve.extents), curve.extents.Count(), Text(RatioAt(cell.at("curve"), 0.1), "{:.4f}"),
        Text(RatioAt(cell.at("curve"), 1.0), "{:.4f}"), Text(RatioAt(cell.at("curve"), 10.0), "{:.4f}"),
        Text(RatioOf(last), "{:.4f}"), Text(last[3], "{:.3f}"), Text(last[4], "{:.3f}"), Text(last[0], "{:.2f}"),
        last[2].get<std::int64_t>(), cell.at("status").get<std::string>());
  }
  return result;
}

ExperimentResult RunBounds(const ExperimentRequest& request) {
  BoundsProtocol protocol;
  if (request.quick) {
    protocol.extents = {"3x3x3", "5x5x5", "7x7x7"};
    protocol.time_limit_s = 5.0;
  }
  return RunBoundsOn(
      {{"closed", LoadPlanningCase("plug", false, request)}, {"open", LoadPlanningCase("plug", true, request)}},
      protocol, request);
}

}  // namespace feeler::evaluation
