#include "feeler/execution/contact/insertion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "feeler/execution/contact/confirm.h"
#include "feeler/execution/contact/free_path.h"

namespace feeler::execution {
namespace {

/// A clear displacement in front of the mouth is looked for up to here.
constexpr int kFarthestClear = 8;
/// A shorter way between the walls is not worth motions of its own, cells.
constexpr double kLeastSlide = 2.0;
/// Of the way through the mouth: less, and something stood there.
constexpr double kThrough = 0.5;

Cell Nearest(const Eigen::Vector3d& cells) {
  return {static_cast<int>(std::lround(cells.x())), static_cast<int>(std::lround(cells.y())),
          static_cast<int>(std::lround(cells.z()))};
}

/// From in front of the mouth down to `bottom`. Slowly through the mouth, where a face may stand instead of the
/// opening, and where the bottom may come; faster between the walls, if that saves anything.
MotionReport GoDown(const Task& task, const Eigen::Vector3d& target, double depth, const Eigen::Vector3d& bottom,
                    Mover& mover) {
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  const double slow_m_s = std::min(mover.options().insertion_speed_m_s, mover.SpeedInto(inward));
  const double fast_m_s = mover.options().sliding_speed_m_s;
  // A tool that is in by more than the tolerance of its depth has found the opening; the bottom comes no sooner than
  // that above the depth.
  const double surely = mover.Cells(task.tolerance.vertical_m);
  const double begun = (mover.position() - target).dot(inward);
  const double sliding = depth - 2.0 * surely;
  if (begun > surely || !(slow_m_s < mover.options().insertion_speed_m_s) || sliding < kLeastSlide) {
    return mover.Insert(bottom);
  }
  const MotionReport mouth = mover.Insert(target + surely * inward, slow_m_s, false);
  const double reached = (mouth.end - target).dot(inward);
  if (mouth.reason == StopReason::kForceLimit || reached < kThrough * surely) return mover.Insert(bottom);
  const MotionReport slid = mover.Insert(target + (depth - surely) * inward, fast_m_s, false);
  if (slid.reason == StopReason::kForceLimit) return slid;
  return mover.Insert(bottom, slow_m_s);
}

}  // namespace

BelievedInsertion ApproachAndInsert(const Task& task, const planner::ContactMap& map, const Eigen::Vector3d& target,
                                    int orientation, Mover& mover, std::vector<Touch>& evidence) {
  const Eigen::Vector3d out = -UnitVector(task.insertion);
  std::optional<Cell> gate;
  for (int cells = 1; cells <= kFarthestClear && !gate; ++cells) {
    const Cell candidate = Nearest(cells * out - map.phase());
    if (IsClear(map, candidate, orientation)) gate = candidate;
  }
  if (!gate) throw LostTrack("insertion: no free place in front of the opening");
  const Cell here = NearestFree(map, mover.position() - target, orientation);
  auto path = FindFreePath(map, here, EndAt(*gate), orientation);
  if (!path) throw LostTrack("insertion: no free way to the opening");
  if (path->size() > 1) path->pop_back();  // the last leg ends exactly in front of the opening, not at a lattice point
  if (!FollowPath(map, target, *path, "approach", mover, evidence)) {
    return {false, false, "insertion: unexpected contact on the way to the opening"};
  }
  // In front of the opening, exactly; then near it.
  const Eigen::Vector3d gate_displacement = gate->cast<double>() + map.phase();
  // As near as a probe begins before what it may meet: the face beside the opening.
  const double standoff = FacesAgree(map, evidence, target, task.insertion, orientation)
                              ? mover.FaceMargin()
                              : mover.options().fast_margin_cells;
  const double gate_distance = std::max(standoff, gate_displacement.dot(out));
  for (const double distance : {gate_distance, standoff}) {
    const Eigen::Vector3d place = target + distance * out;
    if ((mover.position() - place).norm() < 0.05) continue;
    const Eigen::Vector3d from = mover.position();
    const MotionReport report = mover.Fast(place, "approach");
    if (report.contact) {
      evidence.push_back(ContactAfter(from, report.end));
      const Eigen::Vector3d back = from - report.end;
      mover.Retreat(back.norm() > 1.0 ? Eigen::Vector3d(report.end + back.normalized()) : from);
      return {false, false, "insertion: unexpected contact in front of the opening"};
    }
  }
  mover.ZeroWrench();
  return InsertFromHere(task, target, FarthestInside(task, map, orientation, mover.frame().cell_m), mover);
}

double FarthestInside(const Task& task, const planner::ContactMap& map, int orientation, double cell_m) {
  const int along = AxisOf(task.insertion);
  const Cell deep = Nearest(task.insertion_depth_m / cell_m * UnitVector(task.insertion) - map.phase());
  const Cell size = map.domain().max - map.domain().min;
  const int u = (along + 1) % 3;
  const int v = (along + 2) % 3;
  const int widest = std::max(size[u], size[v]);
  int ring = 0;
  const auto clear_on = [&](int cells) {
    for (int i = -cells; i <= cells; ++i) {
      for (const int side : {-cells, cells}) {
        Cell one = deep;
        one[u] += i;
        one[v] += side;
        Cell other = deep;
        other[u] += side;
        other[v] += i;
        if (!map.Blocked(one, orientation) || !map.Blocked(other, orientation)) return true;
      }
    }
    return false;
  };
  while (ring < widest && !clear_on(ring)) ++ring;
  return std::max(0.5 * ring, 2.0 * task.tolerance.LargestLateral() / cell_m);
}

BelievedInsertion InsertFromHere(const Task& task, const Eigen::Vector3d& target, double farthest_inside,
                                 Mover& mover) {
  const Eigen::Vector3d out = -UnitVector(task.insertion);
  const double depth = mover.Cells(task.insertion_depth_m);
  const double overdrive = mover.Cells(mover.options().insertion_overdrive_m);
  const MotionReport report = GoDown(task, target, depth, target - (depth + overdrive) * out, mover);
  const Eigen::Vector3d displacement = report.end - target;
  const double reached = -displacement.dot(out);
  Eigen::Vector3d lateral = displacement + reached * out;
  lateral[AxisOf(task.insertion)] = 0.0;
  const double cell_m = mover.frame().cell_m;
  if ((depth - reached) * cell_m > task.tolerance.vertical_m) {
    return {false, true,
            fmt::format("insertion: stopped after {:.2f} of {:.2f} mm ({})", 1e3 * reached * cell_m,
                        1e3 * task.insertion_depth_m, ToString(report.reason))};
  }
  if (lateral.cwiseAbs().maxCoeff() > farthest_inside) {
    return {false, true,
            fmt::format("insertion: at depth, but {:.2f} mm beside the opening",
                        1e3 * lateral.cwiseAbs().maxCoeff() * cell_m)};
  }
  return {true, false, "inserted"};
}

}  // namespace feeler::execution
