#include "feeler/planner/belief/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "feeler/core/error.h"
#include "feeler/planner/belief/hull.h"

namespace feeler::planner {
namespace {

std::string Where(const Problem& problem) {
  return problem.name.empty() ? "problem" : fmt::format("problem {}", problem.name);
}

std::string ToText(const Cell& c) { return fmt::format("[{},{},{}]", c.x(), c.y(), c.z()); }

void ValidateHypotheses(const Problem& problem) {
  const std::string where = Where(problem);
  if (problem.hypotheses.empty()) throw InputError(where, "no hypotheses", "give at least one");
  std::set<std::array<int, 4>> seen;
  for (std::size_t i = 0; i < problem.hypotheses.size(); ++i) {
    const Hypothesis& h = problem.hypotheses[i];
    if (!(h.weight > 0.0) || !std::isfinite(h.weight)) {
      throw InputError(where, fmt::format("hypothesis {} has weight {}", i, h.weight), "weights are positive numbers");
    }
    if (h.orientation < 0 || h.orientation >= problem.map->orientations()) {
      throw InputError(where,
                       fmt::format("hypothesis {} has orientation {}, the contact map has {}", i, h.orientation,
                                   problem.map->orientations()),
                       "use an orientation of the map");
    }
    if (h.offset.cwiseAbs().maxCoeff() > 100000) {
      throw InputError(where, fmt::format("hypothesis {} lies {} cells away", i, ToText(h.offset)), "move it nearer");
    }
    if (!seen.insert({h.offset.x(), h.offset.y(), h.offset.z(), h.orientation}).second) {
      throw InputError(where, fmt::format("hypothesis {} at {} is a duplicate", i, ToText(h.offset)), "list each once");
    }
    if (Blocked(problem, problem.start, h)) {
      throw InputError(
          where,
          fmt::format("the start {} is blocked under hypothesis {} at {}", ToText(problem.start), i, ToText(h.offset)),
          "start where the tool is free under every hypothesis");
    }
  }
}

}  // namespace

void Validate(const Problem& problem) {
  const std::string where = Where(problem);
  if (!problem.map) throw InputError(where, "no contact map", "give the map of the task");
  if (problem.move_lengths.empty()) throw InputError(where, "no move lengths", "list at least one, e.g. [1,2,4,8,16]");
  for (std::size_t i = 0; i < problem.move_lengths.size(); ++i) {
    const int length = problem.move_lengths[i];
    if (length < 1 || length > 1024 || (i > 0 && length <= problem.move_lengths[i - 1])) {
      throw InputError(where, fmt::format("move length {} out of place", length), "lengths increase, from 1 to 1024");
    }
  }
  if (problem.move_lengths.front() != 1) {
    throw InputError(where, "no move of one cell", "list the length 1, so that every move can be taken back");
  }
  for (const double cost : {problem.cost.per_cell, problem.cost.per_contact, problem.cost.per_action}) {
    if (!std::isfinite(cost) || cost < 0.0) {
      throw InputError(where, fmt::format("cost {}", cost), "costs are finite and not negative");
    }
  }
  const auto& beyond = problem.cost.beyond_per_cell;
  if (!std::ranges::all_of(beyond, [](double cost) { return std::isfinite(cost) && cost >= 0.0; })) {
    throw InputError(where, "costs per cell that are below the least of them", "costs are finite and not negative");
  }
  if (problem.cost.per_cell + problem.cost.per_action <= 0.0) {
    throw InputError(where, "moves cost nothing", "give a cost per cell or per action");
  }
  if ((problem.insertable_spread.array() < 0).any())
    throw InputError(where, "negative insertable spread", "give cells of at least 0");
  if (!problem.workspace.Contains(problem.start)) {
    throw InputError(where, fmt::format("the start {} lies outside the workspace", ToText(problem.start)),
                     "move the start inside");
  }
  ValidateHypotheses(problem);
}

bool EquallyLikely(const Problem& problem) {
  return std::ranges::all_of(problem.hypotheses,
                             [&](const Hypothesis& h) { return h.weight == problem.hypotheses.front().weight; });
}

Outcome Simulate(const Problem& problem, const Cell& r, const GuardedMove& move, const Hypothesis& h) {
  Cell displacement = r - h.offset;
  const Cell step = UnitCell(move.direction);
  for (int cells = 0; cells < move.cells; ++cells) {
    if (!problem.map->StepFree(displacement, move.direction, h.orientation)) return {cells, true};
    displacement += step;
  }
  return {move.cells, false};
}

bool IsGoal(const Problem& problem, const std::vector<Hypothesis>& hypotheses) {
  if (hypotheses.size() <= 1) return true;
  if (problem.goal == GoalKind::kSingleton) return false;
  for (const Hypothesis& h : hypotheses) {
    if (h.orientation != hypotheses.front().orientation) return false;
  }
  return ((HullOf(hypotheses).Size() - Cell::Ones()).array() <= problem.insertable_spread.array()).all();
}

}  // namespace feeler::planner
