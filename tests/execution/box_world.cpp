#include "tests/execution/box_world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace feeler::execution {
namespace {

constexpr double kClearance = 0.0005;  // of the opening, each side
constexpr double kChamfer = 0.001;
constexpr double kLargestYaw = 0.042;
constexpr double kMotionOverhead = 0.08;  // seconds to start and stop

/// Distance to the entry of one box shrunk across the motion by `slip`, infinity without.
double EntryDistance(const Box& box, const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double slip) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  double enter = -kNever;
  double leave = kNever;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(direction[axis]) < 0.1) {  // across; what noise adds to a motion along an axis does not count
      if (from[axis] <= box.min[axis] + slip || from[axis] >= box.max[axis] - slip) return kNever;
      continue;
    }
    double a = (box.min[axis] - from[axis]) / direction[axis];
    double b = (box.max[axis] - from[axis]) / direction[axis];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  constexpr double kAtWall = 1e-6;  // a point pushed out of a wall is on it
  return enter >= leave || enter < -kAtWall ? kNever : std::max(0.0, enter);
}

/// A point a little inside a box is pushed out through the nearest face.
void PushOut(const std::vector<Box>& boxes, Eigen::Vector3d& at) {
  constexpr double kDeepest = 0.0006;
  for (const Box& box : boxes) {
    const Eigen::Vector3d above = at - box.min;
    const Eigen::Vector3d below = box.max - at;
    const double depth = std::min(above.minCoeff(), below.minCoeff());
    if (depth <= 0.0 || depth > kDeepest) continue;
    int axis = 0;
    if (below.minCoeff(&axis) <= above.minCoeff()) {
      at[axis] = box.max[axis];
    } else {
      above.minCoeff(&axis);
      at[axis] = box.min[axis];
    }
  }
}

double Distance(const std::vector<Box>& boxes, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                double slip) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Box& box : boxes) nearest = std::min(nearest, EntryDistance(box, from, direction, slip));
  return nearest;
}

}  // namespace

std::vector<Box> HousingOverPanel() {
  return {{{-0.041, -0.033, -0.030}, {0.041, 0.033, 0.0}}, {{-10.0, -10.0, -1.0}, {10.0, 10.0, -0.030}}};
}

double DistanceToContact(const std::vector<Box>& boxes, const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  return Distance(boxes, from, direction, 0.0);
}

std::shared_ptr<const planner::ContactMap> MapOf(const std::vector<Box>& boxes, double cell_m,
                                                 const Eigen::Vector3d& phase, const CellBox& domain) {
  planner::ContactMap::Layer layer;
  const auto count = static_cast<std::size_t>(domain.Count());
  layer.blocked.assign(count, 0);
  for (auto& travel : layer.travel) travel.assign(count, 0.0F);
  double margin = 0.5;
  std::size_t i = 0;
  for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
    for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
      for (int x = domain.min.x(); x <= domain.max.x(); ++x, ++i) {
        const Eigen::Vector3d at = cell_m * (Eigen::Vector3d(x, y, z) + phase);
        for (const Box& box : boxes) {
          if ((at.array() > box.min.array()).all() && (at.array() < box.max.array()).all()) layer.blocked[i] = 1;
        }
        if (layer.blocked[i]) continue;
        for (const Direction d : kDirections) {
          const double cells = DistanceToContact(boxes, at, UnitVector(d)) / cell_m;
          layer.travel[IndexOf(d)][i] = cells < 1e6 ? static_cast<float>(cells) : planner::ContactMap::kUnlimited;
          if (cells < 1e6) margin = std::min(margin, std::abs(cells - std::round(cells)));
        }
      }
    }
  }
  return std::make_shared<planner::ContactMap>(domain, std::vector<planner::ContactMap::Layer>{std::move(layer)}, phase,
                                               margin);
}

Task HousingTask() {
  Task task;
  task.name = "housing";
  for (const AxisKind kind : {AxisKind::kX, AxisKind::kY, AxisKind::kZ}) {
    UncertainAxis axis;
    axis.kind = kind;
    task.axes.push_back(axis);
  }
  task.start_offset_m = {0.0, 0.0, 0.024};
  task.insertion_depth_m = 0.020;
  task.tolerance.lateral_m = 0.001;
  task.tolerance.vertical_m = 0.002;
  return task;
}

std::shared_ptr<const planner::ContactMap> HousingMap() {
  static const std::shared_ptr<const planner::ContactMap> kMap =
      MapOf(HousingOverPanel(), 0.002, {0.0, 0.0, 0.5}, {Cell(-42, -38, -18), Cell(42, 38, 34)});
  return kMap;
}

KinematicRobot::KinematicRobot(std::vector<Box> boxes, const Task& task, const Pose& world_T_target,
                               const Pose& world_T_tool, const RobotFaults& faults, RandomStream random)
    : boxes_(std::move(boxes)),
      task_(task),
      world_T_target_(world_T_target),
      world_T_tool_(world_T_tool),
      faults_(faults),
      random_(random) {}

Eigen::Vector3d KinematicRobot::Displacement(const Eigen::Vector3d& world_m) const {
  return world_T_target_.linear().transpose() * (world_m - world_T_target_.translation());
}

double KinematicRobot::Aside(const Eigen::Vector3d& at) const {
  return std::max(std::abs(at.x() - faults_.opening_offset_x_m), std::abs(at.y()));
}

bool KinematicRobot::FitsByYaw() const {
  const Eigen::Matrix3d turn = world_T_target_.linear().transpose() * world_T_tool_.linear();
  return std::abs(std::atan2(turn(1, 0), turn(0, 0)) - faults_.opening_yaw_rad) < kLargestYaw;
}

bool KinematicRobot::InOpening(const Eigen::Vector3d& at) const {
  return at.z() < 0.0 && at.z() > -task_.insertion_depth_m - 0.001 && Aside(at) < kClearance + kChamfer;
}

Pose KinematicRobot::ToolPose() const { return world_T_tool_; }

MotionResult KinematicRobot::Go(const Eigen::Vector3d& to_world_m, double speed_m_s, bool watched) {
  if (watched && faults_.step_m > 0.0) return BySteps(to_world_m, speed_m_s);
  if (!watched || !(faults_.false_stops_per_m > 0.0)) return Travel(to_world_m, speed_m_s, watched);
  const Eigen::Vector3d from = world_T_tool_.translation();
  const double length = (to_world_m - from).norm();
  const double until = -std::log(1.0 - random_.Uniform()) / faults_.false_stops_per_m;
  if (until >= length) return Travel(to_world_m, speed_m_s, watched);
  MotionResult result = Travel(from + until / length * (to_world_m - from), speed_m_s, watched);
  result.contact = true;
  result.reason = StopReason::kContact;
  return result;
}

MotionResult KinematicRobot::BySteps(const Eigen::Vector3d& to_world_m, double speed_m_s) {
  const Eigen::Vector3d from = world_T_tool_.translation();
  const double length = (to_world_m - from).norm();
  std::vector<bool> spent;
  double free = 0.0;
  for (double left = length; left > 1e-9; left -= faults_.step_m) {
    spent.push_back(random_.Uniform() < faults_.spent_step * std::min(1.0, left / faults_.step_m));
    if (!spent.back()) free += std::min(left, faults_.step_m);
  }
  const Eigen::Vector3d stop = length > 0.0 ? Eigen::Vector3d(from + free / length * (to_world_m - from)) : from;
  MotionResult result = Travel(stop, speed_m_s, true);
  if (!result.contact) return result;
  double made = 0.0;  // steps up to the one that meets the wall, from how far the tool came
  double advanced = 0.0;
  for (std::size_t i = 0; i < spent.size() && advanced < result.travelled_m - 1e-9; ++i) {
    made += faults_.step_m;
    if (!spent[i]) advanced += faults_.step_m;
  }
  const double beyond = advanced - result.travelled_m;  // of the step that meets it
  int reads = std::max(1, static_cast<int>(std::lround((length - made + beyond) / faults_.step_m)));
  while (reads > 0 && random_.Uniform() < faults_.missed_contact) --reads;
  if (reads > 0) return result;
  pressing_.setZero();
  result.contact = false;
  result.reason = StopReason::kReached;
  return result;
}

MotionResult KinematicRobot::Travel(const Eigen::Vector3d& to_world_m, double speed_m_s, bool watched) {
  const Eigen::Vector3d from = world_T_tool_.translation();
  const Eigen::Vector3d motion = to_world_m - from;
  const double length = motion.norm();
  MotionResult result;
  time_s_ += kMotionOverhead + length / speed_m_s;
  const double weak = random_.Uniform(faults_.weakest_m, faults_.strongest_m);
  const double slip = random_.Uniform(0.0, faults_.slip_m);
  Eigen::Vector3d end = to_world_m;
  if (watched && length > 1e-9 && pressing_.norm() > 0.5 && pressing_.dot(motion / length) > -0.3) {
    result.contact = true;  // it never came off the wall
    end = from;
  } else if (length > 1e-9) {
    pressing_.setZero();
    const Eigen::Vector3d direction = motion / length;
    const Eigen::Vector3d local = world_T_target_.linear().transpose() * direction;
    const Eigen::Vector3d at = Displacement(from);
    double free = Distance(boxes_, at, local, slip);
    if (InOpening(at) && at.z() < -0.001) {
      free = std::numeric_limits<double>::infinity();
      int axis = 0;
      local.cwiseAbs().maxCoeff(&axis);
      if (local.z() < -0.9) free = std::max(0.0, at.z() + task_.insertion_depth_m);
      const double off = axis == 0 ? at.x() - faults_.opening_offset_x_m : at[axis];
      if (axis < 2) free = std::max(0.0, kClearance - (local[axis] > 0 ? off : -off));
    }
    const Eigen::Vector3d wall = at + std::min(free, length) * local;
    const double lateral = Aside(wall);
    if (FitsByYaw() && local.z() < -0.99 && std::abs(wall.z()) < 1e-6) {  // over the opening
      if (lateral < kClearance) {
        free += task_.insertion_depth_m;
      } else if (lateral < kClearance + kChamfer) {
        free += kClearance + kChamfer - lateral;
      }
    }
    if (free < length) {
      const double depth = length - free;
      result.contact = watched && depth > weak;
      if (result.contact) pressing_ = direction;
      const double late = result.contact ? random_.Uniform(0.0, speed_m_s * faults_.stop_s) : faults_.give * depth;
      end = from + (free + std::min(late, depth)) * direction;
      result.peak_force_n = 10.0;
    }
  }
  for (int axis = 0; axis < 3; ++axis) end[axis] += Noise(faults_.tracking_m);
  if (!InOpening(Displacement(end))) {
    Eigen::Vector3d at = Displacement(end);
    PushOut(boxes_, at);
    end = world_T_target_ * at;
  }
  world_T_tool_.translation() = end;
  result.reason = result.contact ? StopReason::kContact : StopReason::kReached;
  result.travelled_m = length > 0.0 ? (end - from).dot(motion) / length : 0.0;
  result.world_T_tool = world_T_tool_;
  for (int axis = 0; axis < 3; ++axis) result.world_T_tool.translation()[axis] += Noise(faults_.measurement_m);
  return result;
}

MotionResult KinematicRobot::Transfer(const Pose& world_T_tool) { return Go(world_T_tool.translation(), 0.5, false); }

MotionResult KinematicRobot::LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) {
  world_T_tool_.linear() = world_T_tool.linear();
  return Go(world_T_tool.translation(), speed_m_s, contact_force_n < 1000.0);
}

MotionResult KinematicRobot::Guarded(const GuardedMotion& motion) {
  if (faults_.phantom_contacts > 0) {
    --faults_.phantom_contacts;
    const Eigen::Vector3d half = 0.5 * motion.distance_m * motion.direction;
    MotionResult result = Go(world_T_tool_.translation() + half, motion.speed_m_s, true);
    result.contact = true;
    result.reason = StopReason::kContact;
    return result;
  }
  return Go(world_T_tool_.translation() + motion.distance_m * motion.direction, motion.speed_m_s, true);
}

MotionResult KinematicRobot::Compliant(const CompliantMotion& motion) {
  constexpr double kStep_m = 0.0001;
  MotionResult result;
  const Eigen::Vector3d from = world_T_tool_.translation();
  for (const Pose& way_point : motion.world_T_tool) {
    world_T_tool_.linear() = way_point.linear();
    const Eigen::Vector3d begin = Displacement(world_T_tool_.translation());
    const Eigen::Vector3d goal = Displacement(way_point.translation());
    Eigen::Vector3d at = begin;
    const int steps = std::max(1, static_cast<int>((goal - begin).norm() / kStep_m));
    for (int i = 1; i <= steps; ++i) {
      // Follows the command as far as housing and opening let it: along a wall, down a chamfer.
      const bool inside = InOpening(at);
      at = begin + (goal - begin) * i / steps;
      const bool over = FitsByYaw() && Aside(at) <= kChamfer + 0.5 * kClearance;
      if (at.z() < 0.0 && (inside || over)) {
        at.x() = std::clamp(at.x(), faults_.opening_offset_x_m - kClearance, faults_.opening_offset_x_m + kClearance);
        at.y() = std::clamp(at.y(), -kClearance, kClearance);
        at.z() = std::max(at.z(), -task_.insertion_depth_m);
      } else if (at.z() < 0.0 && std::abs(at.x()) < 0.041 && std::abs(at.y()) < 0.033) {
        at.z() = 0.0;
      }
    }
    inserted_ = InOpening(at) && at.z() < -task_.insertion_depth_m + 0.001;
    if (motion.world_T_tool.size() == 1 && (at - goal).norm() > 0.005) {
      result.reason = StopReason::kForceLimit;
      result.contact = true;
    }
    world_T_tool_.translation() = world_T_target_ * at;
    time_s_ += kMotionOverhead + (goal - begin).norm() / motion.speed_m_s;
  }
  result.travelled_m = (world_T_tool_.translation() - from).norm();
  result.world_T_tool = world_T_tool_;
  return result;
}

}  // namespace feeler::execution
