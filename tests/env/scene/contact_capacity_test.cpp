// Room for contacts. Laws: parts of a few boxes stay near the defaults; wherever a tool is pressed on a target of
// hundreds of pieces, MuJoCo finds room for all contacts and rows; whoever sets the sizes keeps them.
#include "feeler/env/scene/contact_capacity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "feeler/core/random.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/scene/scene.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

/// A plate of small boxes around a square hole of 8.4 mm, and a peg of four bars.
TaskText ManyPieces(int per_side) {
  TaskText text;
  text.target.clear();
  const double pitch_m = 0.048 / per_side;
  const auto geom = [](double x, double y, double z, double half_x, double half_y, double half_z, const char* more) {
    return "<geom type=\"box\" pos=\"" + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) +
           "\" size=\"" + std::to_string(half_x) + " " + std::to_string(half_y) + " " + std::to_string(half_z) + "\" " +
           more + "/>\n";
  };
  for (int i = 0; i < per_side; ++i) {
    for (int k = 0; k < per_side; ++k) {
      const double x = (i + 0.5) * pitch_m - 0.024;
      const double y = (k + 0.5) * pitch_m - 0.024;
      if (std::max(std::abs(x), std::abs(y)) - 0.5 * pitch_m < 0.0042 - 1e-9) continue;
      text.target += geom(x, y, -0.01, 0.5 * pitch_m, 0.5 * pitch_m, 0.01, "");
    }
  }
  text.target += geom(0, 0, -0.01, 0.006, 0.006, 0.01, "name=\"lid\" contype=\"0\" conaffinity=\"0\"");
  text.tool.clear();
  for (const double x : {-0.002, 0.002}) {
    for (const double y : {-0.002, 0.002}) text.tool += geom(x, y, 0.015, 0.002, 0.002, 0.015, "");
  }
  return text;
}

TEST(ContactCapacity, FewBoxesStayNearTheDefaults) {
  const SceneOptions least;
  EXPECT_LE(CapacityFor(LoadTask("plug")).rows, least.max_constraints + 100);
  EXPECT_EQ(BuildScene(LoadTask("plug")).model->njmax, CapacityFor(LoadTask("plug")).rows);
  SceneOptions own;
  own.max_constraints = 77;
  EXPECT_EQ(BuildScene(LoadTask("plug"), own).model->njmax, 77);
}

TEST(ContactCapacity, HoldsWhateverIsTouchedAtOnce) {
  for (const int per_side : {16, 24}) {
    const TaskModel task = LoadTaskFromText(ManyPieces(per_side).Mjcf(), "many.xml");
    ASSERT_GT(task.target_geoms.size(), 200U);
    const Scene scene = BuildScene(task);
    EXPECT_GT(scene.model->njmax, SceneOptions{}.max_constraints);
    const DataHandle data = MakeData(*scene.model);
    RandomStream random(3, static_cast<std::uint64_t>(per_side), "places");
    int most = 0;
    for (int trial = 0; trial < 60; ++trial) {
      ResetScene(scene, scene.home_q_rad, *data);
      // The target comes to the tool: its face under the tip, or the tool in the hole.
      Pose world_T_tool = Pose::Identity();
      world_T_tool.translation() = Eigen::Map<const Eigen::Vector3d>(data->site_xpos + 3 * scene.tool_site);
      world_T_tool.linear() =
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->site_xmat + 9 * scene.tool_site);
      const double pressed_m = random.Uniform(0.0, 0.0004);
      const Pose tool_T_target = MakePose({random.Uniform(-0.02, 0.02), random.Uniform(-0.02, 0.02), pressed_m});
      SetTargetPose(scene, world_T_tool * tool_T_target, *data);
      mj_forward(scene.model.get(), data.get());
      EXPECT_EQ(data->warning[mjWARN_CONTACTFULL].number, 0);
      EXPECT_EQ(data->warning[mjWARN_CNSTRFULL].number, 0);
      most = std::max(most, data->nefc);
    }
    EXPECT_GT(most, SceneOptions{}.max_constraints) << "else the defaults would have done";
  }
}

}  // namespace
}  // namespace feeler::env
