// Every task file that ships. Laws:
//   MuJoCo opens the file as it is;  the scene with the robot compiles;  the wall that lies nearest to a lattice plane
//   is a tenth of a cell away at least (of the target as estimated; turned ones have slanted walls), else an
//   off-lattice truth reads as the wrong outcome;  the start is free of contact under every hypothesis of the largest
//   problem, and every step from there is a move the map knows; aligned, the tool is stopped at the mouth by the lid
//   and by nothing with the opening open.

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cctype>
#include <string>

#include "feeler/core/lattice.h"
#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {
namespace {

constexpr double kLeastMargin_cells = 0.1;

class EveryTask : public testing::TestWithParam<std::string> {};

TEST_P(EveryTask, OpensAndMakesAScene) {
  const TaskModel task = LoadTask(GetParam());
  char error[1000] = "";
  const ModelHandle alone(mj_loadXML(task.file.c_str(), nullptr, error, sizeof(error)));
  ASSERT_NE(alone, nullptr) << error;
  EXPECT_STREQ(error, "");
  EXPECT_EQ(alone->ngeom, task.model->ngeom);

  const Scene scene = BuildScene(task);
  EXPECT_EQ(scene.tool_geoms.size(), task.tool_geoms.size());
  EXPECT_EQ(scene.target_geoms.size(), task.target_geoms.size());
  EXPECT_EQ(scene.lid_geoms.size(), task.lid_geoms.size() + task.tool_lid_geoms.size());
}

/// With the outermost angles only, where there are many: a map has a layer for each pair.
TaskModel WithFewAngles(TaskModel task_model) {
  for (UncertainAxis& axis : task_model.task.axes) {
    if (!axis.angular() || axis.max_cells <= 2) continue;
    axis.resolution *= axis.max_cells - 1;
    axis.max_cells = 2;
  }
  return task_model;
}

TEST_P(EveryTask, WallsKeepOffTheLatticeAndTheStartIsFree) {
  const TaskModel task_model = WithFewAngles(LoadTask(GetParam()));
  const Task& task = task_model.task;
  const planner::ContactMap map = BuildContactMap(task_model, Opening::kClosed);
  EXPECT_GE(map.margin_cells(), kLeastMargin_cells);
  EXPECT_LE(map.margin_cells(), 0.5);

  const Cell cuboid = LargestPositionExtents(task);
  const Cell start = StartCell(task, cuboid);
  for (int orientation = 0; orientation < map.orientations(); ++orientation) {
    for (int x = 0; x < cuboid.x(); ++x) {
      for (int y = 0; y < cuboid.y(); ++y) {
        for (int z = 0; z < cuboid.z(); ++z) {
          const Cell displacement = start - Cell(x, y, z);
          EXPECT_FALSE(map.Blocked(displacement, orientation)) << displacement.transpose();
          EXPECT_TRUE(map.domain().Contains(displacement)) << displacement.transpose();
        }
      }
    }
  }
}

TEST_P(EveryTask, TheLidEndsAtTheMouth) {
  const TaskModel task_model = LoadTask(GetParam());
  const Task& task = task_model.task;
  if (TargetOrientations(task).size() > 1) GTEST_SKIP() << "a tilted target has its lid at another height";
  const planner::ContactMap map = BuildContactMap(task_model, Opening::kClosed);
  // The lattice point over the mouth, next to the axis of the insertion.
  const int axis = AxisOf(task.insertion);
  Cell over = Cell::Zero();
  over[axis] = StartCell(task, Cell::Ones())[axis];
  const double height_cells = -UnitVector(task.insertion).dot(over.cast<double>() + map.phase());
  EXPECT_NEAR(map.Travel(over, task.insertion) * task.cell_m, height_cells * task.cell_m, 1e-4);
}

std::string TestName(const testing::TestParamInfo<std::string>& task) {
  std::string name = task.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char letter) { return std::isalnum(letter) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Models, EveryTask, testing::ValuesIn(ListTasks()), TestName);

}  // namespace
}  // namespace feeler::env
