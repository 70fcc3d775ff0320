// What SimulatedRobot does at the rate of a controller or a camera: the picture, what a contact would be like, the
// low-level step of learners, the zero of the wrench.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/env/robot/simulated_robot.h"

namespace feeler::env {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
/// The length of a unit vector is 1 but for this.
constexpr double kUnit = 1e-6;

/// The response of a tool on the springs of a wrist: `tool` is what its mass alone meets, `arm` what the arm meets that
/// holds it rigidly.
///
/// What meets the wall at speed v is the mass m of the tool: v I at once, I = max(1, 2 z) sqrt(m k) with stiffness and
/// damping of the parts, as ever. The contact stops the tool critically damped at its frequency u = sqrt(k / m), so
/// that t later, while the arm comes on at v, the damper D and the springs K of the wrist have added less than
///   v (D min(2 u t, 1 + 1/e^2) + K t).
/// A force counts as a contact from a threshold T on. Until the arm stands, its reaction time t later and as computed
/// torque of bandwidth w stops it, the force rises by no more than
///   v R,  R = D min(2 u t, 1 + 1/e^2) + K t + max(0, K - 2 w D) / (e w),
/// the last because the damper lets go of what the springs still gain. So the greatest force is max(T, v I) + v R.
///
/// Speeds follow from a force in proportion to speed: 0.85 of the budget B is used. A budget is at least 6/5 of the
/// threshold, so a rise of B / 6 is what there is room for: the force told is v max(I + R, 6 * 0.85 R). It is told with
/// the true mass, the stiffness of the springs and the true reaction time, the rest as a damping ratio.
ContactResponse OnSprings(const ContactResponse& tool, const ContactResponse& arm, const Wrist& wrist,
                          double reaction_s, const ComputedTorqueGains& drive) {
  constexpr double kOverThreshold = 5.1;
  constexpr double kOvershoot = 1.0 + 1.0 / (std::numbers::e * std::numbers::e);
  const auto impact = [](const ContactResponse& c) {
    return std::max(1.0, 2.0 * c.damping_ratio) * std::sqrt(c.mass_kg() * c.stiffness_n_m);
  };
  const double w = drive.bandwidth_rad_s;
  const double stiffness = wrist.stiffness_n_m;
  const double damping = wrist.damping_n_s_m;
  const double settled = 2.0 * std::sqrt(tool.stiffness_n_m / tool.mass_kg()) * reaction_s;
  const double rise = damping * std::min(settled, kOvershoot) + stiffness * reaction_s +
                      std::max(0.0, stiffness - 2.0 * w * damping) / (std::numbers::e * w);
  const double all = std::max(impact(tool) + rise, kOverThreshold * rise);
  if (all >= impact(arm) + arm.stiffness_n_m * arm.reaction_time_s) return arm;
  ContactResponse contact = tool;
  contact.stiffness_n_m = stiffness;
  contact.reaction_time_s = reaction_s;
  contact.damping_ratio = (all - stiffness * reaction_s) / (2.0 * std::sqrt(tool.mass_kg() * stiffness));
  return contact;
}

}  // namespace

CameraView SimulatedRobot::Look() {
  if (!wrist_camera_) wrist_camera_ = std::make_unique<WristCamera>(scene_, options_.wrist_camera);
  return wrist_camera_->Look(world_.data(), &memory_.image_random);
}

ContactResponse SimulatedRobot::Contact(const Eigen::Vector3d& direction) const {
  if (!(std::abs(direction.norm() - 1.0) < kUnit)) {
    throw InputError("robot", "a contact is asked for along no unit vector", "give a direction of length 1");
  }
  // With a wrist this is what comes behind its stops.
  const ContactResponse arm =
      ResponseOf(frame_.jacobian * world_.Inertia().inverse() * frame_.jacobian.transpose(), direction);
  const Wrist& wrist = scene_->wrist;
  // Springs that reach their stops before a contact is told from noise: it is the arm that meets the wall.
  constexpr double kOfTravel = 0.6;
  const bool soft = wrist.stiffness_n_m * kOfTravel * Wrist::kTravel_m < memory_.noise.contact_threshold_n;
  if (wrist.stiffness_n_m == 0.0 || soft) return arm;
  return OnSprings(ResponseOf(world_.ToolMobility(frame_.jacobian), direction), arm, wrist,
                   2.0 * world_.timestep_s() + memory_.noise.force_delay_s, options_.tracking);
}

double SimulatedRobot::Push(const Eigen::Vector3d& direction) const {
  // What the observer finds in joints without friction: its own error.
  constexpr double kNoFriction_nm = 0.05;
  const JointVector felt_nm =
      (memory_.friction.most_nm().array() < kNoFriction_nm).select(0.0, memory_.friction.most_nm());
  if (felt_nm.isZero(0.0)) return 0.0;
  // The power of the joints is that of the force: F v = sum of |q'| friction.
  Vector6 twist = Vector6::Zero();
  twist.head<3>() = direction;
  const JointVector per_m = frame_.jacobian.partialPivLu().solve(twist);
  return per_m.allFinite() ? per_m.cwiseAbs().dot(felt_nm) : 0.0;
}

ContactResponse SimulatedRobot::ResponseOf(const Matrix6& mobility, const Eigen::Vector3d& direction) const {
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
  const Matrix6 inertia = mobility.inverse();
  contact.held_mass_kg = direction.dot(inertia.topLeftCorner<3, 3>() * direction);
  contact.free_mass_kg = 1.0 / direction.dot(mobility.topLeftCorner<3, 3>() * direction);
  contact.force_noise_n = memory_.noise.force_noise_n;
  contact.reaction_time_s = 2.0 * world_.timestep_s() + memory_.noise.force_delay_s;
  contact.push_n = Push(direction);
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
    const Pose arm = ArmPose();
    Pose set_point = memory_.set_point.value_or(arm);
    set_point.translation() += delta.head<3>();
    const double turn = delta.tail<3>().norm();
    if (turn > 0) set_point.linear() = Eigen::AngleAxisd(turn, delta.tail<3>() / turn) * set_point.linear();
    Vector6 stretch = PoseError(arm, set_point);
    if (const double d = stretch.head<3>().norm(); d > kLeash_m) stretch.head<3>() *= kLeash_m / d;
    if (const double a = stretch.tail<3>().norm(); a > kLeash_rad) stretch.tail<3>() *= kLeash_rad / a;
    set_point.translation() = arm.translation() + stretch.head<3>();
    const double angle = stretch.tail<3>().norm();
    set_point.linear() = arm.linear();
    if (angle > 0) set_point.linear() = Eigen::AngleAxisd(angle, stretch.tail<3>() / angle) * arm.linear();

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
