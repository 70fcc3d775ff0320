#include "feeler/execution/contact/spiral_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace feeler::execution {
namespace {

/// The tool has dropped into the opening, not just over an unevenness: of how deep it is pressed.
constexpr double kDrop = 0.25;
/// Stiffness along the insertion with which it is pressed, N/m. Softer it would drop faster: at 4000 N/m walls and
/// edges of the plug's socket are met with 98 N, at 8000 with 59, and at 16000 a third of the openings are missed.
constexpr double kStiffness_n_m = 8000.0;
/// What of the force budget the press may take: what friction and the walls add comes on top, and a motion that passes
/// the budget is stopped.
constexpr double kPressOfBudget = 0.5;
/// Of the speed of a probe: how fast it is pressed onto the face, from how far off it. The robot's damping adds to the
/// force.
constexpr double kPressSpeed = 0.5;
constexpr double kOff_m = 0.0005;
/// Of the speed with which a wall may be met: it goes across with this much, for it comes down at the same time.
constexpr double kShareAcross = 0.5;
/// Way points per turn, and how many of them make one motion.
constexpr int kPerTurn = 16;
constexpr int kPerMotion = 8;
/// A tool that stays this near to the middle while the spiral goes this far is held by the walls of the opening: it
/// came right down into it. On the face it lags behind by what friction holds, some millimetres. (A narrower search
/// looks for the face not as deep as the bottom.)
constexpr double kHeld_m = 0.0015;
constexpr double kWide_m = 0.008;

/// The tool stands in the opening, deeper than its mouth: pushes it down.
SpiralFind PushDown(const Task& task, Mover& mover) {
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  const double depth = mover.Cells(task.insertion_depth_m);
  const MotionReport report = mover.Insert(mover.position() + depth * inward);
  return {report.end - depth * inward, true};
}

}  // namespace

std::optional<SpiralFind> FindBySpiral(const Task& task, const Eigen::Vector3d& target,
                                       const policies::SpiralSearch& search, Mover& mover) {
  const int axis = AxisOf(task.insertion);
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  const Eigen::Vector3d u = Eigen::Vector3d::Unit((axis + 1) % 3);
  const Eigen::Vector3d v = Eigen::Vector3d::Unit((axis + 2) % 3);
  const double range = mover.Cells(search.face_range_m);
  mover.Retreat(target - range * inward);
  const MotionReport face = mover.Probe(task.insertion, (target + range * inward)[axis], "spiral", PredictedCells{});
  if (!face.contact) return PushDown(task, mover);
  const double height = face.end[axis];
  const double press_n = std::min(search.press_n, kPressOfBudget * mover.options().force_budget_n);
  const double speed_m_s =
      std::min({search.speed_m_s, kShareAcross * mover.SpeedInto(u), kShareAcross * mover.SpeedInto(v)});
  const double pressed = height + SignOf(task.insertion) * mover.Cells(press_n / kStiffness_n_m);
  const int points = static_cast<int>(search.radius_m / search.pitch_m * kPerTurn);
  const double press_speed_m_s = std::min(search.speed_m_s, kPressSpeed * mover.SpeedInto(inward));
  std::optional<Eigen::Vector3d> commanded;  // what the tool is pressed with; nothing when it had to be stopped
  std::vector<Eigen::Vector3d> way;
  double farthest = 0.0;
  for (int i = 1; i <= points; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kPerTurn;
    const double radius = mover.Cells(search.pitch_m) * i / kPerTurn;
    Eigen::Vector3d place = target + radius * (std::cos(angle) * u + std::sin(angle) * v);
    place[axis] = pressed;
    way.push_back(place);
    if (i % kPerMotion != 0 && i != points) continue;
    if (!commanded) {  // from off the face: in contact, what speeds the arm up would press, too
      mover.Retreat(mover.position() - mover.Cells(kOff_m) * inward);
      commanded = mover.position();
      (*commanded)[axis] = pressed;
      mover.Press({*commanded}, press_speed_m_s, "spiral", kStiffness_n_m);
    }
    way.insert(way.begin(), *commanded);
    const MotionReport report = mover.Press(way, speed_m_s, "spiral", kStiffness_n_m);
    commanded = report.reason == StopReason::kForceLimit ? std::nullopt : std::optional(way.back());
    way.clear();
    if (SignOf(task.insertion) * (report.end[axis] - height) > kDrop * mover.Cells(press_n / kStiffness_n_m)) {
      Eigen::Vector3d found = report.end;
      found[axis] = height;
      return SpiralFind{found, false};
    }
    Eigen::Vector3d followed = report.end - target;
    followed[axis] = 0.0;
    farthest = std::max(farthest, followed.norm());
  }
  if (search.radius_m > kWide_m && farthest < mover.Cells(kHeld_m)) return PushDown(task, mover);
  mover.Retreat(target - range * inward);
  return std::nullopt;
}

}  // namespace feeler::execution
