#include "feeler/env/robot/contact_sensor.h"

#include <cmath>
#include <optional>

namespace feeler::env {
namespace {

constexpr double kFilter_s = 0.01;

std::optional<ContactPair> PairOf(ScenePart a, ScenePart b) {
  if (a > b) std::swap(a, b);  // kRobot < kTool < kTarget < kEnvironment
  if (a == ScenePart::kRobot) {
    switch (b) {
      case ScenePart::kRobot: return ContactPair::kRobotRobot;
      case ScenePart::kTool: return ContactPair::kToolRobot;
      case ScenePart::kTarget: return ContactPair::kRobotTarget;
      case ScenePart::kEnvironment: return ContactPair::kRobotEnvironment;
    }
  }
  if (a == ScenePart::kTool && b == ScenePart::kTarget) return ContactPair::kToolTarget;
  if (a == ScenePart::kTool && b == ScenePart::kEnvironment) return ContactPair::kToolEnvironment;
  return std::nullopt;
}

Eigen::Vector3d Quantise(const Eigen::Vector3d& v, double quantum) {
  return quantum > 0 ? Eigen::Vector3d((v / quantum).array().round() * quantum) : v;
}

}  // namespace

std::string_view ToString(ContactPair pair) {
  switch (pair) {
    case ContactPair::kToolTarget: return "tool-target";
    case ContactPair::kToolEnvironment: return "tool-environment";
    case ContactPair::kToolRobot: return "tool-robot";
    case ContactPair::kRobotTarget: return "robot-target";
    case ContactPair::kRobotEnvironment: return "robot-environment";
    case ContactPair::kRobotRobot: return "robot-robot";
  }
  return "";
}

double LowPass::Gain(double dt_s) {
  if (dt_s != dt_s_) {
    dt_s_ = dt_s;
    gain_ = 1.0 - std::exp(-dt_s / time_constant_s_);
  }
  return gain_;
}

const Wrench& LowPass::Update(const Wrench& sample, double dt_s) {
  const double gain = Gain(dt_s);
  value_.force_n += gain * (sample.force_n - value_.force_n);
  value_.torque_nm += gain * (sample.torque_nm - value_.torque_nm);
  return value_;
}

void LowPass::Shift(const Wrench& offset) {
  value_.force_n -= offset.force_n;
  value_.torque_nm -= offset.torque_nm;
}

ContactSensor::ContactSensor(const Scene& scene, const NoiseOptions& noise, RandomStream random)
    : tool_body_(scene.tool_body), noise_(noise), random_(random), filter_(kFilter_s) {
  const mjModel& model = *scene.model;
  geom_.resize(static_cast<std::size_t>(model.ngeom));
  for (int g = 0; g < model.ngeom; ++g) {
    Side& side = geom_[static_cast<std::size_t>(g)];
    side.part = scene.geom_part[static_cast<std::size_t>(g)];
    for (int body = model.geom_bodyid[g]; body > 0; body = model.body_parentid[body]) {
      side.beyond_sensor |= body == scene.flange_body || body == scene.tool_body;
    }
  }
  for (int i = 0; i < 3; ++i) bias_.force_n[i] = noise.force_bias_n > 0 ? noise.force_bias_n * random_.Normal() : 0.0;
  bias_.force_n += noise.force_offset_n;
  const auto delay = static_cast<std::size_t>(std::lround(noise.force_delay_s / model.opt.timestep));
  delayed_.resize(delay);
}

Wrench ContactSensor::Measure(const Wrench& exact) {
  Wrench w = exact;
  if (!delayed_.empty()) {
    std::swap(w, delayed_[next_]);
    next_ = (next_ + 1) % delayed_.size();
  }
  w.force_n += bias_.force_n;
  for (int i = 0; i < 3 && noise_.force_noise_n > 0; ++i) w.force_n[i] += noise_.force_noise_n * random_.Normal();
  for (int i = 0; i < 3 && noise_.torque_noise_nm > 0; ++i) w.torque_nm[i] += noise_.torque_noise_nm * random_.Normal();
  w.force_n = Quantise(w.force_n, noise_.force_quantum_n) - offset_.force_n;
  w.torque_nm -= offset_.torque_nm;
  return w;
}

// Weight and inertia of the mass that compensation does not know of, as a point in the tool's centre of mass.
Wrench ContactSensor::UnknownLoad(const World& world) {
  const mjData& data = world.data();
  const Eigen::Vector3d centre = Eigen::Map<const Eigen::Vector3d>(data.xipos + 3 * tool_body_);
  mjtNum velocity[6];
  mj_objectVelocity(&world.model(), &data, mjOBJ_BODY, tool_body_, velocity, 0);
  const Eigen::Map<const Eigen::Vector3d> linear(velocity + 3);  // angular first; of the centre of mass
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  if (tool_velocity_m_s_) acceleration = (linear - *tool_velocity_m_s_) / world.timestep_s();
  tool_velocity_m_s_ = linear;
  const Eigen::Map<const Eigen::Vector3d> gravity(world.model().opt.gravity);
  Wrench load;
  load.force_n = noise_.payload_error_kg * (gravity - acceleration);
  load.torque_nm = (centre - world.ToolPose().translation()).cross(load.force_n);
  return load;
}

void ContactSensor::Update(const World& world) {
  exact_ = {};
  std::array<Eigen::Vector3d, kContactPairCount> pair;
  pair.fill(Eigen::Vector3d::Zero());
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();
  arm_contact_ = {-1, -1};
  double strongest_n = 0.0;
  const Eigen::Vector3d origin = world.ToolPoseAtContact().translation();
  for (const ContactForce& c : world.contacts()) {
    const Side& side1 = geom_[static_cast<std::size_t>(c.geom1)];
    const Side& side2 = geom_[static_cast<std::size_t>(c.geom2)];
    if (const auto p = PairOf(side1.part, side2.part)) {
      // Of two parts alike the sign is arbitrary; the sum is then of magnitudes along one axis at best, good enough
      // for a flag.
      const double sign = side2.part <= side1.part ? 1.0 : -1.0;
      pair[static_cast<std::size_t>(*p)] += sign * c.force_n;
    }
    if (side1.beyond_sensor != side2.beyond_sensor) {
      const double sign = side2.beyond_sensor ? 1.0 : -1.0;
      exact_.force_n += sign * c.force_n;
      exact_.torque_nm += sign * (c.torque_nm + (c.point_m - origin).cross(c.force_n));
    }
    const bool arm1 = side1.part == ScenePart::kRobot && !side1.beyond_sensor;
    const bool arm2 = side2.part == ScenePart::kRobot && !side2.beyond_sensor;
    if (!arm1 && !arm2) continue;
    arm += (arm2 ? 1.0 : -1.0) * c.force_n;
    if (c.force_n.norm() > strongest_n) {
      strongest_n = c.force_n.norm();
      arm_contact_ = {c.geom1, c.geom2};
    }
  }
  arm_force_ = arm.norm();
  const double gain = filter_.Gain(world.timestep_s());
  for (std::size_t i = 0; i < kContactPairCount; ++i) {
    pair_force_[i] = pair[i].norm();
    pair_filtered_[i] += gain * (pair_force_[i] - pair_filtered_[i]);
    pair_flag_[i].Update(pair_filtered_[i]);
  }
  Wrench seen = exact_;
  if (noise_.payload_error_kg != 0.0) {
    const Wrench load = UnknownLoad(world);
    seen.force_n += load.force_n;
    seen.torque_nm += load.torque_nm;
  }
  raw_ = Measure(seen);
  filter_.Update(raw_, world.timestep_s());
}

void ContactSensor::Shift(const Wrench& offset) {
  offset_.force_n += offset.force_n;
  offset_.torque_nm += offset.torque_nm;
  raw_.force_n -= offset.force_n;
  raw_.torque_nm -= offset.torque_nm;
  filter_.Shift(offset);
}

bool ContactSensor::ToolFlag() const {
  return PairFlag(ContactPair::kToolTarget) || PairFlag(ContactPair::kToolEnvironment);
}

}  // namespace feeler::env
