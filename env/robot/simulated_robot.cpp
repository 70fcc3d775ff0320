#include "feeler/env/robot/simulated_robot.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/motion/time_parametrization.h"

namespace feeler::env {
namespace {

constexpr double kNoContactLimit = std::numeric_limits<double>::infinity();

void RequirePositive(double value, const char* where, const char* what) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw InputError(where, fmt::format("{} is {}", what, value), "give a finite number above zero");
  }
}

void RequirePose(const Pose& pose, const char* where) {
  if (!pose.matrix().allFinite()) throw InputError(where, "the pose is not finite", "give finite numbers");
  const Eigen::Matrix3d r = pose.linear();
  if (!(r.transpose() * r).isIdentity(1e-6) || r.determinant() < 0) {
    throw InputError(where, "the pose's rotation is not a rotation", "give an orthonormal right-handed matrix");
  }
}

}  // namespace

/// What ends a motion early.
struct SimulatedRobot::Watch {
  double tool_force_n = kNoContactLimit;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< of the motion; zero where it has none
  bool protective = false;                              ///< a contact is a protective stop, not the purpose
};

SimulatedRobot::SimulatedRobot(std::shared_ptr<const Scene> scene, const RobotOptions& options)
    : options_(options),
      scene_(std::move(scene)),
      world_(scene_),
      sensor_(world_.scene(), noise_, RandomStream(0, 0, "sensor")),
      friction_(options.friction_observer) {
  Reset(world_.scene().home_q_rad, world_.scene().task.world_T_target, {}, RandomStream(0, 0, "sensor"));
}

void SimulatedRobot::Reset(const JointVector& q_rad, const Pose& world_T_target, const NoiseOptions& noise,
                           RandomStream random, const PhysicsVariation& variation) {
  noise.Validate();
  RequirePose(world_T_target, "reset");
  PhysicsVariation physics = variation;
  physics.joint_friction_nm += noise.joint_friction_nm;
  world_.Reset(q_rad, world_T_target, physics);
  noise_ = noise;
  target_candidates_ = {world_.scene().task.world_T_target};
  transfer_seed_ = random.Next();
  for (int i = 0; i < kJointCount; ++i) {
    encoder_offset_[i] = noise.encoder_noise_rad > 0 ? noise.encoder_noise_rad * random.Normal() : 0.0;
  }
  sensor_ = ContactSensor(world_.scene(), noise, random);
  const std::uint64_t sensor_seed = random.Next();
  encoder_random_ = RandomStream(sensor_seed, 0, "encoder");
  image_random_ = RandomStream(sensor_seed, 0, "image");
  twist_reference_.reset();
  deflection_.setZero();
  Sense();
  friction_.Reset();
  statistics_ = {};
  set_point_.reset();
  tool_at_sensing_ = ToolPose();
  held_orientation_ = tool_at_sensing_.linear();
  peak_force_n_ = 0.0;
  deadline_s_ = std::numeric_limits<double>::infinity();
  next_observation_s_ = 0.0;
}

void SimulatedRobot::SetTargetCandidates(std::vector<Pose> world_T_target) {
  if (world_T_target.empty()) throw InputError("target candidates", "none given", "give at least one pose");
  for (const Pose& pose : world_T_target) RequirePose(pose, "target candidates");
  target_candidates_ = std::move(world_T_target);
}

void SimulatedRobot::SetObserver(std::function<void(const World&)> observer, double period_s) {
  observer_ = std::move(observer);
  observer_period_s_ = period_s;
  next_observation_s_ = world_.time_s();
}

RobotState SimulatedRobot::Save() const {
  return {world_.Save(),  noise_,           sensor_,         friction_,   statistics_,   target_candidates_,
          transfer_seed_, encoder_random_,  encoder_offset_, deflection_, measured_q_,   held_orientation_,
          set_point_,     tool_at_sensing_, peak_force_n_,   deadline_s_, image_random_, twist_reference_};
}

void SimulatedRobot::Restore(const RobotState& s) {
  const bool finite = s.encoder_offset.allFinite() && s.deflection.allFinite() && s.measured_q.allFinite() &&
                      s.held_orientation.allFinite() && s.tool_at_sensing.matrix().allFinite() &&
                      (!s.set_point || s.set_point->matrix().allFinite()) && std::isfinite(s.peak_force_n) &&
                      !std::isnan(s.deadline_s);
  if (!finite)
    throw InputError("restore", "the state holds numbers that are not finite", "restore only what this scene saved");
  world_.Restore(s.world);
  noise_ = s.noise;
  sensor_ = s.sensor;
  friction_ = s.friction;
  statistics_ = s.statistics;
  target_candidates_ = s.target_candidates;
  transfer_seed_ = s.transfer_seed;
  encoder_random_ = s.encoder_random;
  encoder_offset_ = s.encoder_offset;
  deflection_ = s.deflection;
  measured_q_ = s.measured_q;
  frame_ = ToolKinematics(world_.scene(), measured_q_);
  held_orientation_ = s.held_orientation;
  set_point_ = s.set_point;
  tool_at_sensing_ = s.tool_at_sensing;
  peak_force_n_ = s.peak_force_n;
  deadline_s_ = s.deadline_s;
  image_random_ = s.image_random;
  twist_reference_ = s.twist_reference;
  next_observation_s_ = world_.time_s();
}

Pose SimulatedRobot::ToolPose() const { return frame_.pose; }

void SimulatedRobot::Sense() {
  measured_q_ = world_.q_rad() + encoder_offset_ + deflection_;
  for (int i = 0; i < kJointCount && noise_.encoder_jitter_rad > 0; ++i) {
    measured_q_[i] += noise_.encoder_jitter_rad * encoder_random_.Normal();
  }
  frame_ = ToolKinematics(world_.scene(), measured_q_);
}

void SimulatedRobot::StepOnce(const JointVector& torque_nm) {
  const Matrix6 jacobian = frame_.jacobian;
  const Pose before = frame_.pose;
  friction_.BeforeStep(world_.qd_rad_s(), world_.BiasTorque());
  world_.Step(torque_nm - friction_.estimate_nm());
  sensor_.Update(world_);
  if (noise_.joint_stiffness_nm_rad > 0) {
    constexpr double kLag_s = 0.02;
    const JointVector load = world_.applied_torque_nm() + friction_.estimate_nm() - world_.BiasTorque();
    deflection_ += world_.timestep_s() / kLag_s * (load / noise_.joint_stiffness_nm_rad - deflection_);
  }
  Sense();
  friction_.AfterStep(world_, world_.qd_rad_s(), sensor_.raw(), jacobian);

  ++statistics_.steps;
  statistics_.path_length_m += (before.translation() - tool_at_sensing_.translation()).norm();
  statistics_.peak_force_n = std::max(statistics_.peak_force_n, sensor_.exact().force_n.norm());
  statistics_.impulse_ns += sensor_.exact().force_n.norm() * world_.timestep_s();
  const bool forbidden = sensor_.PairFlag(ContactPair::kToolEnvironment) ||
                         sensor_.PairFlag(ContactPair::kRobotTarget) ||
                         sensor_.PairFlag(ContactPair::kRobotEnvironment) || sensor_.PairFlag(ContactPair::kRobotRobot);
  if (forbidden && !statistics_.forbidden_now) ++statistics_.forbidden_contacts;
  statistics_.forbidden_now = forbidden;
  peak_force_n_ = std::max(peak_force_n_, sensor_.exact().force_n.norm());
  tool_at_sensing_ = before;
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
  if (world_.time_s() >= deadline_s_) {
    result.reason = StopReason::kTimeLimit;
    result.detail = "the time of the episode is over";
    return result;
  }
  return std::nullopt;
}

MotionResult SimulatedRobot::Guard(const std::function<MotionResult()>& motion) {
  if (const auto refused = Refused()) return *refused;
  peak_force_n_ = 0.0;
  try {
    MotionResult result = motion();
    result.peak_force_n = peak_force_n_;
    return result;
  } catch (const WorldError& error) {
    MotionResult result;
    result.reason = StopReason::kAborted;
    result.detail = error.what();
    result.peak_force_n = peak_force_n_;
    result.world_T_tool = tool_at_sensing_;  // the last sound one
    return result;
  }
}

std::string SimulatedRobot::ProtectiveStop() const {
  std::string text = "protective stop: the arm touches something";
  const auto [first, second] = sensor_.ArmContact();
  if (first < 0) return text;
  return text + " (" + NameOfGeom(world_.model(), first) + ", " + NameOfGeom(world_.model(), second) + ")";
}

bool SimulatedRobot::IsContact(const Watch& watch, bool& released) const {
  if (sensor_.ArmForce() > options_.protective_force_n) return true;
  const Eigen::Vector3d& force = sensor_.raw().force_n;
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
  bool released = sensor_.raw().force_n.norm() <= watch.tool_force_n;
  const double start_s = world_.time_s();
  const double end_s = duration_s + (settle ? options_.settle_time_limit_s : 0.0);
  for (;;) {
    const double t = world_.time_s() - start_s;
    if (t >= duration_s) {
      const Vector6 twist = frame_.jacobian * world_.qd_rad_s();
      const auto goal = reference_at(duration_s);
      const double error_m = goal ? (MeasuredTool(goal->q_rad).translation() - ToolPose().translation()).norm() : 0.0;
      const bool settled = error_m < options_.settle_error_m && twist.head<3>().norm() < options_.settle_speed_m_s;
      if (settled || t >= end_s) break;
    }
    if (world_.time_s() >= deadline_s_) {
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
      result.world_T_tool = tool_at_sensing_;
      const bool arm = sensor_.ArmForce() > options_.protective_force_n;
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

PoseTrajectory SimulatedRobot::Line(const Pose& goal, double speed_m_s) const {
  CartesianLimits limits;
  limits.speed_m_s = speed_m_s;
  limits.acceleration_m_s2 = options_.acceleration_m_s2;
  limits.angular_speed_rad_s = options_.angular_speed_rad_s;
  limits.angular_acceleration_rad_s2 = options_.angular_acceleration_rad_s2;
  return PoseTrajectory({ToolPose(), goal}, limits);
}

std::optional<PoseTrajectory> SimulatedRobot::Reachable(const PoseTrajectory& trajectory) const {
  const Scene& scene = world_.scene();
  constexpr int kSamples = 16;
  JointVector q = q_rad();
  double slowness = 1.0;
  const double pace = trajectory.duration_s() > 0 ? 1.0 / trajectory.duration_s() : 0.0;
  for (int i = 1; i <= kSamples; ++i) {
    const double fraction = static_cast<double>(i) / kSamples;
    if (!SolveNearby(scene, trajectory.PoseAt(fraction), q)) return std::nullopt;
    const PosePoint point = trajectory.At(i == kSamples ? 0.5 / std::max(pace, 1e-9) : fraction / std::max(pace, 1e-9));
    const JointVector speed = ToolJacobian(scene, q).partialPivLu().solve(point.twist);
    if (!speed.allFinite()) return std::nullopt;
    slowness = std::max(slowness, speed.cwiseAbs().cwiseQuotient(scene.velocity_limit_rad_s).maxCoeff());
  }
  return slowness > 1.0 ? trajectory.Slowed(slowness) : trajectory;
}

MotionResult SimulatedRobot::FollowLine(const PoseTrajectory& wanted, const Watch& watch) {
  const auto trajectory = Reachable(wanted);
  if (!trajectory) {
    MotionResult result;
    result.reason = StopReason::kUnplanned;
    result.detail = "the straight line leaves the reach of the arm";
    result.world_T_tool = ToolPose();
    return result;
  }
  set_point_.reset();
  held_orientation_ = trajectory->goal().linear();
  JointVector q = q_rad();
  const Scene& scene = world_.scene();
  const auto reference_at = [&](double t) -> std::optional<JointReference> {
    const PosePoint point = trajectory->At(t);
    if (!SolveNearby(scene, point.pose, q)) return std::nullopt;
    const Eigen::PartialPivLU<Matrix6> jacobian(ToolJacobian(scene, q));
    JointReference reference;
    reference.q_rad = q;
    reference.qd_rad_s = jacobian.solve(point.twist);
    // The change of the Jacobian is left out: at 0.25 m/s it is worth less than 20 micrometres.
    reference.qdd_rad_s2 = jacobian.solve(point.acceleration);
    return reference;
  };
  return Follow(trajectory->duration_s(), reference_at, watch, true);
}

MotionResult SimulatedRobot::Guarded(const GuardedMotion& motion) {
  const double length = motion.direction.norm();
  if (!motion.direction.allFinite() || std::abs(length - 1.0) > 1e-6) {
    throw InputError("guarded move", "the direction is not a unit vector", "normalise it");
  }
  if (!(motion.distance_m >= 0) || !std::isfinite(motion.distance_m)) {
    throw InputError("guarded move", fmt::format("the distance is {} m", motion.distance_m), "give zero or more");
  }
  RequirePositive(motion.speed_m_s, "guarded move", "the speed (m/s)");
  RequirePositive(motion.contact_force_n, "guarded move", "the contact force (N)");
  return Guard([&] {
    const Pose start = ToolPose();
    Pose goal = start;
    goal.translation() += motion.distance_m * motion.direction;
    goal.linear() = held_orientation_;
    Watch watch;
    watch.tool_force_n = motion.contact_force_n;
    watch.direction = motion.direction;
    MotionResult result = FollowLine(Line(goal, motion.speed_m_s), watch);
    result.travelled_m = (result.world_T_tool.translation() - start.translation()).dot(motion.direction);
    return result;
  });
}

MotionResult SimulatedRobot::LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) {
  RequirePose(world_T_tool, "linear move");
  RequirePositive(speed_m_s, "linear move", "the speed (m/s)");
  RequirePositive(contact_force_n, "linear move", "the contact force (N)");
  return Guard([&] {
    const Pose start = ToolPose();
    const Eigen::Vector3d way = world_T_tool.translation() - start.translation();
    Watch watch;
    watch.tool_force_n = contact_force_n;
    if (way.norm() > 1e-9) watch.direction = way.normalized();
    MotionResult result = FollowLine(Line(world_T_tool, speed_m_s), watch);
    result.travelled_m = (result.world_T_tool.translation() - start.translation()).dot(watch.direction);
    return result;
  });
}

std::vector<Eigen::VectorXd> SimulatedRobot::PlanWay(const Pose& world_T_tool, std::string& reason) {
  const JointVector start = q_rad();
  if (options_.transfer_planner) {
    const std::vector<JointVector> way = options_.transfer_planner(world_, start, world_T_tool);
    if (way.empty()) reason = "no collision-free way was found";
    return {way.begin(), way.end()};
  }
  const Scene& scene = world_.scene();
  if (!transfer_checker_) transfer_checker_ = std::make_unique<TransferChecker>(scene, options_.transfer.clearance_m);
  transfer_checker_->SetTargetPoses(target_candidates_);
  TransferSettings settings = options_.transfer;
  settings.seed = transfer_seed_;
  planner::TransferPlan plan = PlanTransfer(*transfer_checker_, scene, start, world_T_tool, settings);
  reason = plan.reason;
  return plan.way_points;
}

MotionResult SimulatedRobot::Transfer(const Pose& world_T_tool) {
  RequirePose(world_T_tool, "transfer");
  return Guard([&] {
    MotionResult result;
    const Scene& scene = world_.scene();
    const std::vector<Eigen::VectorXd> way_points = PlanWay(world_T_tool, result.detail);
    if (way_points.empty()) {
      result.reason = StopReason::kUnplanned;
      result.world_T_tool = ToolPose();
      return result;
    }
    planner::MotionLimits limits;
    limits.velocity_rad_s = transfer_speed_ * options_.joint_speed_fraction * scene.velocity_limit_rad_s;
    limits.acceleration_rad_s2 = JointVector::Constant(options_.joint_acceleration_rad_s2);
    planner::TimeParametrizationOptions timing;
    timing.reach_m = JointVector::Constant(1.5);  // no point of arm and tool is farther from a joint
    const planner::JointTrajectory trajectory = planner::Parametrize(way_points, limits, timing);
    set_point_.reset();
    held_orientation_ = world_T_tool.linear();
    Watch watch;
    // Noise is no contact: what a guarded move needs to tell one from it, a transfer needs, too.
    watch.tool_force_n = std::max(options_.transfer_contact_force_n, noise_.contact_threshold_n);
    watch.protective = true;
    const double path_before_m = statistics_.path_length_m;
    const auto reference_at = [&](double t) -> std::optional<JointReference> {
      const planner::JointState state = trajectory.Sample(t);
      return JointReference{state.q_rad, state.qd_rad_s, state.qdd_rad_s2};
    };
    result = Follow(trajectory.duration_s(), reference_at, watch, true);
    result.travelled_m = statistics_.path_length_m - path_before_m;
    return result;
  });
}

MotionResult SimulatedRobot::Compliant(const CompliantMotion& motion) {
  if (motion.world_T_tool.empty()) throw InputError("compliant motion", "no way points", "give at least one pose");
  for (const Pose& pose : motion.world_T_tool) RequirePose(pose, "compliant motion");
  RequirePositive(motion.speed_m_s, "compliant motion", "the speed (m/s)");
  RequirePositive(motion.force_limit_n, "compliant motion", "the force limit (N)");
  RequirePositive(motion.time_limit_s, "compliant motion", "the time limit (s)");
  RequirePositive(motion.stiffness_n_m.minCoeff(), "compliant motion", "the smallest stiffness (N/m)");
  RequirePositive(motion.stiffness_n_m.maxCoeff(), "compliant motion", "the largest stiffness (N/m)");
  RequirePositive(motion.rotational_stiffness_nm_rad, "compliant motion", "the rotational stiffness (Nm/rad)");
  if (!(motion.rest_time_s >= 0.0)) {
    throw InputError("compliant motion", fmt::format("the time at rest is {} s", motion.rest_time_s),
                     "give zero or more");
  }
  return Guard([&] {
    const Pose start = ToolPose();
    std::vector<Pose> way_points = motion.world_T_tool;
    way_points.insert(way_points.begin(), start);
    CartesianLimits limits;
    limits.speed_m_s = motion.speed_m_s;
    limits.acceleration_m_s2 = options_.acceleration_m_s2;
    limits.angular_speed_rad_s = options_.angular_speed_rad_s;
    limits.angular_acceleration_rad_s2 = options_.angular_acceleration_rad_s2;
    const PoseTrajectory trajectory(way_points, limits);
    ImpedanceGains gains;
    gains.stiffness_n_m = motion.stiffness_n_m;
    gains.rotational_stiffness_nm_rad = motion.rotational_stiffness_nm_rad;
    const Pose& goal = motion.world_T_tool.back();
    set_point_.reset();
    held_orientation_ = goal.linear();

    MotionResult result;
    const double start_s = world_.time_s();
    const double path_before_m = statistics_.path_length_m;
    double resting_s = 0.0;
    for (;;) {
      const double t = world_.time_s() - start_s;
      if (t >= motion.time_limit_s || world_.time_s() >= deadline_s_) {
        result.reason = StopReason::kTimeLimit;
        result.detail =
            t >= motion.time_limit_s ? "the time limit of the motion is over" : "the time of the episode is over";
        break;
      }
      StepOnce(CartesianImpedance(world_, frame_, world_.qd_rad_s(), trajectory.At(t), gains));
      if (sensor_.filtered().force_n.norm() > motion.force_limit_n ||
          sensor_.ArmForce() > options_.protective_force_n) {
        const bool arm = sensor_.ArmForce() > options_.protective_force_n;
        result.reason = arm ? StopReason::kAborted : StopReason::kForceLimit;
        if (arm) result.detail = ProtectiveStop();
        result.contact = true;
        break;
      }
      if (Interrupted(result)) return result;
      if (t >= trajectory.duration_s()) {
        const Vector6 twist = frame_.jacobian * world_.qd_rad_s();
        resting_s = twist.head<3>().norm() < options_.settle_speed_m_s ? resting_s + world_.timestep_s() : 0.0;
        if (resting_s >= motion.rest_time_s) {
          const bool there = (ToolPose().translation() - goal.translation()).norm() <= options_.compliant_reach_m;
          result.reason = there ? StopReason::kReached : StopReason::kContact;
          result.contact = sensor_.ToolFlag();
          break;
        }
      }
    }
    result.world_T_tool = ToolPose();
    const Eigen::Vector3d way = goal.translation() - start.translation();
    result.travelled_m = way_points.size() == 2 && way.norm() > 1e-9
                             ? (result.world_T_tool.translation() - start.translation()).dot(way.normalized())
                             : statistics_.path_length_m - path_before_m;
    if (result.reason == StopReason::kForceLimit || result.reason == StopReason::kAborted) Hold(result);
    return result;
  });
}

MotionResult SimulatedRobot::FollowTwist(const TwistMotion& motion) {
  RequirePose(motion.tool_T_frame, "twist");
  if (!motion.linear_m_s.allFinite() || !motion.angular_rad_s.allFinite()) {
    throw InputError("twist", "the velocity is not finite", "give finite numbers");
  }
  RequirePositive(motion.duration_s, "twist", "the duration (s)");
  RequirePositive(motion.contact_force_n, "twist", "the contact force (N)");
  return Guard([&] {
    MotionResult result;
    const Pose start = ToolPose();
    const bool goes_on = twist_reference_ && twist_reference_->time_s == world_.time_s();
    TwistReference reference = goes_on ? *twist_reference_ : TwistReference{world_.time_s(), start, Vector6::Zero()};
    set_point_.reset();
    JointVector q = q_rad();
    bool released = sensor_.raw().force_n.norm() <= motion.contact_force_n;
    Watch watch;
    watch.tool_force_n = motion.contact_force_n;
    const auto steps = std::max(1L, std::lround(motion.duration_s / world_.timestep_s()));
    for (long step = 0; step < steps; ++step) {
      if (world_.time_s() >= deadline_s_) {
        result.reason = StopReason::kTimeLimit;
        result.detail = "the time of the episode is over";
        break;
      }
      // The frame turns with the tool, and so does the velocity that it is to have.
      const Eigen::Matrix3d world_R_tool = reference.world_T_tool.linear();
      const Eigen::Matrix3d world_R_frame = world_R_tool * motion.tool_T_frame.linear();
      Vector6 wanted;
      wanted.tail<3>() = world_R_frame * motion.angular_rad_s;
      const Eigen::Vector3d lever = world_R_tool * motion.tool_T_frame.translation();
      wanted.head<3>() = world_R_frame * motion.linear_m_s - wanted.tail<3>().cross(lever);
      const auto joints = Advance(wanted, reference, q);
      if (!joints) {
        result.reason = StopReason::kUnplanned;
        result.detail = "the twist leaves the reach or the joint limits of the arm";
        break;
      }
      watch.direction = reference.twist.head<3>().normalized();
      TrackStep(*joints);
      if (IsContact(watch, released)) {
        result.contact = true;
        result.world_T_tool = tool_at_sensing_;
        const bool arm = sensor_.ArmForce() > options_.protective_force_n;
        result.reason = arm ? StopReason::kAborted : StopReason::kContact;
        if (arm) result.detail = ProtectiveStop();
        break;
      }
      if (Interrupted(result)) return result;
    }
    if (result.reason == StopReason::kReached) {
      reference.time_s = world_.time_s();
      twist_reference_ = reference;
    } else {
      Hold(result);
    }
    held_orientation_ = reference.world_T_tool.linear();
    if (!result.contact) result.world_T_tool = ToolPose();
    result.travelled_m = (result.world_T_tool.translation() - start.translation()).norm();
    return result;
  });
}

}  // namespace feeler::env
