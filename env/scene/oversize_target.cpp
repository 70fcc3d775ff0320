#include "feeler/env/scene/oversize_target.h"

#include <cmath>

#include "feeler/core/error.h"
#include "feeler/env/scene/target_openings.h"

namespace feeler::env {

Scene WithOversizeTarget(const Scene& scene, double oversize_m) {
  if (!(oversize_m >= 0.0) || !std::isfinite(oversize_m)) {
    throw InputError("oversize target", "the oversize is not a finite number of at least zero", "give one");
  }
  ModelHandle model(mj_copyModel(nullptr, scene.model.get()));
  const auto openings = TargetOpenings(scene, *model);
  const Eigen::Vector3d insertion = UnitVector(scene.task.insertion);
  int grown = 0;
  for (const int geom : scene.target_geoms) {
    if (model->geom_type[geom] != mjGEOM_BOX || model->geom_bodyid[geom] != scene.target_body) continue;
    const Pose pose = GeomPose(*model, geom);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs((pose.linear().col(axis)).dot(insertion)) > 0.5) continue;
      for (const int side : {-1, 1}) {
        if (SideFacesOpening(*scene.model, geom, axis, side, oversize_m, openings)) continue;
        MoveSide(geom, axis, side, oversize_m, *model);
        ++grown;
      }
    }
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
