#include "feeler/planner/motion/serial_arm.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "feeler/core/error.h"
#include "feeler/planner/motion/robot_description.h"

namespace feeler::planner {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

Pose PoseOf(const urdf::Pose& pose) {
  const auto& p = pose.position;
  const auto& r = pose.rotation;
  return MakePose(Eigen::Vector3d(p.x, p.y, p.z), Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized());
}

SerialArm::Joint JointOf(const std::string& file, const urdf::Joint& joint, const Pose& before_T_joint) {
  const std::string where = fmt::format("{}: <joint name=\"{}\">", file, joint.name);
  const Eigen::Vector3d axis(joint.axis.x, joint.axis.y, joint.axis.z);
  constexpr double kRounding = 1e-3;
  if (!(std::abs(axis.norm() - 1.0) < kRounding)) {
    throw InputError(where, fmt::format("its <axis> has length {}", axis.norm()), "give a unit vector");
  }
  if (!before_T_joint.matrix().allFinite()) {
    throw InputError(where, "its <origin> is not finite", "give finite numbers");
  }
  const bool endless = joint.type == urdf::Joint::CONTINUOUS;
  if (!joint.limits && !endless) throw InputError(where, "has no <limit>", "give lower, upper and velocity");
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const double lower = endless ? -kEndless : joint.limits->lower;
  const double upper = endless ? kEndless : joint.limits->upper;
  const double speed = joint.limits ? joint.limits->velocity : 0.0;
  if (!(lower < upper)) {
    throw InputError(where, fmt::format("its limits are {} to {} rad", lower, upper),
                     "the lower is less than the upper");
  }
  if (!(speed > 0.0 && std::isfinite(speed))) {
    throw InputError(where, "its <limit> has no velocity above 0", "give it in rad/s");
  }
  return {joint.name, before_T_joint, axis.normalized(), lower, upper, speed};
}

/// The joint that goes on from here: the only moving one among all that are fixed to the link. Empty: the arm ends.
struct Onward {
  const urdf::Joint* joint = nullptr;
  Pose link_T_joint = Pose::Identity();
  int count = 0;
};
void FindOnward(const urdf::ModelInterface& model, const urdf::Link& link, const Pose& here, Onward& onward) {
  for (const auto& joint : link.child_joints) {
    const Pose there = here * PoseOf(joint->parent_to_joint_origin_transform);
    if (joint->type == urdf::Joint::FIXED) {
      FindOnward(model, *model.getLink(joint->child_link_name), there, onward);
      continue;
    }
    onward.joint = joint.get();
    onward.link_T_joint = there;
    ++onward.count;
  }
}

Vector6 ErrorOf(const Pose& from, const Pose& to) {
  Vector6 error;
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(to.linear() * from.linear().transpose()));
  error << to.translation() - from.translation(), turn.angle() * turn.axis();
  return error;
}

}  // namespace

SerialArm SerialArm::FromUrdf(const std::string& file, const std::string& base_link) {
  const urdf::ModelInterfaceSharedPtr model = ReadRobotDescription(file);
  urdf::LinkConstSharedPtr link =
      base_link.empty() ? urdf::LinkConstSharedPtr(model->getRoot()) : model->getLink(base_link);
  if (!link) throw InputError(file, "has no link '" + base_link + "'", "name the link whose frame poses are told in");
  Pose start = Pose::Identity();
  // A base that hangs by a fixed joint beside the first moving one (as in descriptions of Universal Robots).
  while (true) {
    Onward beyond;
    FindOnward(*model, *link, start, beyond);
    const urdf::JointSharedPtr above = link->parent_joint;
    if (beyond.count > 0 || !above || above->type != urdf::Joint::FIXED) break;
    start = start * PoseOf(above->parent_to_joint_origin_transform).inverse();
    link = model->getLink(above->parent_link_name);
  }
  std::vector<Joint> joints;
  Pose before = start;
  while (true) {
    Onward onward;
    FindOnward(*model, *link, before, onward);
    const bool turns = onward.count == 1 &&
                       (onward.joint->type == urdf::Joint::REVOLUTE || onward.joint->type == urdf::Joint::CONTINUOUS);
    if (!turns) break;
    joints.push_back(JointOf(file, *onward.joint, onward.link_T_joint));
    link = model->getLink(onward.joint->child_link_name);
    before = Pose::Identity();
  }
  if (joints.empty()) {
    throw InputError(file, "has no turning joint behind '" + link->name + "'",
                     "give the description of a serial arm with revolute joints");
  }
  return SerialArm(std::move(joints));
}

Pose SerialArm::ForwardKinematics(const Eigen::VectorXd& q_rad) const {
  Pose pose = Pose::Identity();
  for (int i = 0; i < joint_count(); ++i) {
    pose = pose * joints_[i].before_T_joint * Eigen::AngleAxisd(q_rad[i], joints_[i].axis);
  }
  return pose;
}

SerialArm::Frame SerialArm::FrameAt(const Eigen::VectorXd& q_rad, const Pose& last_T_frame) const {
  Frame frame;
  frame.jacobian.resize(6, joint_count());
  std::vector<Eigen::Vector3d> origins(joints_.size());
  Pose pose = Pose::Identity();
  for (int i = 0; i < joint_count(); ++i) {
    pose = pose * joints_[i].before_T_joint;
    frame.jacobian.block<3, 1>(3, i) = pose.linear() * joints_[i].axis;
    origins[i] = pose.translation();
    pose = pose * Eigen::AngleAxisd(q_rad[i], joints_[i].axis);
  }
  frame.base_T_frame = pose * last_T_frame;
  for (int i = 0; i < joint_count(); ++i) {
    const Eigen::Vector3d axis = frame.jacobian.block<3, 1>(3, i);
    frame.jacobian.block<3, 1>(0, i) = axis.cross(frame.base_T_frame.translation() - origins[i]);
  }
  return frame;
}

std::optional<Eigen::VectorXd> SerialArm::SolveNearby(const Pose& base_T_frame, const Pose& last_T_frame,
                                                      const Eigen::VectorXd& q_rad) const {
  constexpr int kIterations = 60;
  constexpr double kTolerance = 1e-7;
  constexpr double kLargestStep_rad = 0.2;
  // Levenberg and Marquardt: the damping falls with the error, so that the end is Newton's.
  Eigen::VectorXd q = q_rad;
  for (int i = 0; i < kIterations; ++i) {
    const Frame frame = FrameAt(q, last_T_frame);
    const Vector6 error = ErrorOf(frame.base_T_frame, base_T_frame);
    const double size = error.norm();
    if (size < kTolerance) return q;
    Eigen::Matrix<double, 6, 6> normal = frame.jacobian * frame.jacobian.transpose();
    normal.diagonal().array() += std::min(1e-2 * size * size, 1e-3);
    Eigen::VectorXd step = frame.jacobian.transpose() * normal.ldlt().solve(error);
    const double largest = step.cwiseAbs().maxCoeff();
    if (!std::isfinite(largest)) return std::nullopt;
    if (largest > kLargestStep_rad) step *= kLargestStep_rad / largest;
    q += step;
  }
  return std::nullopt;
}

}  // namespace feeler::planner
