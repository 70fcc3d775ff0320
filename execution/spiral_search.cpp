#include "execution/spiral_search.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace feeler::execution {
namespace {

constexpr double kStandoff_m = 0.003;
/// The tool has dropped into the opening, not just over an unevenness.
constexpr double kDrop_m = 0.0008;
/// Stiffness along the insertion with which it is pressed, N/m: a compliant motion's own.
constexpr double kStiffness_n_m = 4000.0;
/// Way points per turn, and how many of them make one motion.
constexpr int kPerTurn = 16;
constexpr int kPerMotion = 8;

}  // namespace

std::optional<Eigen::Vector3d> SpiralSearch(const Task& task, const Eigen::Vector3d& target,
                                            const SpiralOptions& options, Mover& mover) {
  const int axis = AxisOf(task.insertion);
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  const Eigen::Vector3d u = Eigen::Vector3d::Unit((axis + 1) % 3);
  const Eigen::Vector3d v = Eigen::Vector3d::Unit((axis + 2) % 3);
  mover.Retreat(target - mover.Cells(kStandoff_m) * inward);
  const MotionReport face =
      mover.Probe(task.insertion, (target + mover.Cells(kStandoff_m) * inward)[axis], "spiral", PredictedCells{});
  if (!face.contact) return face.end;  // it went in where the face was expected
  const double height = face.end[axis];
  const double pressed = height + SignOf(task.insertion) * mover.Cells(options.press_n / kStiffness_n_m);
  const double turns = options.radius_m / options.pitch_m;
  std::vector<Eigen::Vector3d> way;
  for (int i = 1; i <= static_cast<int>(turns * kPerTurn); ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kPerTurn;
    const double radius = mover.Cells(options.pitch_m) * i / kPerTurn;
    Eigen::Vector3d place = target + radius * (std::cos(angle) * u + std::sin(angle) * v);
    place[axis] = pressed;
    way.push_back(place);
    const bool last = i == static_cast<int>(turns * kPerTurn);
    if (i % kPerMotion != 0 && !last) continue;
    const MotionReport report = mover.Press(way, options.speed_m_s, "spiral");
    way.clear();
    if (SignOf(task.insertion) * (report.end[axis] - height) > mover.Cells(kDrop_m)) {
      Eigen::Vector3d found = report.end;
      found[axis] = height;
      return found;
    }
  }
  mover.Retreat(target - mover.Cells(kStandoff_m) * inward);
  return std::nullopt;
}

}  // namespace feeler::execution
