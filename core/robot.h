#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/pose.h"

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
  std::vector<Pose> world_T_tool;  ///< way points, at least one
  double speed_m_s = 0.02;
  double force_limit_n = 60.0;  ///< on the filtered wrench
  double time_limit_s = 10.0;
  Eigen::Vector3d stiffness_n_m{1000, 1000, 4000};  ///< in tool axes
  double rotational_stiffness_nm_rad = 200.0;
};

struct MotionResult {
  StopReason reason = StopReason::kReached;
  double travelled_m = 0.0;  ///< along the commanded direction or path, measured
  bool contact = false;
  double peak_force_n = 0.0;
  Pose world_T_tool = Pose::Identity();  ///< measured pose when the motion ended (for a contact: at the contact)
  std::string detail;                    ///< for people; empty when all went well
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

  /// Free-space motion through joint space around obstacles; not guarded beyond a protective stop at contact.
  virtual MotionResult Transfer(const Pose& world_T_tool) = 0;
  /// Straight Cartesian motion to a pose, fast, watched for contact all the way.
  virtual MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) = 0;
  virtual MotionResult GuardedMove(const GuardedMotion& motion) = 0;
  virtual MotionResult Compliant(const CompliantMotion& motion) = 0;
};

}  // namespace feeler
