#include "feeler/core/orientation_lattice.h"

#include <cassert>

namespace feeler {
namespace {

const UncertainAxis* FindAxis(const Task& task, AxisKind kind) {
  for (const UncertainAxis& axis : task.axes) {
    if (axis.kind == kind) return &axis;
  }
  return nullptr;
}

Eigen::Quaterniond Turn(double yaw_rad, double pitch_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY());
}

}  // namespace

int LatticeAngles(const Task& task, AxisKind kind) {
  const UncertainAxis* const axis = FindAxis(task, kind);
  return axis == nullptr ? 1 : axis->max_cells;
}

int LatticeOrientations(const Task& task) {
  return LatticeAngles(task, AxisKind::kYaw) * LatticeAngles(task, AxisKind::kPitch);
}

double LatticeAngle(const Task& task, AxisKind kind, int index) {
  const UncertainAxis* const axis = FindAxis(task, kind);
  return axis == nullptr ? 0.0 : (index - (axis->max_cells - 1) / 2.0) * axis->resolution;
}

Eigen::Quaterniond LatticeOrientation(const Task& task, int orientation) {
  assert(orientation >= 0 && orientation < LatticeOrientations(task));
  const int pitches = LatticeAngles(task, AxisKind::kPitch);
  return Turn(LatticeAngle(task, AxisKind::kYaw, orientation / pitches),
              LatticeAngle(task, AxisKind::kPitch, orientation % pitches));
}

Eigen::Quaterniond FrameREstimate(const Task& task, const std::vector<int>& extents) {
  assert(extents.size() == task.axes.size());
  double yaw_rad = 0.0;
  double pitch_rad = 0.0;
  for (std::size_t i = 0; i < task.axes.size(); ++i) {
    const UncertainAxis& axis = task.axes[i];
    if (!axis.angular()) continue;
    const double mean_index = FirstAngle(extents[i], axis.max_cells) + (extents[i] - 1) / 2.0;
    (axis.kind == AxisKind::kYaw ? yaw_rad : pitch_rad) = (mean_index - (axis.max_cells - 1) / 2.0) * axis.resolution;
  }
  return Turn(yaw_rad, pitch_rad);
}

}  // namespace feeler
