#include "feeler/env/scene/target_openings.h"

#include <algorithm>

namespace feeler::env {
namespace {

using Box = Eigen::AlignedBox3d;

/// Box around a part of a geom given in the geom's own frame, in axes of the target.
Box InTarget(const Pose& target_T_geom, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Box box;
  for (int corner = 0; corner < 8; ++corner) {
    box.extend(target_T_geom * Eigen::Vector3d(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                                               corner & 4 ? high.z() : low.z()));
  }
  return box;
}

bool Overlap(const Box& a, const Box& b) {
  constexpr double kTouching_m = 1e-6;
  const Eigen::Vector3d sizes = a.max().cwiseMin(b.max()) - a.min().cwiseMax(b.min());
  return sizes.minCoeff() > kTouching_m;
}

}  // namespace

Pose GeomPose(const mjModel& model, int geom) {
  const mjtNum* q = model.geom_quat + 4 * geom;
  return MakePose(Eigen::Map<const Eigen::Vector3d>(model.geom_pos + 3 * geom),
                  Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
}

std::vector<Box> TargetOpenings(const Scene& scene, const mjModel& model) {
  std::vector<Box> openings;
  for (const int lid : scene.lid_geoms) {
    if (model.geom_bodyid[lid] != scene.target_body) continue;
    const double reach = model.geom_rbound[lid];
    Eigen::Vector3d half = Eigen::Map<const Eigen::Vector3d>(model.geom_size + 3 * lid);
    if (model.geom_type[lid] == mjGEOM_CYLINDER) half = {half.x(), half.x(), half.y()};
    if (model.geom_type[lid] != mjGEOM_BOX && model.geom_type[lid] != mjGEOM_CYLINDER) half.setConstant(reach);
    openings.push_back(InTarget(GeomPose(model, lid), -half, half));
  }
  return openings;
}

bool SideFacesOpening(const mjModel& model, int geom, int axis, int side, double thickness_m,
                      const std::vector<Box>& openings) {
  const Eigen::Vector3d half = Eigen::Map<const Eigen::Vector3d>(model.geom_size + 3 * geom);
  Eigen::Vector3d low = -half;
  Eigen::Vector3d high = half;
  (side > 0 ? low : high)[axis] = side * half[axis];
  (side > 0 ? high : low)[axis] = side * (half[axis] + thickness_m);
  const Box skin = InTarget(GeomPose(model, geom), low, high);
  return std::ranges::any_of(openings, [&](const Box& opening) { return Overlap(skin, opening); });
}

void MoveSide(int geom, int axis, int side, double by_m, mjModel& model) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  shift[axis] = 0.5 * side * by_m;
  const Pose pose = GeomPose(model, geom);
  Eigen::Map<Eigen::Vector3d>(model.geom_pos + 3 * geom) = pose * shift;
  Eigen::Map<Eigen::Vector3d> half(model.geom_size + 3 * geom);
  half[axis] += 0.5 * by_m;
  model.geom_rbound[geom] = half.norm();
  model.geom_sameframe[geom] = 0;
}

}  // namespace feeler::env
