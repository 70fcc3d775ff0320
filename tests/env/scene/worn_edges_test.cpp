// Laws of worn edges: the slanted faces around the mouth stand parallel to where they stood, lower by what is worn
// (rays of MuJoCo against the plane z = -(0.0135 + worn - x) of the plug's inlet); the opening below and the top face
// beside it stay; nothing else in the model moves. Targets without a lead-in, and lead-ins that are not so deep, are
// refused.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/scene/physics_variation.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

/// Where a ray that comes down the insertion axis at (x, y) of the target meets it, in its axes, m.
double TopAt(const Scene& scene, const mjModel& model, double x, double y) {
  const DataHandle data = MakeData(model);
  mj_kinematics(&model, data.get());
  constexpr double kFrom_m = 0.004;
  const mjtNum* target = data->xpos + 3 * scene.target_body;
  const mjtNum from[3] = {target[0] + x, target[1] + y, target[2] + kFrom_m};
  const mjtNum down[3] = {0, 0, -1};
  double top = -1.0;
  for (const int geom : scene.target_geoms) {
    // Of one geom at a time: lids and tool are not asked.
    const mjtNum distance = model.geom_type[geom] == mjGEOM_MESH
                                ? mj_rayMesh(&model, data.get(), geom, from, down)
                                : mju_rayGeom(data->geom_xpos + 3 * geom, data->geom_xmat + 9 * geom,
                                              model.geom_size + 3 * geom, from, down, model.geom_type[geom]);
    if (distance >= 0.0) top = std::max(top, kFrom_m - distance);
  }
  return top;
}

std::shared_ptr<const mjModel> Worn(const Scene& scene, double worn_m) {
  PhysicsVariation variation;
  variation.worn_m = worn_m;
  return VariedModel(scene, variation);
}

TEST(WornEdges, TheLeadInIsLowerByWhatIsWorn) {
  const auto scene = PlugScene();
  constexpr double kEdge_m = 0.0135;  // where the lead-in of the plug's inlet begins, across the east wall
  constexpr double kWall_m = 0.0125;  // and where it ends, 1 mm down
  constexpr double kFine_m = 2e-5;    // vertices are single precision, rays are not
  for (const double worn_m : {0.3e-3, 0.1e-3, -0.2e-3, -0.3e-3}) {
    const auto model = Worn(*scene, worn_m);
    for (double x = kWall_m + 5e-5; x < kEdge_m + 0.5e-3; x += 5e-5) {
      const double slanted_m = -(kEdge_m + worn_m - x);
      // A smaller lead-in leaves a slit beside the wall around it, too narrow for any tool.
      if (slanted_m > -2.0 * kFine_m && x < kEdge_m + 2.0 * kFine_m) continue;
      EXPECT_NEAR(TopAt(*scene, *model, x, -0.002), std::min(0.0, slanted_m), kFine_m) << worn_m << " at " << x;
      EXPECT_NEAR(TopAt(*scene, *model, -x, -0.002), std::min(0.0, slanted_m), kFine_m) << worn_m << " at -" << x;
    }
    EXPECT_NEAR(TopAt(*scene, *model, kWall_m - 5e-5, -0.002), TopAt(*scene, *scene->model, kWall_m - 5e-5, -0.002),
                1e-9)
        << "the opening is as wide as it was";
    EXPECT_NEAR(TopAt(*scene, *model, 0.02, 0.0), 0.0, 1e-9);
    EXPECT_EQ(model->ngeom, scene->model->ngeom);
    for (const int geom : scene->tool_geoms) {
      EXPECT_TRUE(
          std::equal(model->geom_size + 3 * geom, model->geom_size + 3 * geom + 3, scene->model->geom_size + 3 * geom));
    }
  }
}

TEST(WornEdges, WhatCannotBeWornIsRefused) {
  const auto plug = PlugScene();
  EXPECT_THROW(Worn(*plug, -1.0e-3), InputError) << "the lead-in is 1 mm deep";
  EXPECT_THROW(Worn(*plug, 0.01), InputError);
  EXPECT_THROW(Worn(BuildScene(LoadTask("elbow-onto-pipe")), 0.3e-3), InputError) << "the tool has the opening";
}

}  // namespace
}  // namespace feeler::env
