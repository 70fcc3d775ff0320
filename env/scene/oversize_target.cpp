#include "feeler/env/scene/oversize_target.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

using Box = Eigen::AlignedBox3d;

Pose GeomPose(const mjModel& model, int geom) {
  const mjtNum* q = model.geom_quat + 4 * geom;
  return MakePose(Eigen::Map<const Eigen::Vector3d>(model.geom_pos + 3 * geom),
                  Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
}

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

Scene WithOversizeTarget(const Scene& scene, double oversize_m) {
  if (!(oversize_m >= 0.0) || !std::isfinite(oversize_m)) {
    throw InputError("oversize target", "the oversize is not a finite number of at least zero", "give one");
  }
  ModelHandle model(mj_copyModel(nullptr, scene.model.get()));
  std::vector<Box> openings;
  for (const int lid : scene.lid_geoms) {
    const double reach = model->geom_rbound[lid];
    Eigen::Vector3d half = Eigen::Map<const Eigen::Vector3d>(model->geom_size + 3 * lid);
    if (model->geom_type[lid] == mjGEOM_CYLINDER) half = {half.x(), half.x(), half.y()};
    if (model->geom_type[lid] != mjGEOM_BOX && model->geom_type[lid] != mjGEOM_CYLINDER) half.setConstant(reach);
    openings.push_back(InTarget(GeomPose(*model, lid), -half, half));
  }
  const Eigen::Vector3d insertion = UnitVector(scene.task.insertion);
  int grown = 0;
  for (const int geom : scene.target_geoms) {
    if (model->geom_type[geom] != mjGEOM_BOX || model->geom_bodyid[geom] != scene.target_body) continue;
    const Pose pose = GeomPose(*model, geom);
    const Eigen::Vector3d half = Eigen::Map<const Eigen::Vector3d>(model->geom_size + 3 * geom);
    Eigen::Vector3d low = -half;
    Eigen::Vector3d high = half;
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs((pose.linear().col(axis)).dot(insertion)) > 0.5) continue;
      for (const int side : {-1, 1}) {
        Eigen::Vector3d skin_low = -half;
        Eigen::Vector3d skin_high = half;
        (side > 0 ? skin_low : skin_high)[axis] = side * half[axis];
        (side > 0 ? skin_high : skin_low)[axis] = side * (half[axis] + oversize_m);
        const Box skin = InTarget(pose, skin_low, skin_high);
        bool closes = false;
        for (const Box& opening : openings) closes = closes || Overlap(skin, opening);
        if (closes) continue;
        (side > 0 ? high : low)[axis] += side * oversize_m;
        ++grown;
      }
    }
    Eigen::Map<Eigen::Vector3d>(model->geom_pos + 3 * geom) = pose * Eigen::Vector3d(0.5 * (low + high));
    Eigen::Map<Eigen::Vector3d>(model->geom_size + 3 * geom) = 0.5 * (high - low);
    model->geom_rbound[geom] = (0.5 * (high - low)).norm();
    model->geom_sameframe[geom] = 0;
  }
  if (grown == 0) {
    throw InputError("oversize target", "the target of task '" + scene.task.name + "' has no side of a box",
                     "build it of box geoms");
  }
  Scene oversize = scene;
  oversize.model = std::shared_ptr<const mjModel>(model.release(), ModelDeleter());
  return oversize;
}

}  // namespace feeler::env
