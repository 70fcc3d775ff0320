#include "feeler/env/model/geom_shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <limits>

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

planner::ConvexPiece PieceOf(const mjModel& model, int geom, const Pose& frame_T_geom) {
  planner::ConvexPiece piece;
  piece.size_m = Eigen::Map<const Eigen::Vector3d>(model.geom_size + 3 * geom);
  piece.frame_T_piece = frame_T_geom;
  switch (model.geom_type[geom]) {
    case mjGEOM_SPHERE: piece.kind = planner::ShapeKind::kSphere; break;
    case mjGEOM_CAPSULE: piece.kind = planner::ShapeKind::kCapsule; break;
    case mjGEOM_CYLINDER: piece.kind = planner::ShapeKind::kCylinder; break;
    case mjGEOM_ELLIPSOID: piece.kind = planner::ShapeKind::kEllipsoid; break;
    case mjGEOM_MESH:
      piece.kind = planner::ShapeKind::kPolytope;
      piece.vertices_m = MeshHull(model, geom);
      break;
    default: piece.kind = planner::ShapeKind::kBox;
  }
  return piece;
}

std::array<double, 2> SpanOf(const mjModel& model, const std::vector<int>& geoms, int body,
                             const Eigen::Vector3d& along) {
  std::array<double, 2> span{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const int geom : geoms) {
    if (model.geom_type[geom] == mjGEOM_PLANE) continue;
    const Pose pose = GeomInBody(model, geom, body);
    const auto add = [&](double value) { span = {std::min(span[0], value), std::max(span[1], value)}; };
    if (model.geom_type[geom] == mjGEOM_MESH) {
      for (const Eigen::Vector3d& vertex : MeshHull(model, geom)) add(along.dot(pose * vertex));
      continue;
    }
    const double* size = model.geom_size + 3 * geom;
    Eigen::Vector3d half(size[0], size[1], size[2]);
    if (model.geom_type[geom] == mjGEOM_SPHERE) half.setConstant(size[0]);
    if (model.geom_type[geom] == mjGEOM_CYLINDER) half = {size[0], size[0], size[1]};
    if (model.geom_type[geom] == mjGEOM_CAPSULE) half = {size[0], size[0], size[0] + size[1]};
    const double reach = (pose.linear().transpose() * along).cwiseAbs().dot(half);
    add(along.dot(pose.translation()) + reach);
    add(along.dot(pose.translation()) - reach);
  }
  return span;
}

}  // namespace feeler::env
