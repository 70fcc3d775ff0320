#include "feeler/env/contact/line_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "feeler/env/model/geom_shapes.h"

namespace feeler::env {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// MuJoCo's convex collider decides overlaps shallower than this, measured along the normal, one way or the other.
constexpr double kJudgeDepth_m = 2e-6;
/// An end that lies deeper than this in another obstacle decides nothing.
constexpr double kHiddenDepth_m = 1e-4;
/// An obstacle that lies deeper than this in what others block has no say, far beyond rounding.
constexpr double kCoveredDepth_m = 1e-9;

}  // namespace

ObstacleSet::ObstacleSet(const TaskModel& model, FeltGeoms felt, const Eigen::Quaterniond& target_orientation)
    : task_model(&model), geoms(std::move(felt)), orientation(target_orientation) {
  const Pose rotation = MakePose(Eigen::Vector3d::Zero(), orientation);
  std::vector<Pose> poses;
  std::vector<std::optional<planner::ConvexShape>> targets;  // nothing for a plane
  for (const int geom : geoms.target) {
    poses.push_back(rotation * GeomInBody(*model.model, geom, model.target_body));
    targets.emplace_back();
    if (model.model->geom_type[geom] == mjGEOM_PLANE) continue;
    targets.back().emplace(PieceOf(*model.model, geom, poses.back()));
    targets.back()->PrepareForMany();
  }
  for (const int tool_geom : geoms.tool) {
    planner::ConvexShape tool(PieceOf(*model.model, tool_geom, GeomInBody(*model.model, tool_geom, model.tool_body)));
    tool.PrepareForMany();
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const int target_geom = geoms.target[i];
      if (targets[i]) {
        obstacles.push_back({tool_geom, target_geom, planner::ConvexObstacle(tool, *targets[i])});
        continue;
      }
      const Eigen::Vector3d normal = poses[i].linear().col(2);
      half_spaces.push_back(
          {tool_geom, target_geom, normal, normal.dot(poses[i].translation()) - normal.dot(tool.Support(-normal))});
    }
  }
}

LineSweep::LineSweep(const ObstacleSet& set, double accuracy_m)
    : set_(set), accuracy_m_(accuracy_m), judge_(*set.task_model, set.geoms, set.orientation) {}

double LineSweep::JudgeEnd(int tool_geom, int target_geom, int axis, Eigen::Vector3d& point_m, double end_m,
                           double inside_m, double probe_m) {
  const auto overlap = [&](double t) {
    point_m[axis] = t;
    return judge_.Overlap(tool_geom, target_geom, point_m);
  };
  const double outward = end_m < inside_m ? -1.0 : 1.0;
  double inner = end_m - outward * std::min(probe_m, std::abs(end_m - inside_m));
  double outer = end_m + outward * probe_m;
  const bool inner_overlaps = overlap(inner);
  const bool outer_overlaps = overlap(outer);
  if (inner_overlaps && !outer_overlaps) return end_m;

  if (!inner_overlaps) {
    if (!overlap(inside_m)) return inside_m;  // MuJoCo sees no overlap here at all
    outer = inner;
    inner = inside_m;
  } else {
    double reach = probe_m;
    do {
      inner = outer;
      reach *= 2;
      outer = end_m + outward * reach;
    } while (overlap(outer) && reach < 1.0);
  }
  while (std::abs(outer - inner) > accuracy_m_ / 4) {
    const double middle = 0.5 * (inner + outer);
    (overlap(middle) ? inner : outer) = middle;
  }
  const double judged = 0.5 * (inner + outer);
  ++corrections_;
  largest_correction_m_ = std::max(largest_correction_m_, std::abs(judged - end_m));
  return judged;
}

bool LineSweep::Hidden(double end_m) const {
  return std::any_of(cuts_.begin(), cuts_.end(), [&](const FoundCut& found) {
    return found.cut.low_m < end_m - kHiddenDepth_m && found.cut.high_m > end_m + kHiddenDepth_m;
  });
}

void LineSweep::Judge(const ObstacleSet::Obstacle& obstacle, int axis, Eigen::Vector3d point_m, planner::Cut& cut) {
  const double middle = 0.5 * (cut.low_m + cut.high_m);
  const auto judge = [&](double end_m, double slope) {
    if (Hidden(end_m)) return end_m;
    const double probe_m = std::max(accuracy_m_, kJudgeDepth_m / std::max(slope, 1e-3));
    return JudgeEnd(obstacle.tool_geom, obstacle.target_geom, axis, point_m, end_m, middle, probe_m);
  };
  const double low = judge(cut.low_m, cut.low_slope);
  const double high = judge(cut.high_m, cut.high_slope);
  cut.low_m = low;
  cut.high_m = high;
}

void LineSweep::Cover(const planner::Cut& cut) {
  BlockedStretch all{cut.low_m, cut.high_m};
  std::erase_if(covered_, [&](const BlockedStretch& other) {
    const bool meets = other.low_m <= all.high_m && other.high_m >= all.low_m;
    if (meets) all = {std::min(all.low_m, other.low_m), std::max(all.high_m, other.high_m)};
    return meets;
  });
  covered_.push_back(all);
}

bool LineSweep::IsCovered(const planner::ConvexObstacle& shape, int axis) const {
  return std::any_of(covered_.begin(), covered_.end(), [&](const BlockedStretch& stretch) {
    return stretch.low_m < shape.min_m()[axis] - kCoveredDepth_m &&
           stretch.high_m > shape.max_m()[axis] + kCoveredDepth_m;
  });
}

const std::vector<BlockedStretch>& LineSweep::Sweep(int axis, const Eigen::Vector3d& point_m, bool judged) {
  stretches_.clear();
  cuts_.clear();
  covered_.clear();
  for (const ObstacleSet::Obstacle& obstacle : set_.obstacles) {
    if (!judged && IsCovered(obstacle.shape, axis)) continue;  // its ends would be looked at by the judge
    const auto cut = obstacle.shape.CutBy(axis, point_m);
    if (!cut) continue;
    cuts_.push_back({&obstacle, *cut});
    if (!judged) Cover(*cut);
  }
  if (judged) {
    judged_ = cuts_;
    for (FoundCut& found : judged_) Judge(*found.obstacle, axis, point_m, found.cut);
    cuts_.swap(judged_);
  }
  for (const FoundCut& found : cuts_) {
    if (found.cut.low_m < found.cut.high_m) stretches_.push_back({found.cut.low_m, found.cut.high_m});
  }
  for (const ObstacleSet::HalfSpace& space : set_.half_spaces) {
    Eigen::Vector3d across = point_m;
    across[axis] = 0;
    const double slope = space.normal[axis];
    const double room = space.offset_m - space.normal.dot(across);
    if (std::abs(slope) < 1e-12) {
      if (room > 0) stretches_.push_back({-kInfinity, kInfinity});
    } else if (slope > 0) {
      stretches_.push_back({-kInfinity, room / slope});
    } else {
      stretches_.push_back({room / slope, kInfinity});
    }
  }
  std::sort(stretches_.begin(), stretches_.end(),
            [](const BlockedStretch& a, const BlockedStretch& b) { return a.low_m < b.low_m; });
  std::size_t kept = 0;
  for (const BlockedStretch& stretch : stretches_) {
    if (kept > 0 && stretch.low_m <= stretches_[kept - 1].high_m + accuracy_m_) {
      stretches_[kept - 1].high_m = std::max(stretches_[kept - 1].high_m, stretch.high_m);
    } else {
      stretches_[kept++] = stretch;
    }
  }
  stretches_.resize(kept);
  return stretches_;
}

}  // namespace feeler::env
