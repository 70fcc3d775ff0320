#include "feeler/planner/motion/transfer_planner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "feeler/core/error.h"
#include "feeler/planner/motion/ompl_search.h"

namespace feeler::planner {
namespace {

double Length(const TransferPlanner& planner, const std::vector<Eigen::VectorXd>& way_points) {
  double length = 0.0;
  for (std::size_t i = 1; i < way_points.size(); ++i) length += planner.Sweep(way_points[i - 1], way_points[i]);
  return length;
}

}  // namespace

TransferPlanner::TransferPlanner(JointBounds bounds, ValidityFunction valid, TransferOptions options)
    : bounds_(std::move(bounds)), valid_(std::move(valid)), options_(std::move(options)) {
  const auto require = [](bool good, const char* what, const char* mend) {
    if (!good) throw InputError("transfer planner", what, mend);
  };
  const Eigen::Index joints = bounds_.lower_rad.size();
  require(joints > 0 && bounds_.upper_rad.size() == joints, "bounds of different sizes",
          "one lower and upper per joint");
  require((bounds_.lower_rad.array() < bounds_.upper_rad.array()).all(), "empty bounds", "lower < upper");
  require(static_cast<bool>(valid_), "no validity function", "give one");
  if (options_.reach_m.size() == 0) options_.reach_m = Eigen::VectorXd::Ones(joints);
  require(options_.reach_m.size() == joints && (options_.reach_m.array() > 0.0).all(), "reach_m out of range",
          "one positive reach per joint");
  require(options_.check_spacing_m > 0.0 && options_.extension_m > 0.0, "spacing or extension out of range",
          "both > 0");
  require(options_.iterations_per_goal >= 0 && options_.iterations_all_goals >= 0 && options_.plans_to_compare >= 1 &&
              options_.simplification_rounds >= 0,
          "a negative effort", "iterations and rounds >= 0, plans_to_compare >= 1");
}

double TransferPlanner::Sweep(const Eigen::VectorXd& from_rad, const Eigen::VectorXd& to_rad) const {
  return options_.reach_m.dot((from_rad - to_rad).cwiseAbs());
}

bool TransferPlanner::WithinBounds(const Eigen::VectorXd& q_rad) const {
  return (q_rad.array() >= bounds_.lower_rad.array()).all() && (q_rad.array() <= bounds_.upper_rad.array()).all();
}

bool TransferPlanner::MotionValid(const Eigen::VectorXd& from_rad, const Eigen::VectorXd& to_rad) const {
  if (!WithinBounds(from_rad) || !WithinBounds(to_rad)) return false;  // the box is convex: what is between, too
  if (!valid_(from_rad) || !valid_(to_rad)) return false;
  // Coarse to fine: a motion that is not free is found out early.
  const double sweep = Sweep(from_rad, to_rad);
  int segments = 1;
  while (sweep > segments * options_.check_spacing_m) {
    segments *= 2;
    for (int i = 1; i < segments; i += 2) {
      if (!valid_(from_rad + (static_cast<double>(i) / segments) * (to_rad - from_rad))) return false;
    }
  }
  return true;
}

TransferPlan TransferPlanner::Plan(const Eigen::VectorXd& start_rad,
                                   const std::vector<Eigen::VectorXd>& goals_rad) const {
  TransferPlan plan;
  const Eigen::Index joints = bounds_.lower_rad.size();
  bool sizes = start_rad.size() == joints;
  for (const Eigen::VectorXd& goal : goals_rad) sizes = sizes && goal.size() == joints;
  if (!sizes) throw InputError("transfer planner", "a configuration of another size", "one angle per joint");

  // A planner of its own, so that the checks of this plan are counted. Nothing is free any more once it is to end.
  bool ended = false;
  const ValidityFunction counted = [&](const Eigen::VectorXd& q) {
    ended = ended || (options_.most_checks > 0 && plan.checks >= options_.most_checks) ||
            (options_.stop && options_.stop());
    if (ended) return false;
    ++plan.checks;
    return valid_(q);
  };
  TransferOptions counting_options = options_;
  counting_options.stop = [&] { return ended; };
  const TransferPlanner counting(bounds_, counted, counting_options);
  const auto fail = [&](TransferStatus status, const char* reason) {
    plan.status = status;
    plan.reason = reason;
    return plan;
  };
  if (!WithinBounds(start_rad)) return fail(TransferStatus::kStartInvalid, "the start is beyond the joint limits");
  if (!counted(start_rad) && !ended) return fail(TransferStatus::kStartInvalid, "the start is not free of collision");
  if (goals_rad.empty()) return fail(TransferStatus::kNoGoal, "no configuration reaches the goal");

  // Goals that can be stood at, nearest first.
  std::vector<int> order;
  for (std::size_t i = 0; i < goals_rad.size(); ++i) {
    if (WithinBounds(goals_rad[i]) && counted(goals_rad[i])) order.push_back(static_cast<int>(i));
  }
  if (ended) return fail(TransferStatus::kStopped, "the search for a way was given up");
  if (order.empty()) return fail(TransferStatus::kNoGoal, "every configuration that reaches the goal collides");
  const auto goal_at = [&](int index) -> const Eigen::VectorXd& { return goals_rad[static_cast<std::size_t>(index)]; };
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return Sweep(start_rad, goal_at(a)) < Sweep(start_rad, goal_at(b)); });

  double shortest = std::numeric_limits<double>::infinity();
  int found = 0;
  const auto offer = [&](std::vector<Eigen::VectorXd> way_points, int goal) {
    if (way_points.empty()) return;
    ++found;
    const double length = Length(*this, way_points);
    if (length >= shortest) return;
    shortest = length;
    plan.way_points = std::move(way_points);
    plan.goal = goal;
  };
  for (const int goal : order) {
    // A way is at least as long as the straight motion, so farther goals cannot win any more.
    if (Sweep(start_rad, goal_at(goal)) >= shortest || found >= options_.plans_to_compare) break;
    if (counting.MotionValid(start_rad, goal_at(goal))) {
      offer({start_rad, goal_at(goal)}, goal);
    } else if (options_.iterations_per_goal > 0) {
      offer(SearchWay(counting, counted, start_rad, {goal_at(goal)}, options_.iterations_per_goal,
                      options_.seed + static_cast<std::uint64_t>(goal)),
            goal);
    }
  }
  if (found == 0 && options_.iterations_all_goals > 0) {
    std::vector<Eigen::VectorXd> goals;
    goals.reserve(order.size());
    for (const int goal : order) goals.push_back(goal_at(goal));
    std::vector<Eigen::VectorXd> way_points =
        SearchWay(counting, counted, start_rad, goals, options_.iterations_all_goals, options_.seed);
    if (!way_points.empty()) {
      const auto end = std::find_if(order.begin(), order.end(),
                                    [&](int goal) { return (goal_at(goal) - way_points.back()).norm() < 1e-12; });
      offer(std::move(way_points), end == order.end() ? -1 : *end);
    }
  }
  if (found == 0 && ended) return fail(TransferStatus::kStopped, "the search for a way was given up");
  if (found == 0) return fail(TransferStatus::kNotFound, "the search found no way around the obstacles");
  plan.status = TransferStatus::kPlanned;
  plan.sweep_m = shortest;
  return plan;
}

}  // namespace feeler::planner
