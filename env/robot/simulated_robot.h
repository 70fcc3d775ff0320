#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/core/robot.h"
#include "feeler/env/robot/contact_sensor.h"
#include "feeler/env/robot/impedance.h"
#include "feeler/env/robot/joint_control.h"
#include "feeler/env/robot/noise.h"
#include "feeler/env/robot/tool_kinematics.h"
#include "feeler/env/robot/trajectory.h"
#include "feeler/env/robot/transfer_checker.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/scene/world.h"
#include "feeler/env/vision/wrist_camera.h"

namespace feeler::env {

/// Joint-space way points from `start` (the first of them) to a configuration with the tool at the goal, free of
/// collisions; empty when there are none. May read the world, must not keep it.
using TransferPlanner =
    std::function<std::vector<JointVector>(const World& world, const JointVector& start, const Pose& world_T_tool)>;

struct RobotOptions {
  ComputedTorqueGains tracking;
  FrictionObserver::Options friction_observer;
  double acceleration_m_s2 = 2.5;  ///< of straight motions: half of what transfers ask of the joints
  /// Guarded motions take at least so long to their speed: one that begins at a wall pushes with the mass of the arm
  /// times its acceleration.
  double guarded_ramp_s = 0.05;
  double angular_speed_rad_s = 1.0;
  double angular_acceleration_rad_s2 = 5.0;
  double joint_speed_fraction = 0.5;       ///< of the joints' limits, in transfers
  double joint_acceleration_rad_s2 = 5.0;  ///< in transfers
  double protective_force_n = 80.0;        ///< on the arm at any time; on the tool in transfers
  double transfer_contact_force_n = 20.0;  ///< on the tool in transfers
  double settle_error_m = 2e-5;            ///< a motion has settled when the tool is this close to its end
  double settle_speed_m_s = 1e-3;          ///< and this slow
  double settle_time_limit_s = 0.1;        ///< or after this time
  double zeroing_time_s = 0.02;            ///< the wrench is averaged over this time to find its zero
  double compliant_reach_m = 1e-3;         ///< a compliant motion that ends this close to its goal has reached it
  WristCameraOptions wrist_camera;
  TransferSettings transfer;         ///< the seed in it is replaced by one drawn at reset
  TransferPlanner transfer_planner;  ///< in place of PlanTransfer with the settings above
};

/// What an episode has used up so far.
struct RobotStatistics {
  double path_length_m = 0.0;  ///< of the tool origin
  double peak_force_n = 0.0;   ///< exact contact force on gripper and tool
  double impulse_ns = 0.0;     ///< time integral of that force
  /// Times that something began to touch what nothing but the tool may touch, or the tool what is not the target: any
  /// contact flag (ContactSensor::PairFlag) but tool-target and tool-robot.
  int forbidden_contacts = 0;
  bool forbidden_now = false;  ///< one of them stands
  int steps = 0;               ///< physics steps
};

/// What FollowTwist leaves for the next call of its kind.
struct TwistReference {
  double time_s = 0.0;  ///< another motion in between makes it void
  Pose world_T_tool = Pose::Identity();
  Vector6 twist = Vector6::Zero();  ///< of the tool origin, world axes, linear first
};

/// What the robot remembers from step to step and from motion to motion.
struct RobotMemory {
  NoiseOptions noise;
  ContactSensor sensor;
  FrictionObserver friction;
  RobotStatistics statistics{};
  std::vector<Pose> target_candidates{};
  std::uint64_t transfer_seed = 0;
  RandomStream encoder_random;
  RandomStream image_random;
  RandomStream false_stop_random;
  RandomStream spent_step_random;
  RandomStream missed_contact_random;
  JointVector encoder_offset = JointVector::Zero();
  JointVector deflection = JointVector::Zero();  ///< of the elastic joints, beyond what gravity explains
  JointVector measured_q = JointVector::Zero();
  Eigen::Matrix3d held_orientation = Eigen::Matrix3d::Identity();  ///< what guarded moves hold
  std::optional<Pose> set_point{};                                 ///< of Servo
  Pose tool_at_sensing = Pose::Identity();  ///< measured pose in the state that the sensor describes
  double peak_force_n = 0.0;                ///< exact, since the motion began
  double deadline_s = std::numeric_limits<double>::infinity();
  std::optional<TwistReference> twist_reference{};
  std::optional<TwistReference> compliant_end{};  ///< where and when a compliant motion came to its end
};

/// Everything that later calls depend on: restored, the robot goes on bit for bit.
struct RobotState {
  WorldState world;
  RobotMemory robot;
};

/// The UR10e in MuJoCo behind the robot interface.
///
/// Guarded and linear motions and transfers are computed-torque control at every physics step; compliant motions are
/// Cartesian impedance; both with friction compensation by observer. Contact is the raw (unfiltered) measured
/// force above the threshold. While the tool still touches what the motion leaves, a force that pushes along the motion
/// is not a contact, so a retreat does not stop at once. After a contact the arm holds where it is.
///
/// The world's failure (unstable physics, a full buffer) ends the motion with kAborted and its reason; so do
/// all later ones until Reset. Arguments that make no sense (NaN, no direction, no way points) throw InputError and
/// leave the robot as it was.
///
/// Where the noise has steps that fail, straight motions that are watched for contact are made of such (WatchedWay).
///
/// Time passes only inside motions and ZeroWrench. Same calls, same bits.
class SimulatedRobot : public Robot {
 public:
  explicit SimulatedRobot(std::shared_ptr<const Scene> scene, const RobotOptions& options = {});

  /// Robot at rest at `q_rad`, target at its true pose, time zero; `random` drives the noise. Erases the past.
  /// The joint friction of `noise` is added to that of `variation`.
  void Reset(const JointVector& q_rad, const Pose& world_T_target, const NoiseOptions& noise, RandomStream random,
             const PhysicsVariation& variation = {});

  // Robot:
  /// By the encoders, and by what the wrist has given way.
  Pose ToolPose() const override;
  Wrench ContactWrench() const override { return memory_.sensor.filtered(); }
  void ZeroWrench() override;
  double Time() const override { return world_.time_s(); }
  std::vector<double> JointPositions() const override {
    return {memory_.measured_q.data(), memory_.measured_q.data() + kJointCount};
  }
  MotionResult Transfer(const Pose& world_T_tool) override;
  MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) override;
  MotionResult Guarded(const GuardedMotion& motion) override;
  MotionResult Compliant(const CompliantMotion& motion) override;
  /// Effective mass from the inertia of the joints and the Jacobian; stiffness and damping are those of the contacts
  /// between tool and target in MuJoCo (solref, solimp), which it makes proportional to that mass. With a wrist the
  /// mass is that of the tool, the stiffness that of the springs; the damping ratio covers what comes until the arm
  /// stands.
  ContactResponse Contact(const Eigen::Vector3d& direction) const override;
  /// The wrist camera's picture of this instant. Throws InputError when the machine cannot render.
  CameraView Look() override;
  /// Joint-space tracking of the integrated twist at every physics step, within the speed and position limits of the
  /// joints and the accelerations of the options.
  MotionResult FollowTwist(const TwistMotion& motion) override;

  /// The low-level step: moves the set point of a Cartesian impedance by `delta` (m and rad in world axes, linear
  /// first) and runs `steps` physics steps towards it. The set point starts at the present pose after any other
  /// motion and stays within 20 mm and 0.1 rad of the tool.
  MotionResult Servo(const Vector6& delta, int steps, const ImpedanceGains& gains = {});

  /// Between motions. The observer is not part of the state.
  RobotState Save() const;
  /// Throws InputError for the state of another model; the robot is then as it was.
  void Restore(const RobotState& state);

  /// As measured by the encoders.
  const JointVector& q_rad() const { return memory_.measured_q; }
  JointVector qd_rad_s() const { return world_.qd_rad_s(); }
  const World& world() const { return world_; }
  const ContactSensor& sensor() const { return memory_.sensor; }
  const NoiseOptions& noise() const { return memory_.noise; }
  const RobotStatistics& statistics() const { return memory_.statistics; }
  const RobotOptions& options() const { return options_; }

  /// Where the target may stand, as far as the robot knows: transfers keep clear of all of these. At least one; the
  /// nominal pose after a reset.
  void SetTargetCandidates(std::vector<Pose> world_T_target);
  /// Transfers take their joint speed times this, above 0 to 1 (a safety field slows the arm).
  void SlowTransfers(double factor) { transfer_speed_ = factor; }
  /// Motions end with kTimeLimit once Time() reaches it.
  void SetDeadline(double time_s) { memory_.deadline_s = time_s; }
  /// Asked after every physics step of a motion, and all the while a transfer is planned: a text brings the arm to
  /// rest, and the motion ends with kAborted and that text. Empty: nobody is asked. Asking changes nothing.
  void SetInterruption(std::function<std::string()> interruption) { interruption_ = std::move(interruption); }
  /// `observer` sees the world every `period_s` of simulated time (frames of a video); empty: nobody does.
  void SetObserver(std::function<void(const World&)> observer, double period_s);

 private:
  /// What ends a motion early.
  struct Watch {
    double tool_force_n = std::numeric_limits<double>::infinity();
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< of the motion; zero where it has none
    bool protective = false;                              ///< a contact is a protective stop, not the purpose
  };
  using ReferenceAt = std::function<std::optional<JointReference>(double time_s)>;
  using TorqueAt = std::function<JointVector(double time_s)>;

  PoseTrajectory Line(const Pose& goal, double speed_m_s, double acceleration_m_s2) const;
  /// Joint references along a trajectory; slows it to the joints' speed limits. Empty when a pose is out of reach.
  std::optional<PoseTrajectory> Reachable(const PoseTrajectory& trajectory) const;
  /// The force along `direction` with which the drive overcomes the friction of the joints, as the robot stands.
  double Push(const Eigen::Vector3d& direction) const;
  /// With a contact that acts on this mobility of the tool (J M^-1 J^T).
  ContactResponse ResponseOf(const Matrix6& mobility, const Eigen::Vector3d& direction) const;
  MotionResult FollowLine(const PoseTrajectory& trajectory, const Watch& watch);
  /// A straight motion to `goal`, by steps that may fail where the noise says so.
  MotionResult WatchedLine(const Pose& goal, double speed_m_s, double acceleration_m_s2, const Watch& watch);
  /// Lets the contact that ended a motion be missed as often as the noise says: the tool stays meanwhile, and where no
  /// step is left the motion has ended without a contact.
  void MissContact(int steps_left, double step_s, MotionResult& result);
  /// The joints stay where they are for so long. False: something has ended the motion, which `result` then says.
  bool Stay(double time_s, MotionResult& result);
  MotionResult Follow(double duration_s, const ReferenceAt& reference_at, const Watch& watch, bool settle);
  /// Integrates a tool twist for one step, slower where the joints do not allow it. Empty: no way on.
  std::optional<JointReference> Advance(const Vector6& wanted, TwistReference& reference, JointVector& q) const;
  /// Holds the joints where they are until they rest.
  void Hold(MotionResult& result);
  /// Whether somebody wants the motion to end; it then has.
  bool Interrupted(MotionResult& result);
  /// The way points of a transfer; empty, with the reason, when there are none, or somebody wants it to end.
  std::vector<Eigen::VectorXd> PlanWay(const Pose& world_T_tool, std::string& reason, bool& interrupted);
  void TrackStep(const JointReference& reference);
  /// Reads the encoders.
  void Sense();
  void StepOnce(const JointVector& torque_nm);
  /// Why the robot stopped by itself.
  std::string ProtectiveStop() const;
  bool IsContact(const Watch& watch, bool& released) const;
  /// The end of a motion that did not begin: world failed or time over.
  std::optional<MotionResult> Refused() const;
  MotionResult Guard(const std::function<MotionResult()>& motion);
  double PathDone(const Pose& start, const Eigen::Vector3d& direction, const Pose& now) const;
  /// Where the joints have the tool, a wrist at rest: what the controllers know.
  const Pose& ArmPose() const { return frame_.pose; }
  /// Whether a compliant motion begins where the last one ended just now.
  bool GoesOn(const std::vector<Pose>& way_points) const;
  Pose MeasuredTool(const JointVector& q_rad) const { return ToolForwardKinematics(world_.scene(), q_rad); }

  RobotOptions options_;
  std::shared_ptr<const Scene> scene_;
  World world_;
  RobotMemory memory_;
  ToolFrame frame_;                                    ///< of the tool, at memory_.measured_q
  std::unique_ptr<TransferChecker> transfer_checker_;  ///< made when first needed
  std::unique_ptr<WristCamera> wrist_camera_;          ///< made when first needed
  double transfer_speed_ = 1.0;
  std::function<std::string()> interruption_;
  std::function<void(const World&)> observer_;
  double observer_period_s_ = 0.0;
  double next_observation_s_ = 0.0;
};

}  // namespace feeler::env
