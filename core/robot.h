#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "feeler/core/pose.h"

namespace feeler {

/// How and why a motion ended.
enum class StopReason {
  kReached,     ///< the commanded end was reached
  kContact,     ///< a contact stopped a guarded motion
  kForceLimit,  ///< the force limit of a compliant motion
  kTimeLimit,
  kUnplanned,  ///< no collision-free motion or no inverse kinematics; the robot did not move
  kAborted,    ///< the world failed (unstable physics, a protective stop)
};
std::string_view ToString(StopReason reason);

/// A straight guarded motion of the tool in world axes; the orientation is held.
struct GuardedMotion {
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< unit vector, world axes
  double distance_m = 0.0;                                ///< at most this far
  double speed_m_s = 0.05;
  double contact_force_n = 5.0;  ///< a net contact force above this is a contact
};

/// A compliant motion of the tool reference through way points (Cartesian impedance).
struct CompliantMotion {
  /// Way points, at least one. A first of several that is where the compliant motion just before was to end: this one
  /// goes on from there, pressed as the tool is, and not from where it stands.
  std::vector<Pose> world_T_tool;
  double speed_m_s = 0.02;
  double force_limit_n = 60.0;  ///< on the filtered wrench
  double time_limit_s = 10.0;
  Eigen::Vector3d stiffness_n_m{1000, 1000, 4000};  ///< in tool axes
  double rotational_stiffness_nm_rad = 200.0;
  double rest_time_s = 0.05;  ///< it ends when the tool has been at rest so long; 0: when the way has been commanded
};

/// A motion with a given velocity, for a time: of a frame that is fixed to the tool (that of the camera), in its own
/// axes. The velocity before it goes over into this one as fast as the robot can.
struct TwistMotion {
  Pose tool_T_frame = Pose::Identity();
  Eigen::Vector3d linear_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rad_s = Eigen::Vector3d::Zero();
  double duration_s = 0.0;
  double contact_force_n = 5.0;  ///< a net contact force above this ends it
};

/// What a calibrated camera on the robot sees, and how it sees it.
struct CameraView {
  int width = 0;  ///< 0: the robot has no camera
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< rows from the top
  /// Pinhole: u = fx x / z + cx, v = fy y / z + cy with x to the right, y down, z forward from the camera; whole
  /// numbers are centres of pixels.
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  Pose tool_T_camera = Pose::Identity();
};

struct MotionResult {
  StopReason reason = StopReason::kReached;
  double travelled_m = 0.0;  ///< along the commanded direction or path, measured
  bool contact = false;
  /// Greatest net force of contact on the tool, N: without the noise of the sensor where the robot can tell (a
  /// simulation), else as measured.
  double peak_force_n = 0.0;
  Pose world_T_tool = Pose::Identity();  ///< measured pose when the motion ended (for a contact: at the contact)
  std::string detail;                    ///< for people; empty when all went well
};

/// What a contact of the tool is like as the robot stands, along one direction: what the robot declares of itself, and
/// what says how fast the tool may come (execution/contact/force_budget.h). The defaults are for robots that do not
/// know: a heavy arm with hard parts.
struct ContactResponse {
  /// Parts that meet beside the axis of the tool turn a little: what they stop is between the two masses, this much of
  /// the free one and never more than the held one, as the simulated contacts show.
  static constexpr double kOfFreeMass = 1.3;

  /// Effective mass where the tool can neither turn nor slip aside (met face to face, with friction).
  double held_mass_kg = 25.0;
  double free_mass_kg = 25.0;      ///< where it can (met at the tip); not above held_mass_kg
  double stiffness_n_m = 6e4;      ///< of the parts in contact, force per indentation
  double damping_ratio = 1.0;      ///< of that contact; 0: elastic
  double reaction_time_s = 0.004;  ///< from a force that counts as a contact until the tool is being stopped
  double force_noise_n = 0.0;      ///< standard deviation of a force reading
  /// With which the drive pushes on against the friction of its joints while the tool moves freely: comes on top of
  /// what the contact gives, N.
  double push_n = 0.0;

  /// What an obstacle has to stop.
  double mass_kg() const { return std::min(held_mass_kg, kOfFreeMass * free_mass_kg); }
  /// The same where the tool is met along so much of its length that it cannot turn. More contact points are stiffer:
  /// in proportion to the mass that they stop, as in the simulation.
  ContactResponse Held() const {
    ContactResponse held = *this;
    held.stiffness_n_m *= held_mass_kg / mass_kg();
    held.free_mass_kg = held_mass_kg;
    return held;
  }
};

/// The robot as the executor sees it: implemented by the simulation, or by a driver of a real arm. All poses are of the
/// tool reference frame in the world (base) frame. Calls block until the motion ends. Not thread-safe.
class Robot {
 public:
  virtual ~Robot() = default;

  virtual Pose ToolPose() const = 0;
  /// Filtered wrench of contact, gravity of the tool compensated.
  virtual Wrench ContactWrench() const = 0;
  /// Takes the present wrench as zero; the tool must be free.
  virtual void ZeroWrench() = 0;
  /// Seconds since the last reset, simulated or real.
  virtual double Time() const = 0;
  /// Of the joints, from the base outwards, rad. Empty where the robot does not tell.
  virtual std::vector<double> JointPositions() const { return {}; }

  /// Free-space motion through joint space around obstacles; not guarded beyond a protective stop at contact.
  virtual MotionResult Transfer(const Pose& world_T_tool) = 0;
  /// Straight Cartesian motion to a pose, fast, watched for contact all the way.
  virtual MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) = 0;
  virtual MotionResult Guarded(const GuardedMotion& motion) = 0;
  virtual MotionResult Compliant(const CompliantMotion& motion) = 0;

  /// As the tool stands, for a contact met along `direction` (unit vector, world axes).
  virtual ContactResponse Contact(const Eigen::Vector3d& direction) const;

  // Robots with an eye on the wrist. Without one: an empty view, and no motion (kUnplanned).
  virtual CameraView Look();
  /// Within the limits of the joints: where they do not allow the speed, slower. The robot goes on with the velocity
  /// that it has when this returns only if the next call follows a twist, too; any other call finds it stopping.
  virtual MotionResult FollowTwist(const TwistMotion& motion);
};

}  // namespace feeler
