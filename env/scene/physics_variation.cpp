#include "feeler/env/scene/physics_variation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "feeler/core/direction.h"
#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/scene/worn_edges.h"

namespace feeler::env {
namespace {

// How a geom of the tool lies in the tool frame. Bodies inside the tool are rigid; their frames do not move.
Pose ToolFromGeom(const mjModel& m, int tool_body, int geom) {
  const auto pose = [](const mjtNum* p, const mjtNum* q) {
    return MakePose(Eigen::Map<const Eigen::Vector3d>(p), Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
  };
  Pose result = pose(m.geom_pos + 3 * geom, m.geom_quat + 4 * geom);
  for (int body = m.geom_bodyid[geom]; body != tool_body; body = m.body_parentid[body]) {
    result = pose(m.body_pos + 3 * body, m.body_quat + 4 * body) * result;
  }
  return result;
}

Eigen::Vector3d HalfBox(const mjModel& m, int geom) {
  const mjtNum* s = m.geom_size + 3 * geom;
  switch (m.geom_type[geom]) {
    case mjGEOM_SPHERE: return Eigen::Vector3d::Constant(s[0]);
    case mjGEOM_CAPSULE: return {s[0], s[0], s[0] + s[1]};
    case mjGEOM_CYLINDER: return {s[0], s[0], s[1]};
    default: return {s[0], s[1], s[2]};
  }
}

[[noreturn]] void CannotNarrow(const Scene& scene, const std::string& why) {
  throw InputError("clearance", fmt::format("the tool of task '{}' cannot be made narrower: {}", scene.task.name, why),
                   "leave the clearance as it is, or build the tool of boxes, cylinders and meshes along its axes");
}

// Of a cylinder or box the map A (in its own axes) has to keep the kind.
bool IsScaling(const Eigen::Matrix3d& a) {
  return (a - Eigen::Matrix3d(a.diagonal().asDiagonal())).cwiseAbs().maxCoeff() < 1e-9;
}

void NarrowMesh(const Scene& scene, int geom, const Eigen::Matrix3d& map, mjModel& m) {
  const int mesh = m.geom_dataid[geom];
  for (int other = 0; other < m.ngeom; ++other) {
    if (other != geom && m.geom_type[other] == mjGEOM_MESH && m.geom_dataid[other] == mesh) {
      CannotNarrow(scene, "a mesh is used twice");
    }
  }
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  double reach = 0.0;
  for (int v = m.mesh_vertadr[mesh]; v < m.mesh_vertadr[mesh] + m.mesh_vertnum[mesh]; ++v) {
    Eigen::Map<Eigen::Vector3f> vertex(m.mesh_vert + 3 * v);
    vertex = (map * vertex.cast<double>()).cast<float>();
    half = half.cwiseMax(vertex.cast<double>().cwiseAbs());
    reach = std::max(reach, vertex.cast<double>().norm());
  }
  Eigen::Map<Eigen::Vector3d>(m.geom_size + 3 * geom) = half;
  m.geom_rbound[geom] = reach + 1e-9;
}

// The tool shrinks across the insertion about its axis, so that its widest section loses `clearance_m` on each side.
void Narrow(const Scene& scene, double clearance_m, mjModel& m) {
  const int along = AxisOf(scene.task.insertion);
  Eigen::Vector3d widest = Eigen::Vector3d::Zero();
  for (const int geom : scene.tool_geoms) {
    const Pose pose = ToolFromGeom(m, scene.tool_body, geom);
    if (m.geom_type[geom] == mjGEOM_MESH) {
      const int mesh = m.geom_dataid[geom];
      for (int v = m.mesh_vertadr[mesh]; v < m.mesh_vertadr[mesh] + m.mesh_vertnum[mesh]; ++v) {
        const Eigen::Vector3d vertex = Eigen::Map<const Eigen::Vector3f>(m.mesh_vert + 3 * v).cast<double>();
        widest = widest.cwiseMax((pose * vertex).cwiseAbs());
      }
      continue;
    }
    const Eigen::Vector3d half = pose.linear().cwiseAbs() * HalfBox(m, geom);
    widest = widest.cwiseMax(pose.translation().cwiseAbs() + half);
  }
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == along) continue;
    scale[axis] = 1.0 - clearance_m / widest[axis];
    if (!(scale[axis] > 0.5 && scale[axis] < 1.5)) {
      CannotNarrow(scene, fmt::format("{} m a side is more than half of it", clearance_m));
    }
  }
  for (const int geom : scene.tool_geoms) {
    if (m.geom_bodyid[geom] != scene.tool_body) CannotNarrow(scene, "it has bodies inside");
    const Pose pose = ToolFromGeom(m, scene.tool_body, geom);
    const Eigen::Matrix3d map = pose.linear().transpose() * scale.asDiagonal() * pose.linear();
    Eigen::Map<Eigen::Vector3d>(m.geom_pos + 3 * geom) = scale.cwiseProduct(pose.translation());
    m.geom_sameframe[geom] = 0;
    mjtNum* size = m.geom_size + 3 * geom;
    const int type = m.geom_type[geom];
    if (type == mjGEOM_MESH) {
      NarrowMesh(scene, geom, map, m);
      continue;
    }
    if (!IsScaling(map)) CannotNarrow(scene, "a geom lies askew");
    if (type == mjGEOM_BOX) {
      for (int i = 0; i < 3; ++i) size[i] *= map(i, i);
      m.geom_rbound[geom] = Eigen::Map<const Eigen::Vector3d>(size).norm();
    } else if (type == mjGEOM_CYLINDER || type == mjGEOM_CAPSULE) {
      if (std::abs(map(0, 0) - map(1, 1)) > 1e-9) CannotNarrow(scene, "a round geom would become oval");
      size[0] *= map(0, 0);
      size[1] *= map(2, 2);
      m.geom_rbound[geom] = type == mjGEOM_CAPSULE ? size[0] + size[1] : std::hypot(size[0], size[1]);
    } else {
      CannotNarrow(scene, "a geom is neither box, cylinder, capsule nor mesh");
    }
  }
}

/// The tool as a whole lies otherwise in the gripper.
void Slip(const Scene& scene, const PhysicsVariation& variation, mjModel& m) {
  Eigen::Map<Eigen::Vector3d> position(m.body_pos + 3 * scene.tool_body);
  mjtNum* const q = m.body_quat + 4 * scene.tool_body;
  const Eigen::Quaterniond held(q[0], q[1], q[2], q[3]);
  position += held * variation.tool_slip_m;
  const Eigen::Quaterniond turned =
      held * Eigen::Quaterniond(Eigen::AngleAxisd(variation.tool_turn_rad, UnitVector(scene.task.insertion)));
  q[0] = turned.w();
  q[1] = turned.x();
  q[2] = turned.y();
  q[3] = turned.z();
}

}  // namespace

void PhysicsVariation::Validate() const {
  if (!joint_friction_nm.allFinite() || joint_friction_nm.minCoeff() < 0) {
    throw InputError("reset", "joint friction is negative or not finite", "give Nm, zero or more");
  }
  if (!(contact_friction >= 0.0 && contact_friction <= 10.0)) {
    throw InputError("reset", fmt::format("the factor on contact friction is {}", contact_friction), "give 0 to 10");
  }
  if (!(tool_mass >= 0.1 && tool_mass <= 10.0)) {
    throw InputError("reset", fmt::format("the factor on the tool's mass is {}", tool_mass), "give 0.1 to 10");
  }
  if (!(tool_slip_m.norm() <= 0.05) || !(std::abs(tool_turn_rad) <= 1.0)) {
    throw InputError("reset", "the tool has slipped by more than 50 mm or 1 rad, or by what is no number",
                     "give less, in metres and rad");
  }
  if (!(port_stiffness_n_m == 0.0 || (port_stiffness_n_m >= 1e2 && port_stiffness_n_m <= 1e7))) {
    throw InputError("reset", fmt::format("the target stands on springs of {} N/m", port_stiffness_n_m),
                     "give 100 to 10000000, or 0 for a target that stands fast");
  }
  if (!(std::abs(worn_m) <= 5e-3)) {
    throw InputError("reset", fmt::format("edges are worn by {} m", worn_m), "give at most 0.005, either way");
  }
  if (!std::isfinite(clearance_m)) throw InputError("reset", "the clearance is not finite", "give metres");
}

std::shared_ptr<const mjModel> VariedModel(const Scene& scene, const PhysicsVariation& variation) {
  variation.Validate();
  if (variation == PhysicsVariation{}) return scene.model;
  ModelHandle model(mj_copyModel(nullptr, scene.model.get()));
  if (!model) throw WorldError("MuJoCo", "no memory for the model");
  mjModel& m = *model;
  for (int i = 0; i < kJointCount; ++i) {
    m.dof_frictionloss[scene.dof[static_cast<std::size_t>(i)]] += variation.joint_friction_nm[i];
  }
  for (int geom = 0; geom < m.ngeom; ++geom) m.geom_friction[3 * geom] *= variation.contact_friction;
  if (variation.clearance_m != 0.0) Narrow(scene, variation.clearance_m, m);
  if (variation.worn_m != 0.0) WearEdges(scene, variation.worn_m, m);
  if (!variation.tool_slip_m.isZero() || variation.tool_turn_rad != 0.0) Slip(scene, variation, m);
  if (variation.tool_mass != 1.0) {
    for (int body = scene.tool_body; body < m.nbody; ++body) {
      int ancestor = body;
      while (ancestor > scene.tool_body) ancestor = m.body_parentid[ancestor];
      if (ancestor != scene.tool_body) continue;
      m.body_mass[body] *= variation.tool_mass;
      for (int i = 0; i < 3; ++i) m.body_inertia[3 * body + i] *= variation.tool_mass;
    }
    const DataHandle scratch = MakeData(m);
    mj_setConst(&m, scratch.get());
  }
  return {model.release(), ModelDeleter()};
}

}  // namespace feeler::env
