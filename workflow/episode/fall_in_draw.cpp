#include "feeler/workflow/episode/fall_in_draw.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "feeler/planner/belief/hull.h"

namespace feeler::workflow {
namespace {

/// Moves of one walk; a policy that has not come to an end by then goes in circles.
constexpr int kMostMoves = 1000;

/// Displacement of the tool from the mouth across the insertion, in cells, where a probe meets the closed opening
/// most squarely on the policy's walk under `truth`; empty if none comes within a cell.
std::optional<Eigen::Vector3d> SquarestHit(const Task& task, const planner::Problem& problem, policies::Policy& policy,
                                           const planner::Hypothesis& truth) {
  constexpr double kReach = 1.0;
  constexpr double kAtMouth = 0.6;  // cells between the wall met and the plane of the mouth
  const int along = AxisOf(task.insertion);
  std::optional<Eigen::Vector3d> best;
  double least = kReach + 1e-9;
  policies::Belief belief{problem.start, problem.hypotheses};
  policy.Begin(problem);
  for (int i = 0; i < kMostMoves; ++i) {
    const policies::Decision decision = policy.Next(belief);
    const auto* move = std::get_if<GuardedMove>(&decision);
    if (move == nullptr) break;
    const Outcome outcome = planner::Simulate(problem, belief.robot, *move, truth);
    if (move->direction == task.insertion && outcome.contact) {
      const Cell displacement = belief.robot - truth.offset;
      Eigen::Vector3d place = displacement.cast<double>() + problem.map->phase();
      place[along] += SignOf(move->direction) * problem.map->Travel(displacement, move->direction, truth.orientation);
      const bool at_mouth = std::abs(place[along]) < kAtMouth;
      place[along] = 0.0;
      if (at_mouth && place.cwiseAbs().maxCoeff() < least) {
        least = place.cwiseAbs().maxCoeff();
        best = place;
      }
    }
    std::erase_if(belief.hypotheses, [&](const planner::Hypothesis& h) {
      return !(planner::Simulate(problem, belief.robot, *move, h) == outcome);
    });
    belief.robot += outcome.cells * UnitCell(move->direction);
    if (!policy.Observe(outcome)) break;
  }
  return best;
}

}  // namespace

std::optional<Pose> DrawFallIn(const Task& task, const planner::Problem& problem, policies::Policy& policy,
                               const Pose& world_T_estimate, RandomStream& random) {
  constexpr double kSquare = 0.25;  // cells
  std::vector<std::size_t> order(problem.hypotheses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.Index(i)]);
  std::optional<Eigen::Vector3d> target;  // lattice coordinates
  double least = std::numeric_limits<double>::infinity();
  const CellBox hull = planner::HullOf(problem.hypotheses);
  const Eigen::Vector3d lower = hull.min.cast<double>();
  const Eigen::Vector3d upper = hull.max.cast<double>();
  for (const std::size_t i : order) {
    const planner::Hypothesis& h = problem.hypotheses[i];
    const auto hit = SquarestHit(task, problem, policy, h);
    if (!hit || hit->norm() >= least) continue;
    least = hit->norm();
    target = h.offset.cast<double>() + *hit;  // the opening under the tool
    if (least < kSquare) break;
  }
  if (!target) return std::nullopt;
  // Off the middle by less than the opening forgives, at any height.
  const double aside = 0.3 * task.tolerance.lateral_m / task.cell_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double reach = axis == AxisOf(task.insertion) ? 0.5 : aside;
    (*target)[axis] += random.Uniform(-reach, reach);
  }
  Pose truth = world_T_estimate;
  truth.translation() = world_T_estimate * Eigen::Vector3d((*target - 0.5 * (lower + upper)) * task.cell_m);
  return truth;
}

}  // namespace feeler::workflow
