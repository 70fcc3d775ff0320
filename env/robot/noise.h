#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "feeler/env/arm/ur10e.h"

namespace feeler::env {

/// How the simulated arm and its force sensor differ from ideal ones.
struct NoiseOptions {
  std::string name = "ideal";
  JointVector joint_friction_nm = JointVector::Zero();  ///< Coulomb, unknown to the controller
  double force_noise_n = 0.0;                           ///< standard deviation per axis and sample (1 ms)
  double torque_noise_nm = 0.0;
  double force_bias_n = 0.0;  ///< standard deviation of a constant offset per axis, drawn once an episode
  double force_delay_s = 0.0;
  double force_quantum_n = 0.0;                              ///< resolution; 0: continuous
  Eigen::Vector3d force_offset_n = Eigen::Vector3d::Zero();  ///< a given constant offset, on top of the drawn one
  /// Mass of the held tool that gravity and acceleration compensation does not know of (negative: counts too much). Its
  /// weight and inertia stay in the readings; zeroing the wrench removes the weight.
  double payload_error_kg = 0.0;
  /// Expected false contacts per metre of guarded and linear motion that is watched for contact: the motion ends there
  /// with a contact that is none.
  double false_stops_per_m = 0.0;
  /// Readings of single steps that fail, on the same motions, as planner::Noise has them: a step that is blocked
  /// reports no contact (the tool stays, the step is spent, and the motion goes on with the steps that are left), and
  /// one that is free and ends with no false contact is spent while the tool stays. A step that is spent takes its
  /// time.
  double missed_contact = 0.0;      ///< probability, below 1
  double spent_step = 0.0;          ///< probability, below 1
  double step_m = 0.0;              ///< length of a step; to be given with either of them
  double encoder_noise_rad = 0.0;   ///< standard deviation of a constant offset per joint, drawn once an episode
  double encoder_jitter_rad = 0.0;  ///< standard deviation of each reading
  /// Stiffness of each joint between encoder and link, 0: rigid. The tool gives way under contact and the encoders do
  /// not see it (quasi-static, with a lag of 20 ms; the sag under gravity counts as calibrated). A UR10e has some 5e4.
  double joint_stiffness_nm_rad = 0.0;
  double contact_threshold_n = 5.0;  ///< what a guarded move needs to tell a contact from noise: advice to callers

  /// Throws InputError naming the field that is negative or not finite.
  void Validate() const;
};

/// `ideal`; `friction`: 3 Nm in the large joints, 1.2 Nm in the wrists, and 1 N of force noise (threshold 10 N).
/// Throws InputError for any other name, listing these.
NoiseOptions NoisePreset(std::string_view name);
std::vector<std::string> NoisePresetNames();

}  // namespace feeler::env
