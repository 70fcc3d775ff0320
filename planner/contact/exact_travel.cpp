#include "feeler/planner/contact/exact_travel.h"

#include <algorithm>
#include <utility>

#include "feeler/planner/contact/convex_obstacle.h"

namespace feeler::planner {

ExactTravel::ExactTravel(const std::vector<ConvexPiece>& tool, std::vector<ConvexPiece> target)
    : tool_(tool.begin(), tool.end()), target_(std::move(target)) {}

std::vector<double> ExactTravel::Travel(const Pose& frame_T_target, const std::vector<ToolMotion>& motions) {
  std::vector<double> travel(motions.size(), kUnlimited_m);
  Pose turn = Pose::Identity();
  turn.linear() = frame_T_target.linear();
  for (const ConvexPiece& target : target_) {
    ConvexPiece turned = target;
    turned.frame_T_piece = turn * target.frame_T_piece;
    const ConvexShape shape(turned);
    for (const ConvexShape& tool : tool_) {
      const ConvexObstacle obstacle(tool, shape);
      for (std::size_t i = 0; i < motions.size(); ++i) {
        const Eigen::Vector3d from = motions[i].from_m - frame_T_target.translation();
        const int axis = AxisOf(motions[i].direction);
        const double sign = SignOf(motions[i].direction);
        // Behind the tool: nothing to meet. The bounds of the obstacle tell most of the time.
        const double far_end = sign > 0 ? obstacle.max_m()[axis] : obstacle.min_m()[axis];
        if (sign * (far_end - from[axis]) <= 0.0) continue;
        const double near_bound = sign > 0 ? obstacle.min_m()[axis] : obstacle.max_m()[axis];
        if (sign * (near_bound - from[axis]) >= travel[i]) continue;
        const auto cut = obstacle.CutBy(axis, from);
        if (!cut) continue;
        const double near_end = sign > 0 ? cut->low_m : cut->high_m;
        const double leaving = sign > 0 ? cut->high_m : cut->low_m;
        if (sign * (leaving - from[axis]) <= 0.0) continue;
        travel[i] = std::min(travel[i], sign * (near_end - from[axis]));
      }
    }
  }
  return travel;
}

}  // namespace feeler::planner
