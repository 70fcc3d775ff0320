#include "feeler/env/scene/worn_edges.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/scene/target_openings.h"

namespace feeler::env {
namespace {

/// Vertices nearer than this to the plane of the mouth are in it.
constexpr double kInPlane_m = 1e-5;
/// A slanted face that ends farther down the opening than this share of it is its wall, not its lead-in.
constexpr double kLeadInOfDepth = 0.75;
/// What is left of a lead-in, at least.
constexpr double kLeast_m = 5e-5;

/// An edge point of a slanted face at the mouth, and the one below it where the lead-in ends; in axes of the target.
struct Slant {
  int rim = -1;
  int end = -1;
};

struct Mouth {
  Eigen::Vector3d inward;  ///< along the insertion
  double plane = 0.0;      ///< where it is along `inward`
  double depth = 0.0;      ///< of the opening
  double Below(const Eigen::Vector3d& point) const { return point.dot(inward) - plane; }
  Eigen::Vector3d Across(const Eigen::Vector3d& v) const { return v - v.dot(inward) * inward; }
};

Mouth MouthOf(const Scene& scene, const std::vector<Eigen::AlignedBox3d>& openings) {
  Mouth mouth;
  mouth.inward = UnitVector(scene.task.insertion);
  Eigen::AlignedBox3d all;
  for (const auto& opening : openings) all.extend(opening);
  const double a = all.min().dot(mouth.inward);
  const double b = all.max().dot(mouth.inward);
  mouth.plane = std::min(a, b);
  mouth.depth = std::abs(b - a);
  return mouth;
}

/// Of a mesh whose vertices, in axes of the target, are these: each end of a lead-in with the nearest point of the rim.
std::vector<Slant> SlantsOf(const std::vector<Eigen::Vector3d>& vertices, const Mouth& mouth) {
  std::vector<Slant> slants;
  for (std::size_t end = 0; end < vertices.size(); ++end) {
    const double below = mouth.Below(vertices[end]);
    if (below < kInPlane_m || below > kLeadInOfDepth * mouth.depth) continue;
    Slant slant{-1, static_cast<int>(end)};
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t rim = 0; rim < vertices.size(); ++rim) {
      if (std::abs(mouth.Below(vertices[rim])) > kInPlane_m) continue;
      const double distance = mouth.Across(vertices[rim] - vertices[end]).norm();
      if (distance >= nearest) continue;
      nearest = distance;
      slant.rim = static_cast<int>(rim);
    }
    if (slant.rim >= 0 && nearest > kInPlane_m) slants.push_back(slant);
  }
  return slants;
}

/// Moves the lead-in of one mesh; how far its rim has moved out, at most, per axis of the target.
Eigen::Vector3d WearMesh(const Scene& scene, int geom, const Mouth& mouth, double worn_m, mjModel& model) {
  const Pose pose = GeomPose(model, geom);
  const int mesh = model.geom_dataid[geom];
  const int first = model.mesh_vertadr[mesh];
  std::vector<Eigen::Vector3d> vertices;
  for (int v = 0; v < model.mesh_vertnum[mesh]; ++v) {
    vertices.emplace_back(pose * Eigen::Map<const Eigen::Vector3f>(model.mesh_vert + 3 * (first + v)).cast<double>());
  }
  const auto put = [&](int vertex, const Eigen::Vector3d& at) {
    Eigen::Map<Eigen::Vector3f>(model.mesh_vert + 3 * (first + vertex)) = (pose.inverse() * at).cast<float>();
  };
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  for (const Slant& slant : SlantsOf(vertices, mouth)) {
    const Eigen::Vector3d& end = vertices[static_cast<std::size_t>(slant.end)];
    const Eigen::Vector3d& rim = vertices[static_cast<std::size_t>(slant.rim)];
    const double below_m = mouth.Below(end);
    if (below_m + worn_m < kLeast_m) {
      throw InputError("worn edges",
                       fmt::format("the lead-in of task '{}' is {:.2f} mm deep, and is to be {:.2f} mm less",
                                   scene.task.name, 1e3 * below_m, -1e3 * worn_m),
                       fmt::format("give more than {:.2f} mm", 1e3 * (kLeast_m - below_m)));
    }
    const Eigen::Vector3d out = worn_m / below_m * mouth.Across(rim - end);
    put(slant.end, end + worn_m * mouth.inward);
    put(slant.rim, rim + out);
    moved = moved.cwiseMax(out.cwiseAbs());
  }
  double reach = 0.0;
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  for (int v = first; v < first + model.mesh_vertnum[mesh]; ++v) {
    const Eigen::Vector3d vertex = Eigen::Map<const Eigen::Vector3f>(model.mesh_vert + 3 * v).cast<double>();
    reach = std::max(reach, vertex.norm());
    half = half.cwiseMax(vertex.cwiseAbs());
  }
  for (int other = 0; other < model.ngeom; ++other) {
    if (model.geom_type[other] != mjGEOM_MESH || model.geom_dataid[other] != mesh) continue;
    Eigen::Map<Eigen::Vector3d>(model.geom_size + 3 * other) = half;
    model.geom_rbound[other] = std::max(model.geom_rbound[other], reach + 1e-9);
  }
  return moved;
}

}  // namespace

void WearEdges(const Scene& scene, double worn_m, mjModel& model) {
  const auto openings = TargetOpenings(scene, model);
  std::set<int> worn_meshes;  // several geoms may share one
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  if (!openings.empty()) {
    const Mouth mouth = MouthOf(scene, openings);
    for (const int geom : scene.target_geoms) {
      if (model.geom_type[geom] != mjGEOM_MESH || model.geom_bodyid[geom] != scene.target_body) continue;
      if (!worn_meshes.insert(model.geom_dataid[geom]).second) continue;
      moved = moved.cwiseMax(WearMesh(scene, geom, mouth, worn_m, model));
    }
  }
  if (moved.isZero()) {
    throw InputError("worn edges",
                     fmt::format("the target of task '{}' has no lead-in made of meshes", scene.task.name),
                     "leave the edges as they are");
  }
  if (worn_m < 0.0) return;
  // What stands around the opening gives way to the rim.
  const Eigen::Vector3d insertion = UnitVector(scene.task.insertion);
  for (const int geom : scene.target_geoms) {
    if (model.geom_type[geom] != mjGEOM_BOX || model.geom_bodyid[geom] != scene.target_body) continue;
    const Pose pose = GeomPose(model, geom);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d normal = pose.linear().col(axis);
      if (std::abs(normal.dot(insertion)) > 0.5) continue;
      const double by_m = normal.cwiseAbs().dot(moved);
      for (const int side : {-1, 1}) {
        if (SideFacesOpening(*scene.model, geom, axis, side, by_m, openings)) MoveSide(geom, axis, side, -by_m, model);
      }
    }
  }
}

}  // namespace feeler::env
