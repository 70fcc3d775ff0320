#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/scene/physics_variation.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// One contact that pushed during the last step.
struct ContactForce {
  int geom1 = -1;
  int geom2 = -1;
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_n = Eigen::Vector3d::Zero();    ///< on geom2's body (geom1's gets the opposite), world axes
  Eigen::Vector3d torque_nm = Eigen::Vector3d::Zero();  ///< likewise, about the contact point
  double distance_m = 0.0;                              ///< negative: penetration
};

/// Everything that a later step depends on. Restoring it continues the episode bit for bit.
struct WorldState {
  double time_s = 0.0;
  std::vector<double> qpos, qvel, warmstart, mocap_pos, mocap_quat;
  std::vector<ContactForce> contacts;
  Pose tool_at_contact = Pose::Identity();
  JointVector applied_torque_nm = JointVector::Zero();
  PhysicsVariation variation;
  Eigen::Vector3d port_home_m = Eigen::Vector3d::Zero();
  std::uint64_t model = 0;  ///< fingerprint of the scene's model
};

/// The physics of one episode: an mjData over a shared, constant scene.
///
/// Laws: Reset erases the past (the same calls after it give the same bits as in a fresh World); stepping here equals
/// mj_step with the same torques; a World fails loudly, by WorldError, when the physics is unstable (a number that is
/// not finite or absurd) or a MuJoCo buffer overflows, and is usable again after Reset.
///
/// Which moment is described by what: positions, velocities, inertia and bias forces are those of the present instant.
/// Contact forces act over a step, so they belong to the step just made and to the state in which it began; the tool
/// pose of that state is `ToolPoseAtContact`. (mj_step leaves both behind by one step, without telling.)
///
/// One thread at a time; any number of worlds share a scene.
class World {
 public:
  explicit World(std::shared_ptr<const Scene> scene);

  /// Robot at rest at `q_rad`, target at its pose, time zero.
  /// Throws InputError for numbers that are not finite and for variations that the tool's geometry does not allow.
  void Reset(const JointVector& q_rad, const Pose& world_T_target, const PhysicsVariation& variation = {});

  /// Applies the torques (clamped to the limits of the joints) for one time step.
  /// Throws WorldError when the physics fails; then only Reset helps.
  void Step(const JointVector& torque_nm);

  const Scene& scene() const { return *scene_; }
  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }
  double time_s() const { return data_->time; }
  double timestep_s() const { return model_->opt.timestep; }
  JointVector q_rad() const { return JointPositions(*scene_, *data_); }
  JointVector qd_rad_s() const { return JointVelocities(*scene_, *data_); }
  Eigen::Vector3d WristDeflection() const { return env::WristDeflection(*scene_, *data_); }
  Eigen::Vector3d WristVelocity() const { return env::WristVelocity(*scene_, *data_); }
  Pose ToolPose() const { return env::ToolPose(*scene_, *data_); }
  Pose TargetPose() const { return env::TargetPose(*scene_, *data_); }
  /// Tool pose in the state in which `contacts()` acted.
  const Pose& ToolPoseAtContact() const { return tool_at_contact_; }
  const std::vector<ContactForce>& contacts() const { return contacts_; }
  // Of the arm with a wrist locked as it stands:
  /// Torques that gravity, Coriolis forces and viscous joint damping demand at present, Nm.
  JointVector BiasTorque() const;
  /// Joint-space inertia times `v` at present.
  JointVector InertiaTimes(const JointVector& v) const;
  Eigen::Matrix<double, 6, 6> Inertia() const;
  /// Torques on the joints of the arm that a tool asks for which accelerates in the wrist, Nm.
  JointVector WristReaction(const Eigen::Vector3d& acceleration_m_s2) const;
  /// J M^-1 J^T of the tool, what it gives way to a wrench at once, the wrist moving with the arm; `jacobian` of the
  /// arm's joints. World axes, linear first.
  Eigen::Matrix<double, 6, 6> ToolMobility(const Eigen::Matrix<double, 6, 6>& jacobian) const;
  /// The torques of the last step, after clamping.
  const JointVector& applied_torque_nm() const { return applied_torque_; }
  const PhysicsVariation& variation() const { return variation_; }
  /// Why the world failed; empty while it is sound.
  const std::string& failure() const { return failure_; }

  WorldState Save() const;
  /// Throws InputError for the state of another model.
  void Restore(const WorldState& state);

 private:
  void Vary(const PhysicsVariation& variation);
  Eigen::Matrix<double, 9, 9> InertiaWithWrist() const;
  void UpdatePositions();
  void GatherContacts();
  /// Lets the target give way to what pushes it, where it stands on springs.
  void MovePort();
  void CheckSound();
  [[noreturn]] void Fail(const std::string& what);

  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const mjModel> model_;  ///< the scene's, or a copy of it with this episode's variation
  DataHandle data_;
  std::vector<ContactForce> contacts_;
  Pose tool_at_contact_ = Pose::Identity();
  JointVector applied_torque_ = JointVector::Zero();
  PhysicsVariation variation_;
  Eigen::Vector3d port_home_m_ = Eigen::Vector3d::Zero();  ///< of the target where nothing pushes it, world
  std::uint64_t fingerprint_ = 0;
  std::string failure_;
};

}  // namespace feeler::env
