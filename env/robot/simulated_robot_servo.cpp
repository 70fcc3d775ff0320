// What SimulatedRobot does at the rate of a controller or a camera: the picture, what a contact would be like, the
// low-level step of learners, the zero of the wrench.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "feeler/core/error.h"
#include "feeler/env/robot/simulated_robot.h"

namespace feeler::env {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
/// The length of a unit vector is 1 but for this.
constexpr double kUnit = 1e-6;

}  // namespace

CameraView SimulatedRobot::Look() {
  if (!wrist_camera_) wrist_camera_ = std::make_unique<WristCamera>(scene_, options_.wrist_camera);
  return wrist_camera_->Look(world_.data(), &memory_.image_random);
}

ContactResponse SimulatedRobot::Contact(const Eigen::Vector3d& direction) const {
  if (!(std::abs(direction.norm() - 1.0) < kUnit)) {
    throw InputError("robot", "a contact is asked for along no unit vector", "give a direction of length 1");
  }
  const mjModel& model = world_.model();
  // MuJoCo pushes with the acceleration -b v - k r, taken on by the share `impedance` (its manual, "Solver
  // parameters"): of the parts, the stiffest geoms decide.
  double time_constant_s = kNone;
  double damping_ratio = 1.0;
  double largest_impedance = 0.0;
  for (int g = 0; g < model.ngeom; ++g) {
    if (model.geom_bodyid[g] != scene_->tool_body && model.geom_bodyid[g] != scene_->target_body) continue;
    const mjtNum* reference = model.geom_solref + mjNREF * g;
    const mjtNum* solver = model.geom_solimp + mjNIMP * g;
    if (reference[0] <= 0.0 || reference[0] >= time_constant_s) continue;  // direct constants: not ours to shorten
    time_constant_s = std::max<double>(reference[0], 2.0 * world_.timestep_s());
    damping_ratio = reference[1];
    largest_impedance = solver[1];
  }
  ContactResponse contact;
  const Matrix6 mobility = frame_.jacobian * world_.Inertia().inverse() * frame_.jacobian.transpose();
  const Matrix6 inertia = mobility.inverse();
  contact.held_mass_kg = 1.0 / direction.dot(inertia.topLeftCorner<3, 3>().ldlt().solve(direction));
  contact.free_mass_kg = 1.0 / direction.dot(mobility.topLeftCorner<3, 3>() * direction);
  contact.force_noise_n = memory_.noise.force_noise_n;
  contact.reaction_time_s = 2.0 * world_.timestep_s() + memory_.noise.force_delay_s;
  if (!std::isfinite(time_constant_s)) return contact;
  const double stiffness = 1.0 / std::pow(largest_impedance * time_constant_s * damping_ratio, 2);  // per kg
  const double damping = 2.0 / (largest_impedance * time_constant_s);
  contact.stiffness_n_m = contact.mass_kg() * stiffness;
  contact.damping_ratio = damping / (2.0 * std::sqrt(stiffness));
  // While a late sensor says nothing the drive presses on: the reference of the held mass runs ahead, and by then the
  // contact has taken the speed. Told as a longer reaction of the parts alone.
  if (memory_.noise.force_delay_s > 0.0) {
    const double delay_s = memory_.noise.force_delay_s;
    const double bandwidth = options_.tracking.bandwidth_rad_s;
    const double ahead = bandwidth * bandwidth * delay_s;  // per kg and m/s
    const double stopped = 2.0 * options_.tracking.damping_ratio * bandwidth * (1.0 - std::exp(-damping * delay_s));
    contact.reaction_time_s += contact.held_mass_kg * (ahead + stopped) / contact.stiffness_n_m;
  }
  return contact;
}

MotionResult SimulatedRobot::Servo(const Vector6& delta, int steps, const ImpedanceGains& gains) {
  if (!delta.allFinite()) throw InputError("servo", "the step of the set point is not finite", "give finite numbers");
  if (steps < 1) throw InputError("servo", fmt::format("{} steps", steps), "give one or more");
  return Guard([&] {
    constexpr double kLeash_m = 0.02;
    constexpr double kLeash_rad = 0.1;
    const Pose start = ToolPose();
    Pose set_point = memory_.set_point.value_or(start);
    set_point.translation() += delta.head<3>();
    const double turn = delta.tail<3>().norm();
    if (turn > 0) set_point.linear() = Eigen::AngleAxisd(turn, delta.tail<3>() / turn) * set_point.linear();
    Vector6 stretch = PoseError(start, set_point);
    if (const double d = stretch.head<3>().norm(); d > kLeash_m) stretch.head<3>() *= kLeash_m / d;
    if (const double a = stretch.tail<3>().norm(); a > kLeash_rad) stretch.tail<3>() *= kLeash_rad / a;
    set_point.translation() = start.translation() + stretch.head<3>();
    const double angle = stretch.tail<3>().norm();
    set_point.linear() = start.linear();
    if (angle > 0) set_point.linear() = Eigen::AngleAxisd(angle, stretch.tail<3>() / angle) * start.linear();

    memory_.set_point = set_point;
    memory_.held_orientation = set_point.linear();
    PosePoint reference;
    reference.pose = set_point;
    MotionResult result;
    for (int i = 0; i < steps; ++i) {
      if (world_.time_s() >= memory_.deadline_s) {
        result.reason = StopReason::kTimeLimit;
        break;
      }
      StepOnce(CartesianImpedance(world_, frame_, world_.qd_rad_s(), reference, gains));
    }
    result.contact = memory_.sensor.ToolFlag();
    result.world_T_tool = ToolPose();
    result.travelled_m = (result.world_T_tool.translation() - start.translation()).norm();
    return result;
  });
}

void SimulatedRobot::ZeroWrench() {
  if (Refused()) return;
  const auto steps = static_cast<int>(std::lround(options_.zeroing_time_s / world_.timestep_s()));
  Wrench mean;
  JointReference here;
  here.q_rad = q_rad();
  try {
    for (int i = 0; i < steps; ++i) {
      TrackStep(here);
      mean.force_n += memory_.sensor.raw().force_n / steps;
      mean.torque_nm += memory_.sensor.raw().torque_nm / steps;
    }
  } catch (const WorldError&) {
    return;  // the next motion reports it
  }
  memory_.sensor.Shift(mean);
}

}  // namespace feeler::env
