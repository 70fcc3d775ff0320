#include "feeler/evaluation/studies/pomdp_experience.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include "feeler/core/worker_pool.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/noise/noisy_pomdp.h"
#include "feeler/planner/pomdp/model/rock_sample.h"
#include "feeler/planner/pomdp/model/tag.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

/// Every way to move one rock by one cell, at most `most` of them, evenly among all.
PomdpFamily RocksMoved(int size, int rocks, std::size_t most, std::uint64_t seed) {
  const planner::RockSample base = planner::DrawRockSample(size, rocks, seed);
  std::vector<planner::RockSample> moved;
  for (std::size_t r = 0; r < base.rocks.size(); ++r) {
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      planner::RockSample other = base;
      other.rocks[r].x += dx;
      other.rocks[r].y += dy;
      const planner::RockSample::Cell& rock = other.rocks[r];
      const bool inside = rock.x >= 0 && rock.y >= 0 && rock.x < size && rock.y < size;
      if (inside && std::ranges::count(other.rocks, rock) == 1) moved.push_back(other);
    }
  }
  PomdpFamily family{fmt::format("RockSample_{}_{}, a rock moved", size, rocks), {planner::MakeRockSample(base)}, {}};
  const std::size_t count = std::min(most, moved.size());
  for (std::size_t i = 0; i < count; ++i) {
    family.members.push_back(planner::MakeRockSample(moved[i * moved.size() / count]));
  }
  family.epsilons = {1.02, 1.05};
  return family;
}

/// A room of 5 x 4 cells with one wall in it that stands elsewhere each time.
PomdpFamily WallsMoved(std::size_t most) {
  const std::vector<std::pair<int, int>> places = {{2, 1}, {3, 1}, {1, 2}, {2, 2}, {3, 2}};
  PomdpFamily family{"Tag, a wall moved", {}, {1.02, 1.05}};
  for (std::size_t i = 0; i < places.size() && i <= most; ++i) {
    planner::TagRoom room{{"R....", ".....", ".....", "....."}, 0.95};
    room.plan[static_cast<std::size_t>(places[i].second)][static_cast<std::size_t>(places[i].first)] = '#';
    family.members.push_back(planner::MakeTag(room));
  }
  return family;
}

/// A wall with a slot at one of several places: three by three hypotheses, noise in all readings. Beliefs do not end
/// here, and no search over them converges: what the same effort finds is compared.
PomdpFamily SlotsMoved(std::size_t most) {
  PomdpFamily family{"noisy slots, the slot moved", {}, {1.0, 1.5}};
  family.levels = 30;
  family.expansion_limit = 20'000;
  for (std::size_t i = 0; i <= most && i < 5; ++i) {
    planner::LatticeProblemData data;
    data.name = fmt::format("slot {}", i);
    data.size = Cell(11, 8, 1);
    data.start = Cell(1, 7, 0);
    data.tool = {Cell::Zero()};
    const int slot = 3 + static_cast<int>(i);
    for (int x = 1; x <= 8; ++x) {
      data.target.emplace_back(x, 1, 0);
      if (x != slot) data.target.emplace_back(x, 2, 0);
    }
    for (int x = 0; x < 3; ++x) {
      for (int y = 0; y < 3; ++y) data.hypotheses.push_back({Cell(x, y, 0), 0, 1.0});
    }
    data.move_lengths = {1, 2, 4};
    data.cost = {1.0, 0.5, 0.1};
    planner::NoisyProblem noisy{planner::MakeLatticeProblem(data), {0.02, 0.01, 0.01}, {0.6, 100.0}};
    family.members.push_back(planner::MakeNoisyPomdp(noisy));
  }
  return family;
}

std::uint32_t Named(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? ~std::uint32_t{0} : static_cast<std::uint32_t>(found - names.begin());
}

/// The controller in the numbers of another model: by names, and branches of observations that it does not have are
/// left out.
planner::PomdpController Renamed(const planner::PomdpController& controller, const planner::Pomdp& from,
                                 const planner::Pomdp& to) {
  planner::PomdpController renamed = controller;
  for (planner::PomdpController::Node& node : renamed.nodes) {
    const std::uint32_t action = Named(to.actions, from.actions[node.action]);
    node.action = action < to.action_count() ? action : 0;
    for (auto& branch : node.branches)
      branch.observation = Named(to.observations, from.observations[branch.observation]);
    std::erase_if(node.branches, [&](const auto& branch) { return branch.observation >= to.observation_count(); });
    std::ranges::sort(node.branches, {}, &planner::PomdpController::Branch::observation);
  }
  return renamed;
}

planner::PomdpSolverOptions OptionsOf(const PomdpExperienceProtocol& protocol, const ExperimentRequest& request,
                                      const PomdpFamily& family, double epsilon) {
  planner::PomdpSolverOptions options;
  options.kind = planner::PomdpSolverKind::kRtdpBel;
  options.levels = family.levels > 0 ? family.levels : protocol.levels;
  options.exact_trials = false;  // they would go on with rare beliefs long after the policy is there
  options.epsilon = epsilon;
  options.expansion_limit = std::min(protocol.expansion_limit, family.expansion_limit);
  options.time_limit_s = protocol.time_limit_s;
  options.seed = request.seed;
  options.cancellation = request.cancellation;
  return options;
}

json CellOf(const planner::PomdpResult& result) {
  return {{"status", planner::ToString(result.status)},
          {"value", std::isfinite(result.value_lower) ? json(result.value_lower) : json()},
          {"expansions", result.expansions},
          {"cpu_s", result.cpu_s}};
}

/// Cells of one family and one epsilon: none and with experience, per member but the first. Null if cancelled.
json Measure(const PomdpFamily& family, double epsilon, const PomdpExperienceProtocol& protocol,
             const ExperimentRequest& request) {
  const planner::Pomdp& base = family.members.front();
  const planner::PomdpResult first = planner::SolvePomdp(base, OptionsOf(protocol, request, family, epsilon));
  json cells = json::array();
  for (std::size_t m = 1; m < family.members.size(); ++m) {
    const planner::Pomdp& member = family.members[m];
    planner::PomdpSolverOptions options = OptionsOf(protocol, request, family, epsilon);
    const planner::PomdpResult none = planner::SolvePomdp(member, options);
    planner::PomdpController experience;
    if (first.controller) {
      experience = Renamed(*first.controller, base, member);
      options.kind = planner::PomdpSolverKind::kERtdpBel;
      options.experience = &experience;
    }
    const planner::PomdpResult with = planner::SolvePomdp(member, options);
    if (none.status == planner::SolverStatus::kCancelled || with.status == planner::SolverStatus::kCancelled) {
      return nullptr;
    }
    cells.push_back({{"none", CellOf(none)}, {"experience", CellOf(with)}});
  }
  return cells;
}

void AddRow(const PomdpFamily& family, double epsilon, const json& cells, ExperimentResult& result) {
  double expansions[2] = {0.0, 0.0};
  double cpu_s[2] = {0.0, 0.0};
  double value[2] = {0.0, 0.0};
  int converged[2] = {0, 0};
  constexpr const char* kWays[2] = {"none", "experience"};
  for (const json& cell : cells) {
    for (int way = 0; way < 2; ++way) {
      const json& of = cell.at(kWays[way]);
      expansions[way] += of.at("expansions").get<double>();
      cpu_s[way] += of.at("cpu_s").get<double>();
      value[way] += of.at("value").is_number() ? of.at("value").get<double>() : std::nan("");
      converged[way] += of.at("status") == planner::ToString(planner::SolverStatus::kConverged);
    }
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, cells.size()));
  // One that experience solves without an expansion counts as one.
  const double speedup = expansions[0] / std::max(expansions[1], 1.0);
  const double cpu_speedup = cpu_s[1] > 0.0 ? cpu_s[0] / cpu_s[1] : 0.0;
  const auto number = [](double x) { return std::isfinite(x) ? json(x) : json(); };
  result.table.rows.push_back({family.name, family.members.front().state_count(), cells.size(), epsilon,
                               expansions[0] / count, expansions[1] / count, speedup, cpu_s[0] / count,
                               cpu_s[1] / count, cpu_speedup, number(value[0] / count), number(value[1] / count),
                               converged[0], converged[1]});
  result.text += fmt::format(
      "{:<28} {:>6} {:>7} {:>7.2f} | {:>11.0f} {:>11.0f} {:>7.2f} | {:>8.3f} {:>8.3f} {:>7.2f} | {:>9.3f} {:>9.3f} | "
      "{} and {}\n",
      family.name, family.members.front().state_count(), cells.size(), epsilon, expansions[0] / count,
      expansions[1] / count, speedup, cpu_s[0] / count, cpu_s[1] / count, cpu_speedup, value[0] / count,
      value[1] / count, converged[0], converged[1]);
}

}  // namespace

ExperimentResult RunPomdpExperienceOn(const std::vector<PomdpFamily>& families, const PomdpExperienceProtocol& protocol,
                                      const ExperimentRequest& request) {
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kPomdpExperienceName},
                     {"version", FEELER_VERSION},
                     {"levels", protocol.levels},
                     {"expansion_limit", protocol.expansion_limit},
                     {"time_limit_s", protocol.time_limit_s},
                     {"seeds", result.seeds}};
  std::vector<std::pair<const PomdpFamily*, double>> all;
  for (const PomdpFamily& family : families) {
    result.settings["families"].push_back({{"name", family.name}, {"members", family.members.size()}});
    for (const double epsilon : family.epsilons) all.emplace_back(&family, epsilon);
  }
  const auto name = [](const std::pair<const PomdpFamily*, double>& at) {
    return fmt::format("{} {}", at.first->name, at.second);
  };
  CellStore cells(PartialFile(request, kPomdpExperienceName), result.settings);
  std::atomic<bool> cancelled = false;
  std::mutex mutex;  // guards done
  std::int64_t done = 0;
  const auto measure = [&](std::size_t i) {
    if (cells.Find(name(all[i])) == nullptr) {
      json cell = Measure(*all[i].first, all[i].second, protocol, request);
      if (cell.is_null()) {
        cancelled = true;
        return;
      }
      cells.Put(name(all[i]), std::move(cell));
    }
    const std::lock_guard lock(mutex);
    ++done;
    if (request.progress) request.progress(done, static_cast<std::int64_t>(all.size()));
  };
  if (!ParallelFor(all.size(), request.jobs, measure, {}, request.cancellation) || cancelled) return result;

  result.complete = true;
  result.table.columns = {"family",     "states",           "problems",       "epsilon",  "expansions_none",
                          "expansions", "speedup",          "cpu_none_s",     "cpu_s",    "cpu_speedup",
                          "value_none", "value_experience", "converged_none", "converged"};
  result.text = fmt::format(
      "RTDP-Bel without experience, and E-RTDP-Bel with the policy of the first problem of the family: means a "
      "problem\n"
      "{:<28} {:>6} {:>7} {:>7} | {:>11} {:>11} {:>7} | {:>8} {:>8} {:>7} | {:>9} {:>9} | converged\n",
      "family", "states", "problems", "epsilon", "none", "experience", "speedup", "none s", "exp. s", "speedup",
      "value", "value exp.");
  for (const auto& at : all) {
    const json& cell = *cells.Find(name(at));
    AddRow(*at.first, at.second, cell, result);
    result.details["problems"][name(at)] = cell;
  }
  return result;
}

ExperimentResult RunPomdpExperience(const ExperimentRequest& request) {
  PomdpExperienceProtocol protocol;
  const std::size_t most = request.quick ? 1 : 4;
  if (request.quick) protocol.expansion_limit = 20'000;
  return RunPomdpExperienceOn(
      {RocksMoved(4, request.quick ? 2 : 4, most, request.seed), WallsMoved(most), SlotsMoved(most)}, protocol,
      request);
}

}  // namespace feeler::evaluation
