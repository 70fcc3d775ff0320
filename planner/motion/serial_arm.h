#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/pose.h"

namespace feeler::planner {

/// The kinematics of a serial arm with any number of turning joints, as its URDF has them: no dynamics, no shapes.
class SerialArm {
 public:
  struct Joint {
    std::string name;
    Pose before_T_joint;   ///< from the frame behind the joint before (or the base)
    Eigen::Vector3d axis;  ///< unit vector
    double lower_rad;      ///< minus infinity: it turns without end
    double upper_rad;
    double speed_rad_s;
  };

  /// The turning joints from `base_link` (empty: the root of the description) outwards, until the last link or one
  /// where moving joints part or slide (a gripper). Throws InputError that names file and joint where there are none,
  /// or where one has no sane axis or limits.
  static SerialArm FromUrdf(const std::string& file, const std::string& base_link = "");

  explicit SerialArm(std::vector<Joint> joints) : joints_(std::move(joints)) {}

  int joint_count() const { return static_cast<int>(joints_.size()); }
  const std::vector<Joint>& joints() const { return joints_; }

  /// The frame behind the last joint, in the base frame. `q_rad`: joint_count() positions.
  Pose ForwardKinematics(const Eigen::VectorXd& q_rad) const;

  /// Pose and geometric Jacobian (6 x joint_count(); rows 0-2 linear, m/rad, rows 3-5 angular) of a frame fixed behind
  /// the last joint, in the base frame.
  struct Frame {
    Pose base_T_frame;
    Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian;
  };
  Frame FrameAt(const Eigen::VectorXd& q_rad, const Pose& last_T_frame) const;

  /// Damped Newton from `q_rad` to the joint positions nearby that put the frame at `base_T_frame`, to 1e-7 m and rad.
  /// Empty where it does not converge: out of reach, or a singularity on the way. Limits are not looked at.
  std::optional<Eigen::VectorXd> SolveNearby(const Pose& base_T_frame, const Pose& last_T_frame,
                                             const Eigen::VectorXd& q_rad) const;

 private:
  std::vector<Joint> joints_;
};

}  // namespace feeler::planner
