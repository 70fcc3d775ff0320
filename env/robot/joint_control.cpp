#include "feeler/env/robot/joint_control.h"

namespace feeler::env {

JointVector ComputedTorque(const World& world, const JointVector& q_rad, const JointVector& qd_rad_s,
                           const JointReference& reference, const ComputedTorqueGains& gains) {
  const double w = gains.bandwidth_rad_s;
  const JointVector acceleration = reference.qdd_rad_s2 +
                                   2 * gains.damping_ratio * w * (reference.qd_rad_s - qd_rad_s) +
                                   w * w * (reference.q_rad - q_rad);
  return world.InertiaTimes(acceleration) + world.BiasTorque();
}

void FrictionObserver::BeforeStep(const JointVector& qd_rad_s, const JointVector& bias_nm) {
  qd_before_ = qd_rad_s;
  bias_before_ = bias_nm;
}

void FrictionObserver::AfterStep(const World& world, const JointVector& qd_rad_s, const Wrench& contact_wrench,
                                 const Matrix6& jacobian, bool free, const Eigen::Vector3d& wrist_m_s2) {
  if (!options_.enabled) return;
  const double dt = world.timestep_s();
  Vector6 wrench;
  wrench << contact_wrench.force_n, contact_wrench.torque_nm;
  // What moved the joints, less what should have; positive helps, so friction comes out negative when moving forward.
  JointVector unexplained = world.InertiaTimes((qd_rad_s - qd_before_) / dt) -
                            (world.applied_torque_nm() - bias_before_ + jacobian.transpose() * wrench);
  if (!wrist_m_s2.isZero(0.0)) unexplained += world.WristReaction(wrist_m_s2);
  estimate_ += options_.bandwidth_rad_s * dt * (unexplained - estimate_);
  estimate_ = estimate_.cwiseMin(options_.limit_nm).cwiseMax(-options_.limit_nm);
  // What a contact leaves in the estimate is gone after some of its time constants.
  constexpr double kTimeConstants = 6.0;
  free_s_ = free ? free_s_ + dt : 0.0;
  if (free_s_ * options_.bandwidth_rad_s > kTimeConstants) most_ = most_.cwiseMax(estimate_.cwiseAbs());
}

}  // namespace feeler::env
