#include "feeler/env/scene/world.h"

#include <fmt/format.h>
#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/env/scene/physics_variation.h"

namespace feeler::env {
namespace {

// Far beyond anything the arm can do, far below where numbers overflow.
constexpr double kAbsurdVelocity = 1e3;
constexpr double kAbsurdAcceleration = 1e8;

bool AllBelow(const double* values, int count, double limit) {
  // Written so that NaN fails.
  return std::all_of(values, values + count, [limit](double v) { return std::abs(v) < limit; });
}

/// Of everything in the model that physics reads: every array but names, texts, numbers of the task file and textures,
/// and the options.
std::uint64_t Fingerprint(const mjModel& m) {
  std::uint64_t hash = 14695981039346656037U;
  const auto add = [&hash](const void* data, std::size_t bytes) {
    for (const auto* byte = static_cast<const unsigned char*>(data); bytes > 0; ++byte, --bytes) {
      hash = (hash ^ *byte) * 1099511628211U;
    }
  };
  const auto counts = [](std::string_view name) {
    return !name.starts_with("name") && !name.starts_with("tex_") && !name.starts_with("text_") &&
           !name.starts_with("numeric_") && !name.starts_with("mat_");
  };
  MJMODEL_POINTERS_PREAMBLE((&m))
#define X(type, name, rows, columns) \
  if (counts(#name)) add(m.name, sizeof(type) * static_cast<std::size_t>(m.rows) * static_cast<std::size_t>(columns));
  MJMODEL_POINTERS
#undef X
#define X(type, name) add(&m.opt.name, sizeof(type));
  MJOPTION_SCALARS
#undef X
#define X(name, count) add(m.opt.name, sizeof(mjtNum) * (count));
  MJOPTION_VECTORS
#undef X
  return hash;
}

std::vector<double> Copy(const double* values, int count) { return {values, values + count}; }

bool Finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool Finite(const WorldState& s) {
  return std::isfinite(s.time_s) && s.time_s >= 0 && Finite(s.qpos) && Finite(s.qvel) && Finite(s.warmstart) &&
         Finite(s.mocap_pos) && Finite(s.mocap_quat) && s.tool_at_contact.matrix().allFinite() &&
         s.applied_torque_nm.allFinite() && s.port_home_m.allFinite() &&
         std::all_of(s.contacts.begin(), s.contacts.end(), [](const ContactForce& c) {
           return c.point_m.allFinite() && c.force_n.allFinite() && c.torque_nm.allFinite() &&
                  std::isfinite(c.distance_m);
         });
}

}  // namespace

World::World(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)), model_(scene_->model), fingerprint_(Fingerprint(*model_)) {
  RouteMujocoMessages();
  data_ = MakeData(*model_);
  contacts_.reserve(static_cast<std::size_t>(std::max(model_->nconmax, 0)));
  Reset(scene_->home_q_rad, scene_->task.world_T_target);
}

void World::Reset(const JointVector& q_rad, const Pose& world_T_target, const PhysicsVariation& variation) {
  if (!q_rad.allFinite()) throw InputError("reset", "joint position is not finite", "give six angles in radians");
  if (!world_T_target.matrix().allFinite())
    throw InputError("reset", "target pose is not finite", "give finite numbers");
  Vary(variation);
  failure_.clear();
  contacts_.clear();
  applied_torque_.setZero();
  mj_resetData(model_.get(), data_.get());
  SetJointPositions(*scene_, q_rad, *data_);
  SetTargetPose(*scene_, world_T_target, *data_);
  port_home_m_ = world_T_target.translation();
  UpdatePositions();
  tool_at_contact_ = ToolPose();
  CheckSound();
}

void World::Vary(const PhysicsVariation& variation) {
  if (variation == variation_) return;
  model_ = VariedModel(*scene_, variation);
  variation_ = variation;
}

void World::UpdatePositions() {
  mj_fwdPosition(model_.get(), data_.get());
  mj_fwdVelocity(model_.get(), data_.get());
}

void World::Step(const JointVector& torque_nm) {
  if (!failure_.empty()) throw WorldError("world", failure_, "reset it");
  if (!torque_nm.allFinite()) Fail("torque is not finite");
  applied_torque_ = torque_nm.cwiseMin(scene_->torque_limit_nm).cwiseMax(-scene_->torque_limit_nm);
  const mjModel* m = model_.get();
  mjData* d = data_.get();
  for (int i = 0; i < kJointCount; ++i) d->ctrl[scene_->actuator[static_cast<std::size_t>(i)]] = applied_torque_[i];
  // mj_step, cut open between forces and integration: only there do poses and contact forces describe one instant.
  tool_at_contact_ = ToolPose();
  mj_fwdActuation(m, d);
  mj_fwdAcceleration(m, d);
  mj_fwdConstraint(m, d);
  GatherContacts();
  mj_Euler(m, d);
  if (!AllBelow(d->qacc, m->nv, kAbsurdAcceleration) || !AllBelow(d->qvel, m->nv, kAbsurdVelocity) ||
      !AllBelow(d->qpos, m->nq, kAbsurdVelocity)) {
    Fail(fmt::format("unstable physics at {:.3f} s", d->time));
  }
  MovePort();
  UpdatePositions();
  CheckSound();
}

void World::GatherContacts() {
  contacts_.clear();
  const mjModel* m = model_.get();
  const mjData* d = data_.get();
  for (int i = 0; i < d->ncon; ++i) {
    const mjContact& contact = d->contact[i];
    if (contact.efc_address < 0) continue;
    mjtNum force[6];
    mj_contactForce(m, d, i, force);
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Map<const RowMajor> frame(contact.frame);  // rows: normal from geom1 to geom2, tangents
    ContactForce& c = contacts_.emplace_back();
    c.geom1 = contact.geom1;
    c.geom2 = contact.geom2;
    c.point_m = Eigen::Map<const Eigen::Vector3d>(contact.pos);
    c.force_n = frame.transpose() * Eigen::Map<const Eigen::Vector3d>(force);
    c.torque_nm = frame.transpose() * Eigen::Map<const Eigen::Vector3d>(force + 3);
    c.distance_m = contact.dist;
  }
}

void World::MovePort() {
  if (variation_.port_stiffness_n_m == 0.0) return;
  // Without mass, and slowed as grease does: the spring settles within 8 to 80 ms, and a contact cannot throw it about.
  constexpr double kDrag_n_s_m = 400.0;
  const auto of_target = [&](int geom) {
    return model_->body_rootid[model_->geom_bodyid[geom]] == model_->body_rootid[scene_->target_body];
  };
  Eigen::Vector3d push = Eigen::Vector3d::Zero();
  for (const ContactForce& c : contacts_) {
    if (of_target(c.geom2)) push += c.force_n;
    if (of_target(c.geom1)) push -= c.force_n;
  }
  Eigen::Map<Eigen::Vector3d> place_m(data_->mocap_pos + 3 * scene_->target_mocap);
  Eigen::Vector3d offset = place_m - port_home_m_;
  const Eigen::Vector3d net = push - variation_.port_stiffness_n_m * offset;
  const double size = net.norm();
  if (size <= PhysicsVariation::kPortFriction_n) return;
  offset += timestep_s() / kDrag_n_s_m * (1.0 - PhysicsVariation::kPortFriction_n / size) * net;
  offset *= std::min(1.0, PhysicsVariation::kPortTravel_m / std::max(offset.norm(), 1e-12));
  place_m = port_home_m_ + offset;
}

void World::CheckSound() {
  const auto warned = [this](mjtWarning w) { return data_->warning[w].number > 0; };
  if (warned(mjWARN_CONTACTFULL)) {
    Fail(fmt::format("contact buffer full ({} contacts) at {:.3f} s", model_->nconmax, data_->time));
  }
  if (warned(mjWARN_CNSTRFULL)) {
    Fail(fmt::format("constraint buffer full ({} rows) at {:.3f} s", model_->njmax, data_->time));
  }
  if (warned(mjWARN_INERTIA)) Fail(fmt::format("singular inertia at {:.3f} s", data_->time));
}

void World::Fail(const std::string& what) {
  TakeMujocoWarning();
  failure_ = what;
  throw WorldError("world", what, "reset it");
}

JointVector World::BiasTorque() const {
  JointVector bias;
  for (int i = 0; i < kJointCount; ++i) {
    const int dof = scene_->dof[static_cast<std::size_t>(i)];
    bias[i] = data_->qfrc_bias[dof] - data_->qfrc_passive[dof];
  }
  return bias;
}

// Without a wrist a scene has no degrees of freedom but the arm's, in the order of the chain, so the arrays map
// straight. With one its slides follow them.
JointVector World::InertiaTimes(const JointVector& v) const {
  JointVector result;
  if (scene_->wrist.stiffness_n_m > 0.0) return Inertia() * v;
  mj_mulM(model_.get(), data_.get(), result.data(), v.data());
  return result;
}

Eigen::Matrix<double, 6, 6> World::Inertia() const {
  if (scene_->wrist.stiffness_n_m > 0.0) return InertiaWithWrist().topLeftCorner<6, 6>();
  Eigen::Matrix<double, 6, 6> inertia;
  mj_fullM(model_.get(), inertia.data(), data_->qM);
  return inertia;
}

Eigen::Matrix<double, 9, 9> World::InertiaWithWrist() const {
  Eigen::Matrix<double, 9, 9> all;
  mj_fullM(model_.get(), all.data(), data_->qM);
  return all;
}

JointVector World::WristReaction(const Eigen::Vector3d& acceleration_m_s2) const {
  if (scene_->wrist.stiffness_n_m == 0.0) return JointVector::Zero();
  return InertiaWithWrist().topRightCorner<6, 3>() * acceleration_m_s2;
}

Eigen::Matrix<double, 6, 6> World::ToolMobility(const Eigen::Matrix<double, 6, 6>& jacobian) const {
  if (scene_->wrist.stiffness_n_m == 0.0) return jacobian * Inertia().inverse() * jacobian.transpose();
  Eigen::Matrix<double, 6, 9> all = Eigen::Matrix<double, 6, 9>::Zero();
  all.leftCols<6>() = jacobian;
  all.topRightCorner<3, 3>() = ToolPose().linear();
  return all * InertiaWithWrist().inverse() * all.transpose();
}

WorldState World::Save() const {
  WorldState s;
  s.time_s = data_->time;
  s.qpos = Copy(data_->qpos, model_->nq);
  s.qvel = Copy(data_->qvel, model_->nv);
  s.warmstart = Copy(data_->qacc_warmstart, model_->nv);
  s.mocap_pos = Copy(data_->mocap_pos, 3 * model_->nmocap);
  s.mocap_quat = Copy(data_->mocap_quat, 4 * model_->nmocap);
  s.contacts = contacts_;
  s.tool_at_contact = tool_at_contact_;
  s.applied_torque_nm = applied_torque_;
  s.variation = variation_;
  s.port_home_m = port_home_m_;
  s.model = fingerprint_;
  return s;
}

void World::Restore(const WorldState& s) {
  const auto fits = [](const std::vector<double>& v, int n) { return v.size() == static_cast<std::size_t>(n); };
  if (s.model != fingerprint_ || !fits(s.qpos, model_->nq) || !fits(s.qvel, model_->nv) ||
      !fits(s.warmstart, model_->nv) || !fits(s.mocap_pos, 3 * model_->nmocap) ||
      !fits(s.mocap_quat, 4 * model_->nmocap)) {
    throw InputError("restore", "the state belongs to another model", "restore only what this scene saved");
  }
  if (!Finite(s))
    throw InputError("restore", "the state holds numbers that are not finite", "restore only what this scene saved");
  if (!AllBelow(s.qpos.data(), model_->nq, kAbsurdVelocity) || !AllBelow(s.qvel.data(), model_->nv, kAbsurdVelocity)) {
    throw InputError("restore", "the state holds absurd positions or velocities", "restore only what this scene saved");
  }
  Vary(s.variation);
  mj_resetData(model_.get(), data_.get());
  failure_.clear();
  data_->time = s.time_s;
  std::copy(s.qpos.begin(), s.qpos.end(), data_->qpos);
  std::copy(s.qvel.begin(), s.qvel.end(), data_->qvel);
  std::copy(s.warmstart.begin(), s.warmstart.end(), data_->qacc_warmstart);
  std::copy(s.mocap_pos.begin(), s.mocap_pos.end(), data_->mocap_pos);
  std::copy(s.mocap_quat.begin(), s.mocap_quat.end(), data_->mocap_quat);
  port_home_m_ = s.port_home_m;
  contacts_ = s.contacts;
  applied_torque_ = s.applied_torque_nm;
  UpdatePositions();
  tool_at_contact_ = s.tool_at_contact;
  CheckSound();
}

}  // namespace feeler::env
