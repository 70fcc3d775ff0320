#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/random.h"
#include "feeler/env/robot/noise.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/scene/world.h"

namespace feeler::env {

/// Who touches whom. Gripper and arm count as robot; two parts of the robot touching is `kRobotRobot`.
enum class ContactPair : std::uint8_t {
  kToolTarget,
  kToolEnvironment,
  kToolRobot,
  kRobotTarget,
  kRobotEnvironment,
  kRobotRobot,
};
inline constexpr int kContactPairCount = 6;
/// "tool-target", ...
std::string_view ToString(ContactPair pair);

/// First-order low pass, exact for a signal that is constant over each step.
class LowPass {
 public:
  explicit LowPass(double time_constant_s = 0.01) : time_constant_s_(time_constant_s) {}
  void Reset() { value_ = {}; }
  const Wrench& Update(const Wrench& sample, double dt_s);
  /// Share of a new sample in the value, for steps of `dt_s`.
  double Gain(double dt_s);
  const Wrench& value() const { return value_; }
  void Shift(const Wrench& offset);

 private:
  double time_constant_s_;
  double dt_s_ = 0.0;
  double gain_ = 0.0;  ///< for dt_s_
  Wrench value_;
};

/// On above the upper force, off below the lower one: a flag that does not chatter.
struct Hysteresis {
  double on_n = 5.0;
  double off_n = 2.0;
  bool flag = false;
  bool Update(double force_n) { return flag = flag ? force_n >= off_n : force_n > on_n; }
};

/// The touch of the robot: a wrist sensor between flange and gripper, gravity and inertia of what it carries
/// compensated exactly (so it reads the wrench of contact on gripper and tool), with the noise that is asked for; and
/// who touches whom, which only a simulation knows.
///
/// `raw` is for decisions to stop, `filtered` (10 ms) for limits and for people. All at the tool origin, world axes,
/// describing the step just made.
class ContactSensor {
 public:
  ContactSensor(const Scene& scene, const NoiseOptions& noise, RandomStream random);

  /// Call once after each World::Step.
  void Update(const World& world);
  /// Subtracts `offset` from every reading from now on, on top of earlier offsets.
  void Shift(const Wrench& offset);

  /// As measured: delayed, biased, noisy, quantised, less the offset.
  const Wrench& raw() const { return raw_; }
  const Wrench& filtered() const { return filter_.value(); }
  /// Without any imperfection.
  const Wrench& exact() const { return exact_; }
  /// Net force between the two, N, exact.
  double PairForce(ContactPair pair) const { return pair_force_[static_cast<std::size_t>(pair)]; }
  /// With hysteresis 5/2 N on the low-passed force.
  bool PairFlag(ContactPair pair) const { return pair_flag_[static_cast<std::size_t>(pair)].flag; }
  /// True while any pair with the tool is flagged.
  bool ToolFlag() const;
  /// Net force on the arm (not gripper, not tool) by anything, N: what joint torques would reveal.
  double ArmForce() const { return arm_force_; }
  /// The two geoms of the strongest contact on the arm; -1 if there is none.
  const std::array<int, 2>& ArmContact() const { return arm_contact_; }

 private:
  Wrench Measure(const Wrench& exact);
  Wrench UnknownLoad(const World& world);

  struct Side {
    ScenePart part = ScenePart::kEnvironment;
    bool beyond_sensor = false;
  };
  std::vector<Side> geom_;
  int tool_body_ = -1;
  std::optional<Eigen::Vector3d> tool_velocity_m_s_;  ///< of its centre of mass, after the last step
  NoiseOptions noise_;
  RandomStream random_;
  Wrench bias_;
  std::vector<Wrench> delayed_;  ///< ring buffer
  std::size_t next_ = 0;
  Wrench offset_;
  Wrench exact_;
  Wrench raw_;
  LowPass filter_;
  std::array<double, kContactPairCount> pair_force_{};
  std::array<double, kContactPairCount> pair_filtered_{};
  std::array<Hysteresis, kContactPairCount> pair_flag_{};
  double arm_force_ = 0.0;
  std::array<int, 2> arm_contact_ = {-1, -1};
};

}  // namespace feeler::env
