#include "feeler/policies/touch/touch_actions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "feeler/planner/belief/hull.h"

namespace feeler::policies {
namespace {

constexpr std::array<std::array<int, 3>, 6> kAxisOrders = {
    {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

/// Appends the leg along `axis` from `at` to coordinate `to`, and goes there.
void GoAlong(int axis, int to, Cell& at, std::vector<GuardedMove>& way) {
  const int cells = to - at[axis];
  if (cells != 0) way.push_back({MakeDirection(axis, cells), std::abs(cells)});
  at[axis] = to;
}

int Length(const std::vector<GuardedMove>& way) {
  int cells = 0;
  for (const GuardedMove& move : way) cells += move.cells;
  return cells;
}

}  // namespace

Cell EndOf(const Cell& robot, const TouchAction& action, int cells) {
  Cell end = robot;
  for (const GuardedMove& move : action.approach) end += move.cells * UnitCell(move.direction);
  return end + cells * UnitCell(action.probe.direction);
}

TouchActions::TouchActions(const planner::Problem& problem, std::shared_ptr<const planner::ActiveRegion> region,
                           int vicinity_cells, int longest_probe)
    : problem_(problem), region_(std::move(region)), vicinity_cells_(vicinity_cells), longest_probe_(longest_probe) {}

CellBox TouchActions::Vicinity(const Belief& belief) const {
  const CellBox hull = HullOf(belief.hypotheses);
  const Cell margin = Cell::Constant(vicinity_cells_);
  CellBox box{hull.min + region_->box.min - margin, hull.max + region_->box.max + margin};
  box.min = box.min.cwiseMax(problem_.workspace.min);
  box.max = box.max.cwiseMin(problem_.workspace.max);
  return box;
}

bool TouchActions::Free(const Belief& belief, const Cell& from, const GuardedMove& move) const {
  return std::none_of(belief.hypotheses.begin(), belief.hypotheses.end(), [&](const Hypothesis& h) {
    return problem_.map->Predict(from - h.offset, move, h.orientation).contact;
  });
}

bool TouchActions::FreeWay(const Belief& belief, const Cell& pose, const std::vector<GuardedMove>& way) const {
  // What ends at a pose is blocked there, if anywhere: the last leg first.
  Cell at = pose;
  for (auto move = way.rbegin(); move != way.rend(); ++move) {
    at -= move->cells * UnitCell(move->direction);
    if (!Free(belief, at, *move)) return false;
  }
  return true;
}

std::optional<std::vector<GuardedMove>> TouchActions::Approach(const Belief& belief, const Cell& pose) const {
  if (!problem_.workspace.Contains(pose)) return std::nullopt;
  std::vector<GuardedMove> way;
  for (const std::array<int, 3>& order : kAxisOrders) {
    way.clear();
    Cell at = belief.robot;
    for (const int axis : order) GoAlong(axis, pose[axis], at, way);
    if (FreeWay(belief, pose, way)) return way;
  }
  const CellBox hull = HullOf(belief.hypotheses);
  std::vector<std::vector<GuardedMove>> detours;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool above : {true, false}) {
      if (!(above ? region_->free_above : region_->free_below)[static_cast<std::size_t>(axis)]) continue;
      const int level = above ? std::max(hull.max[axis] + region_->box.max[axis], belief.robot[axis])
                              : std::min(hull.min[axis] + region_->box.min[axis], belief.robot[axis]);
      Cell corner = belief.robot;
      corner[axis] = level;
      if (!problem_.workspace.Contains(corner)) continue;
      Cell at = belief.robot;
      way.clear();
      GoAlong(axis, level, at, way);
      GoAlong((axis + 1) % 3, pose[(axis + 1) % 3], at, way);
      GoAlong((axis + 2) % 3, pose[(axis + 2) % 3], at, way);
      GoAlong(axis, pose[axis], at, way);
      detours.push_back(way);
    }
  }
  std::stable_sort(detours.begin(), detours.end(), [](const auto& a, const auto& b) { return Length(a) < Length(b); });
  for (const std::vector<GuardedMove>& detour : detours) {
    if (FreeWay(belief, pose, detour)) return detour;
  }
  return std::nullopt;
}

std::optional<TouchAction> TouchActions::ActionAt(const Belief& belief, const Cell& pose, Direction direction) const {
  const int axis = AxisOf(direction);
  const int room = direction == MakeDirection(axis, 1) ? problem_.workspace.max[axis] - pose[axis]
                                                       : pose[axis] - problem_.workspace.min[axis];
  const int cells = std::min(longest_probe_, room);
  if (cells < 1) return std::nullopt;
  auto way = Approach(belief, pose);
  if (!way) return std::nullopt;
  return TouchAction{std::move(*way), {direction, cells}};
}

std::optional<TouchAction> TouchActions::Sample(const Belief& belief, RandomStream& random, int tries) const {
  const CellBox box = Vicinity(belief);
  const Cell size = box.Size();
  if (size.minCoeff() < 1) return std::nullopt;
  for (int i = 0; i < tries; ++i) {
    Cell pose;
    for (int axis = 0; axis < 3; ++axis) {
      pose[axis] = box.min[axis] + static_cast<int>(random.Index(static_cast<std::uint64_t>(size[axis])));
    }
    const Direction direction = kDirections[random.Index(kDirectionCount)];
    const Hypothesis& any = belief.hypotheses[random.Index(belief.hypotheses.size())];
    if (planner::Blocked(problem_, pose, any)) continue;  // most poses that are none are found out by any hypothesis
    if (auto action = ActionAt(belief, pose, direction)) return action;
  }
  return std::nullopt;
}

std::vector<TouchAction> TouchActions::All(const Belief& belief) const {
  std::vector<TouchAction> actions;
  const CellBox box = Vicinity(belief);
  for (int x = box.min.x(); x <= box.max.x(); ++x) {
    for (int y = box.min.y(); y <= box.max.y(); ++y) {
      for (int z = box.min.z(); z <= box.max.z(); ++z) {
        for (const Direction direction : kDirections) {
          if (auto action = ActionAt(belief, Cell(x, y, z), direction)) actions.push_back(std::move(*action));
        }
      }
    }
  }
  return actions;
}

bool TouchActions::Evaluate(const Belief& belief, planner::OutcomeModel& outcomes, TouchAction& action,
                            TouchValue& value) const {
  const Cell pose = EndOf(belief.robot, action, 0);
  std::vector<double> contact(static_cast<std::size_t>(action.probe.cells), 0.0);  // weight by cells travelled
  double total = 0.0;
  double touching = 0.0;
  int farthest = -1;
  for (const Hypothesis& h : belief.hypotheses) {
    const Outcome outcome = outcomes.Predict(pose - h.offset, action.probe, h.orientation);
    total += h.weight;
    if (!outcome.contact) continue;
    contact[static_cast<std::size_t>(outcome.cells)] += h.weight;
    touching += h.weight;
    farthest = std::max(farthest, outcome.cells);
  }
  if (farthest < 0) return false;
  action.probe.cells = farthest + 1;

  value = {};
  const CostWeights& cost = problem_.cost;
  for (const GuardedMove& leg : action.approach) value.cost += cost.Of({leg.cells, false}, leg.direction);
  const auto add = [&](double weight, const Outcome& outcome) {
    if (weight <= 0.0) return;
    const double probability = weight / total;
    value.information_gain -= probability * std::log(probability);
    value.pruned += probability * (1.0 - probability);
    value.cost += probability * cost.Of(outcome, action.probe.direction);
  };
  for (int cells = 0; cells <= farthest; ++cells) add(contact[static_cast<std::size_t>(cells)], {cells, true});
  const double free = total - touching;
  if (free > 1e-12 * total) add(free, {farthest + 1, false});
  return true;
}

}  // namespace feeler::policies
