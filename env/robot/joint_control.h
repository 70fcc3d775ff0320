#pragma once

#include <Eigen/Core>

#include "feeler/env/robot/contact_sensor.h"
#include "feeler/env/robot/tool_kinematics.h"
#include "feeler/env/scene/world.h"

namespace feeler::env {

/// Where the joints should be at this instant.
struct JointReference {
  JointVector q_rad = JointVector::Zero();
  JointVector qd_rad_s = JointVector::Zero();
  JointVector qdd_rad_s2 = JointVector::Zero();
};

/// Gains of computed torque: every joint's error obeys e'' + 2 damping bandwidth e' + bandwidth^2 e = 0.
struct ComputedTorqueGains {
  double bandwidth_rad_s = 150.0;  ///< a tenth of what 1 ms steps would bear; joint friction shifts a joint by
                                   ///< friction/(inertia*bandwidth^2)
  double damping_ratio = 1.0;
};

/// Torques that make the joints follow the reference (computed torque: Siciliano et al., "Robotics", 8.5.2):
/// M(q) (q_r'' + 2 D w (q_r' - q') + w^2 (q_r - q)) + bias(q, q').
JointVector ComputedTorque(const World& world, const JointVector& q_rad, const JointVector& qd_rad_s,
                           const JointReference& reference, const ComputedTorqueGains& gains);

/// Estimates the torque that joint friction takes, from what torques and contact wrench should have done and what the
/// joints did: a first-order observer (Le Tien, Albu-Schaeffer, De Luca and Hirzinger 2008, "Friction observer and
/// compensation for control of robots with joint torque measurement"). Without it a compliant arm stands millimetres
/// off; it knows nothing of the simulated friction.
class FrictionObserver {
 public:
  struct Options {
    bool enabled = true;
    double bandwidth_rad_s = 100.0;
    double limit_nm = 10.0;  ///< more than this is not friction
  };
  FrictionObserver() : FrictionObserver(Options()) {}
  explicit FrictionObserver(const Options& options) : options_(options) {}

  void Reset() {
    estimate_.setZero();
    most_.setZero();
    free_s_ = 0.0;
  }
  /// Before a step: remembers what the torques should do.
  void BeforeStep(const JointVector& qd_rad_s, const JointVector& bias_nm);
  /// After it: `contact_wrench` as measured over the step, `jacobian` of the tool.
  /// `free`: nothing is touched.
  /// `wrist_m_s2`: of the tool against the arm, as the wrist measures it.
  void AfterStep(const World& world, const JointVector& qd_rad_s, const Wrench& contact_wrench, const Matrix6& jacobian,
                 bool free = false, const Eigen::Vector3d& wrist_m_s2 = Eigen::Vector3d::Zero());
  /// To be subtracted from the commanded torque, Nm.
  const JointVector& estimate_nm() const { return estimate_; }
  /// The most that it has estimated for each joint since Reset while the robot moved freely, Nm, none negative.
  const JointVector& most_nm() const { return most_; }

 private:
  Options options_;
  JointVector estimate_ = JointVector::Zero();
  JointVector most_ = JointVector::Zero();
  double free_s_ = 0.0;  ///< since something was touched
  JointVector qd_before_ = JointVector::Zero();
  JointVector bias_before_ = JointVector::Zero();
};

}  // namespace feeler::env
