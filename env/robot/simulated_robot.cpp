#include "feeler/env/robot/simulated_robot.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/env/robot/motion_arguments.h"

namespace feeler::env {
namespace {

/// Until its first reset a robot is without noise, and asks nobody for numbers.
RandomStream Nobody() { return {0, 0, "before the first reset"}; }

}  // namespace

SimulatedRobot::SimulatedRobot(std::shared_ptr<const Scene> scene, const RobotOptions& options)
    : options_(options),
      scene_(std::move(scene)),
      world_(scene_),
      memory_{.noise = {},
              .sensor = ContactSensor(world_.scene(), {}, Nobody()),
              .friction = FrictionObserver(options.friction_observer),
              .encoder_random = Nobody(),
              .image_random = Nobody(),
              .false_stop_random = Nobody(),
              .spent_step_random = Nobody(),
              .missed_contact_random = Nobody()} {
  Reset(world_.scene().home_q_rad, world_.scene().task.world_T_target, {}, Nobody());
}

void SimulatedRobot::Reset(const JointVector& q_rad, const Pose& world_T_target, const NoiseOptions& noise,
                           RandomStream random, const PhysicsVariation& variation) {
  noise.Validate();
  RequirePose(world_T_target, "reset");
  PhysicsVariation physics = variation;
  physics.joint_friction_nm += noise.joint_friction_nm;
  world_.Reset(q_rad, world_T_target, physics);
  // Draws in this order: they make the episode.
  const std::uint64_t transfer_seed = random.Next();
  JointVector encoder_offset = JointVector::Zero();
  for (double& offset : encoder_offset) {
    offset = noise.encoder_noise_rad > 0 ? noise.encoder_noise_rad * random.Normal() : 0.0;
  }
  ContactSensor sensor(world_.scene(), noise, random);
  const std::uint64_t sensor_seed = random.Next();
  FrictionObserver friction = memory_.friction;
  friction.Reset();
  memory_ = RobotMemory{.noise = noise,
                        .sensor = std::move(sensor),
                        .friction = std::move(friction),
                        .target_candidates = {world_.scene().task.world_T_target},
                        .transfer_seed = transfer_seed,
                        .encoder_random = RandomStream(sensor_seed, 0, "encoder"),
                        .image_random = RandomStream(sensor_seed, 0, "image"),
                        .false_stop_random = RandomStream(sensor_seed, 0, "false stops"),
                        .spent_step_random = RandomStream(sensor_seed, 0, "spent steps"),
                        .missed_contact_random = RandomStream(sensor_seed, 0, "missed contacts"),
                        .encoder_offset = encoder_offset};
  Sense();
  memory_.tool_at_sensing = ToolPose();
  memory_.held_orientation = memory_.tool_at_sensing.linear();
  next_observation_s_ = 0.0;
}

void SimulatedRobot::SetTargetCandidates(std::vector<Pose> world_T_target) {
  if (world_T_target.empty()) throw InputError("target candidates", "none given", "give at least one pose");
  for (const Pose& pose : world_T_target) RequirePose(pose, "target candidates");
  memory_.target_candidates = std::move(world_T_target);
}

void SimulatedRobot::SetObserver(std::function<void(const World&)> observer, double period_s) {
  observer_ = std::move(observer);
  observer_period_s_ = period_s;
  next_observation_s_ = world_.time_s();
}

RobotState SimulatedRobot::Save() const { return {world_.Save(), memory_}; }

void SimulatedRobot::Restore(const RobotState& state) {
  const RobotMemory& m = state.robot;
  const bool finite = m.encoder_offset.allFinite() && m.deflection.allFinite() && m.measured_q.allFinite() &&
                      m.held_orientation.allFinite() && m.tool_at_sensing.matrix().allFinite() &&
                      (!m.set_point || m.set_point->matrix().allFinite()) && std::isfinite(m.peak_force_n) &&
                      !std::isnan(m.deadline_s);
  if (!finite)
    throw InputError("restore", "the state holds numbers that are not finite", "restore only what this scene saved");
  world_.Restore(state.world);
  memory_ = m;
  frame_ = ToolKinematics(world_.scene(), memory_.measured_q);
  next_observation_s_ = world_.time_s();
}

Pose SimulatedRobot::ToolPose() const {
  Pose tool = frame_.pose;
  if (scene_->wrist.stiffness_n_m > 0.0) tool.translation() += tool.linear() * world_.WristDeflection();
  return tool;
}

void SimulatedRobot::Sense() {
  memory_.measured_q = world_.q_rad() + memory_.encoder_offset + memory_.deflection;
  for (int i = 0; i < kJointCount && memory_.noise.encoder_jitter_rad > 0; ++i) {
    memory_.measured_q[i] += memory_.noise.encoder_jitter_rad * memory_.encoder_random.Normal();
  }
  frame_ = ToolKinematics(world_.scene(), memory_.measured_q);
}

void SimulatedRobot::StepOnce(const JointVector& torque_nm) {
  const Matrix6 jacobian = frame_.jacobian;
  const Pose before = ToolPose();
  const Eigen::Vector3d wrist_m_s = world_.WristVelocity();
  memory_.friction.BeforeStep(world_.qd_rad_s(), world_.BiasTorque());
  world_.Step(torque_nm - memory_.friction.estimate_nm());
  memory_.sensor.Update(world_);
  if (memory_.noise.joint_stiffness_nm_rad > 0) {
    constexpr double kLag_s = 0.02;
    const JointVector load = world_.applied_torque_nm() + memory_.friction.estimate_nm() - world_.BiasTorque();
    memory_.deflection +=
        world_.timestep_s() / kLag_s * (load / memory_.noise.joint_stiffness_nm_rad - memory_.deflection);
  }
  Sense();
  memory_.friction.AfterStep(world_, world_.qd_rad_s(), memory_.sensor.raw(), jacobian,
                             memory_.sensor.exact().force_n.isZero(0.0),
                             (world_.WristVelocity() - wrist_m_s) / world_.timestep_s());

  ++memory_.statistics.steps;
  memory_.statistics.path_length_m += (before.translation() - memory_.tool_at_sensing.translation()).norm();
  memory_.statistics.peak_force_n = std::max(memory_.statistics.peak_force_n, memory_.sensor.exact().force_n.norm());
  memory_.statistics.impulse_ns += memory_.sensor.exact().force_n.norm() * world_.timestep_s();
  const bool forbidden =
      memory_.sensor.PairFlag(ContactPair::kToolEnvironment) || memory_.sensor.PairFlag(ContactPair::kRobotTarget) ||
      memory_.sensor.PairFlag(ContactPair::kRobotEnvironment) || memory_.sensor.PairFlag(ContactPair::kRobotRobot);
  if (forbidden && !memory_.statistics.forbidden_now) ++memory_.statistics.forbidden_contacts;
  memory_.statistics.forbidden_now = forbidden;
  memory_.peak_force_n = std::max(memory_.peak_force_n, memory_.sensor.exact().force_n.norm());
  memory_.tool_at_sensing = before;
  if (observer_ && world_.time_s() >= next_observation_s_ - 1e-9) {
    observer_(world_);
    next_observation_s_ += observer_period_s_;
  }
}

void SimulatedRobot::TrackStep(const JointReference& reference) {
  StepOnce(ComputedTorque(world_, q_rad(), world_.qd_rad_s(), reference, options_.tracking));
}

std::optional<MotionResult> SimulatedRobot::Refused() const {
  MotionResult result;
  result.world_T_tool = ToolPose();
  if (!world_.failure().empty()) {
    result.reason = StopReason::kAborted;
    result.detail = world_.failure();
    return result;
  }
  if (world_.time_s() >= memory_.deadline_s) {
    result.reason = StopReason::kTimeLimit;
    result.detail = "the time of the episode is over";
    return result;
  }
  return std::nullopt;
}

MotionResult SimulatedRobot::Guard(const std::function<MotionResult()>& motion) {
  if (const auto refused = Refused()) return *refused;
  memory_.peak_force_n = 0.0;
  try {
    MotionResult result = motion();
    result.peak_force_n = memory_.peak_force_n;
    return result;
  } catch (const WorldError& error) {
    MotionResult result;
    result.reason = StopReason::kAborted;
    result.detail = error.what();
    result.peak_force_n = memory_.peak_force_n;
    result.world_T_tool = memory_.tool_at_sensing;  // the last sound one
    return result;
  }
}

std::string SimulatedRobot::ProtectiveStop() const {
  std::string text = "protective stop: the arm touches something";
  const auto [first, second] = memory_.sensor.ArmContact();
  if (first < 0) return text;
  return text + " (" + NameOfGeom(world_.model(), first) + ", " + NameOfGeom(world_.model(), second) + ")";
}

bool SimulatedRobot::IsContact(const Watch& watch, bool& released) const {
  if (memory_.sensor.ArmForce() > options_.protective_force_n) return true;
  const Eigen::Vector3d& force = memory_.sensor.raw().force_n;
  const double size = force.norm();
  if (size <= watch.tool_force_n) {
    released = true;
    return false;
  }
  return released || force.dot(watch.direction) < 0.5 * size;
}

void SimulatedRobot::Hold(MotionResult& result) {
  JointReference here;
  here.q_rad = q_rad();
  for (double t = 0; t < options_.settle_time_limit_s; t += world_.timestep_s()) {
    TrackStep(here);
    const Vector6 twist = frame_.jacobian * world_.qd_rad_s();
    if (t > 0.01 && twist.head<3>().norm() < options_.settle_speed_m_s) break;
  }
  if (result.reason == StopReason::kReached) result.world_T_tool = ToolPose();
}

bool SimulatedRobot::Stay(double time_s, MotionResult& result) {
  JointReference here;
  here.q_rad = q_rad();
  for (const double end_s = world_.time_s() + time_s; world_.time_s() < end_s;) {
    if (world_.time_s() >= memory_.deadline_s) {
      result.reason = StopReason::kTimeLimit;
      result.detail = "the time of the episode is over";
      return false;
    }
    TrackStep(here);
    if (Interrupted(result)) return false;
  }
  return true;
}

bool SimulatedRobot::Interrupted(MotionResult& result) {
  if (!interruption_) return false;
  std::string why = interruption_();
  if (why.empty()) return false;
  result.reason = StopReason::kAborted;
  result.detail = std::move(why);
  Hold(result);
  result.world_T_tool = ToolPose();
  return true;
}

MotionResult SimulatedRobot::Follow(double duration_s, const ReferenceAt& reference_at, const Watch& watch,
                                    bool settle) {
  MotionResult result;
  bool released = memory_.sensor.raw().force_n.norm() <= watch.tool_force_n;
  const double start_s = world_.time_s();
  const double end_s = duration_s + (settle ? options_.settle_time_limit_s : 0.0);
  for (;;) {
    const double t = world_.time_s() - start_s;
    if (t >= duration_s) {
      const Vector6 twist = frame_.jacobian * world_.qd_rad_s();
      const auto goal = reference_at(duration_s);
      const double error_m = goal ? (MeasuredTool(goal->q_rad).translation() - ArmPose().translation()).norm() : 0.0;
      const bool settled = error_m < options_.settle_error_m && twist.head<3>().norm() < options_.settle_speed_m_s;
      if (settled || t >= end_s) break;
    }
    if (world_.time_s() >= memory_.deadline_s) {
      result.reason = StopReason::kTimeLimit;
      result.detail = "the time of the episode is over";
      break;
    }
    const auto reference = reference_at(t);
    if (!reference) {  // checked ahead, so only a singularity between the samples gets here
      result.reason = StopReason::kUnplanned;
      result.detail = "the straight line meets a singularity";
      Hold(result);
      break;
    }
    TrackStep(*reference);
    if (IsContact(watch, released)) {
      result.contact = true;
      result.world_T_tool = memory_.tool_at_sensing;
      const bool arm = memory_.sensor.ArmForce() > options_.protective_force_n;
      result.reason = arm || watch.protective ? StopReason::kAborted : StopReason::kContact;
      if (arm) {
        result.detail = ProtectiveStop();
      } else if (watch.protective) {
        result.detail = "protective stop: contact during a transfer";
      }
      Hold(result);
      return result;
    }
    if (Interrupted(result)) return result;
  }
  result.world_T_tool = ToolPose();
  return result;
}

}  // namespace feeler::env
