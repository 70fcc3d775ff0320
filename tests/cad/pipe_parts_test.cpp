// Pipes and elbows. Laws:
//   the part files that ship are what the default sizes make;  sizes that make no part are refused;  a bigger clearance
//   leaves a wider bore (MuJoCo's own collision detection tells);  travel for a target of any pose (ExactTravel) is
//   that of the contact map at the poses of its lattice, and MuJoCo's collision detection changes its mind there;  the
//   side arm is what makes yaw felt: without it contact cannot see the turn about the axis, and that is said.

#include "feeler/cad/pipe_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/env/contact/axis_visibility.h"
#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/contact/contact_map_check.h"
#include "feeler/env/model/overlap_judge.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_pieces.h"

namespace feeler::cad {
namespace {

using namespace env;  // what the parts are judged with
using planner::ContactMap;

std::string TextOf(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(PipeParts, FilesThatShipAreMadeFromTheDefaultSizes) {
  for (const PartFile& part : GeneratePipeParts({})) {
    EXPECT_EQ(TextOf(std::string(FEELER_SOURCE_DIR) + "/models/parts/" + part.name), part.text) << part.name;
  }
}

TEST(PipeParts, SizesThatMakeNoPartAreRefused) {
  PipeParameters no_wall;
  no_wall.clearance_m = 0.004;
  EXPECT_THROW(GeneratePipeParts(no_wall), InputError);
  PipeParameters short_arm;
  short_arm.side_arm_m = 0.02;
  EXPECT_THROW(GeneratePipeParts(short_arm), InputError);
  PipeParameters not_a_number;
  not_a_number.pipe_diameter_m = std::nan("");
  EXPECT_THROW(GeneratePipeParts(not_a_number), InputError);
  PipeParameters shallow;
  shallow.lid_recess_m = 0.03;
  EXPECT_THROW(GeneratePipeParts(shallow), InputError);
}

/// The shipped task with fewer hypotheses and less room, so that its maps are small.
TaskModel SmallTask(const std::string& name, int yaws, int pitches) {
  TaskModel task_model = LoadTask(name);
  for (UncertainAxis& axis : task_model.task.axes) {
    axis.min_cells = 1;
    axis.max_cells = axis.kind == AxisKind::kYaw ? yaws : axis.kind == AxisKind::kPitch ? pitches : 2;
  }
  return task_model;
}

class PipeTask : public testing::TestWithParam<const char*> {};

TEST_P(PipeTask, ExactTravelIsThatOfTheMapAndOfMujoco) {
  TaskModel task_model = SmallTask(GetParam(), 1, 2);
  task_model.task.workspace_m = {0.05, 0.03, 0.028};
  task_model.task.workspace_center_m = {0.02, 0.02, -0.012};
  const ContactMap map = BuildContactMap(task_model, Opening::kClosed);
  const auto orientations = TargetOrientations(task_model.task);
  ASSERT_EQ(map.orientations(), 2);
  const auto exact = MakeExactTravel(task_model, Opening::kClosed);
  const double cell_m = task_model.task.cell_m;
  RandomStream random(1, 0, "places");
  const Cell size = map.domain().Size();
  int met = 0;
  for (int orientation = 0; orientation < 2; ++orientation) {
    OverlapJudge judge(task_model, GeomsOf(task_model, Opening::kClosed),
                       orientations[static_cast<std::size_t>(orientation)]);
    // A target somewhere: only the difference counts.
    Pose frame_T_target = MakePose({0.011, -0.007, 0.003}, orientations[static_cast<std::size_t>(orientation)]);
    std::vector<planner::ToolMotion> motions;
    std::vector<float> travel;
    for (int i = 0; i < 1500; ++i) {
      Cell cell = map.domain().min;
      for (int axis = 0; axis < 3; ++axis) {
        cell[axis] += static_cast<int>(random.Index(static_cast<std::uint64_t>(size[axis])));
      }
      const Direction direction = kDirections[random.Index(kDirectionCount)];
      if (map.Blocked(cell, orientation)) continue;
      motions.push_back({frame_T_target.translation() + (cell.cast<double>() + map.phase()) * cell_m, direction});
      travel.push_back(map.Travel(cell, direction, orientation));
    }
    const std::vector<double> exact_m = exact->Travel(frame_T_target, motions);
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (travel[i] > 200) continue;  // beyond the domain the map repeats itself
      EXPECT_NEAR(exact_m[i], double{travel[i]} * cell_m, 1e-5) << i;
      const Eigen::Vector3d from = motions[i].from_m - frame_T_target.translation();
      EXPECT_FALSE(judge.Overlap(from + (exact_m[i] - 5e-5) * UnitVector(motions[i].direction)));
      EXPECT_TRUE(judge.Overlap(from + (exact_m[i] + 5e-5) * UnitVector(motions[i].direction)) || exact_m[i] < 5e-5 ||
                  !judge.Overlap(from + (exact_m[i] + 2e-4) * UnitVector(motions[i].direction)));
      ++met;
    }
  }
  EXPECT_GT(met, 200);
}

TEST_P(PipeTask, MujocoAgreesEveryAxisIsFeltAndTurningFreelyIsFound) {
  const TaskModel task_model = SmallTask(GetParam(), 2, 2);
  EXPECT_TRUE(task_model.task.turns_freely);
  const ContactMap map = BuildContactMap(task_model, Opening::kClosed, Parallelism(2));
  const ContactMapCheck check = CheckContactMap(task_model, Opening::kClosed, map, 4000, 1, 5e-5, Parallelism(2));
  EXPECT_EQ(check.disagreements, 0);
  EXPECT_GT(check.blocked, 400);
  EXPECT_GT(check.probes - check.blocked, 400);
  EXPECT_EQ(check.probes + check.grazing, 4000);
  for (const AxisVisibility& axis : AxisVisibilities(task_model.task, map)) {
    EXPECT_EQ(axis.alike_pairs, 0) << ToString(axis.kind);
    EXPECT_GT(axis.fewest_probes, 40) << ToString(axis.kind);
    EXPECT_GT(axis.largest_difference_cells, 1.0) << ToString(axis.kind);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, PipeTask, testing::Values("pipe-into-elbow", "elbow-onto-pipe"),
                         [](const auto& task) { return std::string(task.param).substr(0, 4); });

TEST(PipeParts, TheTurnOfARoundPipeAboutItsOwnAxisIsNotSeen) {
  TaskModel task_model = SmallTask("elbow-onto-pipe", 3, 1);
  // Without its branch.
  const int branch = mj_name2id(task_model.model.get(), mjOBJ_GEOM, "post_branch");
  std::erase(task_model.target_geoms, branch);
  task_model.task.workspace_m = {0.05, 0.05, 0.02};
  task_model.task.workspace_center_m = {0.0, 0.0, -0.012};
  const ContactMap map = BuildContactMap(task_model, Opening::kClosed);
  for (const AxisVisibility& axis : AxisVisibilities(task_model.task, map)) {
    if (axis.kind == AxisKind::kYaw) {
      EXPECT_FALSE(axis.felt());
      EXPECT_EQ(axis.pairs, 2);
      EXPECT_LT(axis.largest_difference_cells, kFeltDifference_cells);
    } else if (axis.kind != AxisKind::kPitch) {
      EXPECT_TRUE(axis.felt()) << ToString(axis.kind);
    }
  }
}

TEST(PipeParts, AWorkspaceMovedFromTheStart) {
  const TaskModel task_model = LoadTask("pipe-into-elbow");
  const Task& task = task_model.task;
  const Cell cuboid = LargestPositionExtents(task);
  const CellBox workspace = WorkspaceCells(task, cuboid);
  EXPECT_TRUE(workspace.Contains(StartCell(task, cuboid)));
  // Down beside the side arm, whose top is at -18 mm, and up no farther than that takes.
  EXPECT_LE(workspace.min.z() * task.cell_m, -0.026);
  EXPECT_LE(workspace.max.z() * task.cell_m, 0.04);
}

}  // namespace
}  // namespace feeler::cad
