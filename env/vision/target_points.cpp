#include "feeler/env/vision/target_points.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/env/model/geom_shapes.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {
namespace {

using Eigen::Vector3d;

/// Where a surface is sampled, in the frame of its geom.
using Add = const std::function<void(const Vector3d& point, const Vector3d& normal)>&;

int Steps(double length_m, double spacing_m) {
  return std::max(1, static_cast<int>(std::lround(length_m / spacing_m)));
}

/// Midpoints of a grid over the parallelogram that `a` and `b` span from `corner`.
void SampleParallelogram(const Vector3d& corner, const Vector3d& a, const Vector3d& b, const Vector3d& normal,
                         double spacing_m, Add add) {
  const int rows = Steps(a.norm(), spacing_m);
  const int columns = Steps(b.norm(), spacing_m);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) add(corner + (i + 0.5) / rows * a + (j + 0.5) / columns * b, normal);
  }
}

void SampleBox(const Vector3d& half, double spacing_m, Add add) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      const Vector3d normal = side * Vector3d::Unit(axis);
      const Vector3d corner = half[axis] * normal - half[u] * Vector3d::Unit(u) - half[v] * Vector3d::Unit(v);
      SampleParallelogram(corner, 2.0 * half[u] * Vector3d::Unit(u), 2.0 * half[v] * Vector3d::Unit(v), normal,
                          spacing_m, add);
    }
  }
}

/// Rings of a disc at a height.
void SampleDisc(double radius_m, double z, double side, double spacing_m, Add add) {
  const int rings = Steps(radius_m, spacing_m);
  for (int ring = 0; ring < rings; ++ring) {
    const double r = (ring + 0.5) / rings * radius_m;
    const int count = std::max(3, Steps(2.0 * std::numbers::pi * r, spacing_m));
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / count;
      add({r * std::cos(angle), r * std::sin(angle), z}, {0, 0, side});
    }
  }
}

void SampleMantle(double radius_m, double half_m, double spacing_m, Add add) {
  const int rings = Steps(2.0 * half_m, spacing_m);
  const int count = std::max(6, Steps(2.0 * std::numbers::pi * radius_m, spacing_m));
  for (int ring = 0; ring < rings; ++ring) {
    const double z = half_m * (2.0 * (ring + 0.5) / rings - 1.0);
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / count;
      const Vector3d out(std::cos(angle), std::sin(angle), 0.0);
      add(radius_m * out + z * Vector3d::UnitZ(), out);
    }
  }
}

/// An ellipsoid of these half axes, its upper half moved up by `apart_m` and its lower half down (a capsule's caps).
void SampleEllipsoid(const Vector3d& half, double apart_m, double spacing_m, Add add) {
  const double largest = half.maxCoeff();
  const int rings = std::max(4, Steps(std::numbers::pi * largest, spacing_m));
  for (int ring = 0; ring < rings; ++ring) {
    const double polar = std::numbers::pi * (ring + 0.5) / rings;
    const int count = std::max(4, Steps(2.0 * std::numbers::pi * largest * std::sin(polar), spacing_m));
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / count;
      const Vector3d on_sphere(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle), std::cos(polar));
      const Vector3d point = on_sphere.cwiseProduct(half);
      const double shift = polar < std::numbers::pi / 2 ? apart_m : -apart_m;
      add(point + shift * Vector3d::UnitZ(), on_sphere.cwiseQuotient(half).normalized());
    }
  }
}

void SampleMesh(const mjModel& model, int geom, double spacing_m, Add add) {
  const int mesh = model.geom_dataid[geom];
  const float* vertices = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
  const auto vertex = [&](int i) {
    return Vector3d(double{vertices[3 * i]}, double{vertices[3 * i + 1]}, double{vertices[3 * i + 2]});
  };
  for (int face = 0; face < model.mesh_facenum[mesh]; ++face) {
    const int* index = model.mesh_face + 3 * (model.mesh_faceadr[mesh] + face);
    const Vector3d corner = vertex(index[0]);
    const Vector3d a = vertex(index[1]) - corner;
    const Vector3d b = vertex(index[2]) - corner;
    const Vector3d cross = a.cross(b);
    if (cross.norm() < 1e-12) continue;
    const int steps = Steps(std::max(a.norm(), b.norm()), spacing_m);
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; j < steps - i; ++j) {
        add(corner + (i + 1.0 / 3.0) / steps * a + (j + 1.0 / 3.0) / steps * b, cross.normalized());
      }
    }
  }
}

void SampleGeom(const mjModel& model, int geom, double spacing_m, const std::string& where, Add add) {
  const Vector3d size(model.geom_size + 3 * geom);
  switch (model.geom_type[geom]) {
    case mjGEOM_BOX: return SampleBox(size, spacing_m, add);
    case mjGEOM_SPHERE: return SampleEllipsoid(Vector3d::Constant(size[0]), 0.0, spacing_m, add);
    case mjGEOM_ELLIPSOID: return SampleEllipsoid(size, 0.0, spacing_m, add);
    case mjGEOM_CYLINDER:
      SampleMantle(size[0], size[1], spacing_m, add);
      SampleDisc(size[0], size[1], 1.0, spacing_m, add);
      SampleDisc(size[0], -size[1], -1.0, spacing_m, add);
      return;
    case mjGEOM_CAPSULE:
      SampleMantle(size[0], size[1], spacing_m, add);
      SampleEllipsoid(Vector3d::Constant(size[0]), size[1], spacing_m, add);
      return;
    case mjGEOM_MESH: return SampleMesh(model, geom, spacing_m, add);
    default:
      throw InputError(where, "a geom of the target is a plane or a height field", "use boxes, cylinders or meshes");
  }
}

/// A geom with its place in the target, and whether a point lies inside.
struct Placed {
  int geom = -1;
  Pose target_T_geom;

  bool Holds(const mjModel& model, const Vector3d& target_p) const {
    const Vector3d p = target_T_geom.inverse() * target_p;
    const Vector3d size(model.geom_size + 3 * geom);
    const double radial = p.head<2>().norm();
    switch (model.geom_type[geom]) {
      case mjGEOM_BOX: return (p.cwiseAbs().array() < size.array()).all();
      case mjGEOM_SPHERE: return p.norm() < size[0];
      case mjGEOM_ELLIPSOID: return p.cwiseQuotient(size).norm() < 1.0;
      case mjGEOM_CYLINDER: return radial < size[0] && std::abs(p.z()) < size[1];
      case mjGEOM_CAPSULE: return std::hypot(radial, std::max(0.0, std::abs(p.z()) - size[1])) < size[0];
      default: return false;  // a mesh need not be convex: what it hides stays
    }
  }
};

std::vector<Placed> DrawnGeoms(const TaskModel& task_model) {
  const mjModel& model = *task_model.model;
  std::vector<Placed> placed;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    int body = model.geom_bodyid[geom];
    while (body > task_model.target_body) body = model.body_parentid[body];
    if (body != task_model.target_body) continue;
    if (std::find(task_model.lid_geoms.begin(), task_model.lid_geoms.end(), geom) != task_model.lid_geoms.end())
      continue;
    if (model.geom_group[geom] > Scene::kVisualGroup) continue;  // groups above are not drawn
    placed.push_back({geom, GeomInBody(model, geom, task_model.target_body)});
  }
  return placed;
}

}  // namespace

TargetPoints SampleTargetSurface(const TaskModel& task_model, double spacing_m) {
  if (!(spacing_m > 0.0))
    throw InputError("surface of the target", "the spacing is not positive", "give a positive number");
  const mjModel& model = *task_model.model;
  const std::vector<Placed> placed = DrawnGeoms(task_model);
  TargetPoints surface;
  for (const Placed& own : placed) {
    SampleGeom(model, own.geom, spacing_m, task_model.file.string(),
               [&](const Vector3d& point, const Vector3d& normal) {
                 constexpr double kOff_m = 3e-4;  // past faces that coincide
                 const Vector3d target_normal = own.target_T_geom.linear() * normal;
                 const Vector3d target_point = own.target_T_geom * point;
                 const Vector3d outside = target_point + kOff_m * target_normal;
                 for (const Placed& other : placed) {
                   if (other.geom != own.geom && other.Holds(model, outside)) return;
                 }
                 surface.points_m.push_back(target_point);
                 surface.normals.push_back(target_normal);
               });
  }
  return surface;
}

}  // namespace feeler::env
