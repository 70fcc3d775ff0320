#include "env/convex_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace feeler::env {
namespace {

Pose LocalPose(const mjtNum* position, const mjtNum* quaternion) {
  return MakePose(Eigen::Map<const Eigen::Vector3d>(position),
                  Eigen::Quaterniond(quaternion[0], quaternion[1], quaternion[2], quaternion[3]));
}

}  // namespace

Pose GeomInBody(const mjModel& model, int geom, int body) {
  Pose pose = LocalPose(model.geom_pos + 3 * geom, model.geom_quat + 4 * geom);
  for (int b = model.geom_bodyid[geom]; b != body; b = model.body_parentid[b]) {
    assert(b > 0);
    pose = LocalPose(model.body_pos + 3 * b, model.body_quat + 4 * b) * pose;
  }
  return pose;
}

std::vector<Eigen::Vector3d> MeshHull(const mjModel& model, int geom) {
  const int mesh = model.geom_dataid[geom];
  const float* vertices = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
  const auto vertex = [&](int i) {
    return Eigen::Vector3d(double{vertices[3 * i]}, double{vertices[3 * i + 1]}, double{vertices[3 * i + 2]});
  };
  std::vector<Eigen::Vector3d> hull;
  const int address = model.mesh_graphadr[mesh];
  if (address < 0) {
    for (int i = 0; i < model.mesh_vertnum[mesh]; ++i) hull.push_back(vertex(i));
    return hull;
  }
  // Layout of the graph: numvert, numface, vert_edgeadr[numvert], vert_globalid[numvert], ...
  const int* graph = model.mesh_graph + address;
  const int count = graph[0];
  for (int i = 0; i < count; ++i) hull.push_back(vertex(graph[2 + count + i]));
  return hull;
}

ConvexShape::ConvexShape(const mjModel& model, int geom, const Pose& frame_T_geom)
    : type_(model.geom_type[geom]), size_(model.geom_size + 3 * geom), pose_(frame_T_geom) {
  if (type_ == mjGEOM_MESH) {
    hull_ = MeshHull(model, geom);
    for (Eigen::Vector3d& vertex : hull_) vertex = pose_ * vertex;
  }
  if (type_ == mjGEOM_BOX) {
    const Eigen::Matrix3d magnitude = pose_.linear().cwiseAbs();
    is_aligned_box_ = (magnitude.rowwise().maxCoeff().array() > 1 - 1e-14).all();
  }
}

Eigen::Vector3d ConvexShape::LocalSupport(const Eigen::Vector3d& d) const {
  const double radial = std::hypot(d.x(), d.y());
  const double side = d.z() < 0 ? -1.0 : 1.0;
  switch (type_) {
    case mjGEOM_SPHERE: return d.normalized() * size_[0];
    case mjGEOM_CAPSULE: return d.normalized() * size_[0] + Eigen::Vector3d(0, 0, side * size_[1]);
    case mjGEOM_CYLINDER: {
      Eigen::Vector3d point(0, 0, side * size_[1]);
      if (radial > 0) point.head<2>() = d.head<2>() * (size_[0] / radial);
      return point;
    }
    case mjGEOM_ELLIPSOID: {
      const Eigen::Vector3d scaled = d.cwiseProduct(size_);
      return scaled.cwiseProduct(size_) / scaled.norm();
    }
    default: return {d.x() < 0 ? -size_[0] : size_[0], d.y() < 0 ? -size_[1] : size_[1], side * size_[2]};
  }
}

Eigen::Vector3d ConvexShape::Support(const Eigen::Vector3d& direction) const {
  if (type_ != mjGEOM_MESH) return pose_ * LocalSupport(pose_.linear().transpose() * direction);
  const Eigen::Vector3d* best = &hull_.front();
  double farthest = direction.dot(*best);
  for (const Eigen::Vector3d& vertex : hull_) {
    const double distance = direction.dot(vertex);
    if (distance > farthest) {
      farthest = distance;
      best = &vertex;
    }
  }
  return *best;
}

}  // namespace feeler::env
