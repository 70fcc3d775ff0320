#include "feeler/env/robot/noise.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

void NoiseOptions::Validate() const {
  for (const auto& [field, value] :
       {std::pair{"joint_friction_nm", joint_friction_nm.minCoeff()}, std::pair{"force_noise_n", force_noise_n},
        std::pair{"torque_noise_nm", torque_noise_nm}, std::pair{"force_bias_n", force_bias_n},
        std::pair{"force_delay_s", force_delay_s}, std::pair{"force_quantum_n", force_quantum_n},
        std::pair{"encoder_noise_rad", encoder_noise_rad}, std::pair{"encoder_jitter_rad", encoder_jitter_rad},
        std::pair{"false_stops_per_m", false_stops_per_m}, std::pair{"missed_contact", missed_contact},
        std::pair{"spent_step", spent_step}, std::pair{"step_m", step_m},
        std::pair{"joint_stiffness_nm_rad", joint_stiffness_nm_rad},
        std::pair{"contact_threshold_n", contact_threshold_n}}) {
    if (!(value >= 0) || !std::isfinite(value)) {
      throw InputError("noise " + name, fmt::format("{} is {}", field, value), "give a finite number, zero or more");
    }
  }
  if (!joint_friction_nm.allFinite())
    throw InputError("noise " + name, "joint_friction_nm is not finite", "give a finite number");
  if (!force_offset_n.allFinite())
    throw InputError("noise " + name, "force_offset_n is not finite", "give a finite number");
  if (!(std::abs(payload_error_kg) <= 10.0)) {
    throw InputError("noise " + name, fmt::format("payload_error_kg is {}", payload_error_kg), "give at most 10 kg");
  }
  if (joint_stiffness_nm_rad > 0 && joint_stiffness_nm_rad < 1e4) {
    throw InputError("noise " + name, fmt::format("joint_stiffness_nm_rad is {}", joint_stiffness_nm_rad),
                     "give 0 (rigid) or 1e4 Nm/rad and more: softer joints need another controller");
  }
  for (const auto& [field, value] :
       {std::pair{"missed_contact", missed_contact}, std::pair{"spent_step", spent_step}}) {
    if (value >= 1.0) throw InputError("noise " + name, fmt::format("{} is {}", field, value), "give less than 1");
    if (value > 0.0 && step_m < 1e-5)
      throw InputError("noise " + name, fmt::format("{} without a step: step_m is {}", field, step_m),
                       "give the length of a step, 1e-5 m or more");
  }
  if (force_delay_s > 0.1) throw InputError("noise " + name, "force_delay_s is above 0.1 s", "give at most 0.1");
}

NoiseOptions NoisePreset(std::string_view name) {
  NoiseOptions noise;
  noise.name = name;
  if (name == "ideal") return noise;
  if (name == "friction") {
    noise.joint_friction_nm = Eigen::Map<const JointVector>(kRealisticJointFriction.data());
    noise.force_noise_n = 1.0;
    noise.torque_noise_nm = 0.02;
    noise.contact_threshold_n = 10.0;
    return noise;
  }
  throw InputError("noise", fmt::format("no preset is named '{}'", name),
                   fmt::format("one of: {}", fmt::join(NoisePresetNames(), ", ")));
}

std::vector<std::string> NoisePresetNames() { return {"ideal", "friction"}; }

}  // namespace feeler::env
