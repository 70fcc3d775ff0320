// The contact map of a task. Oracles and laws:
//   box tool, box target: closed form;  any task: stepping in twentieths of a cell with MuJoCo's collision detection;
//   step law: a free step shortens the travel by one cell;  mirror law: a mirrored task has the mirrored map;
//   the map is the same at any number of threads;  open and closed differ at the opening only, and the closed mouth is
//   shut; the phase: no other phase leaves the walls a larger margin (brute force over a fine grid).

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/lattice_grid.h"
#include "feeler/core/random.h"
#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/contact/lattice_phase.h"
#include "feeler/env/contact/line_sweep.h"
#include "feeler/env/model/overlap_judge.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

using planner::ContactMap;
using ::testing::HasSubstr;

/// A tool and a target that do not fit into each other would not load; this skips that check by building the model of a
/// valid task and replacing the geoms.
TaskModel WithGeoms(const std::string& tool, const std::string& target, const std::string& assets = "") {
  TaskModel valid = LoadTaskFromText(TaskText().Mjcf(), "peg.xml");
  const std::string mjcf = "<mujoco>" + assets + "<worldbody><body name=\"tool\">" + tool +
                           "</body><body name=\"target\">" + target + "</body></worldbody></mujoco>";
  valid.model = std::shared_ptr<const mjModel>(CompileMjcf(mjcf, "geoms"));
  valid.tool_geoms.clear();
  valid.target_geoms.clear();
  valid.lid_geoms.clear();
  valid.tool_body = mj_name2id(valid.model.get(), mjOBJ_BODY, "tool");
  valid.target_body = mj_name2id(valid.model.get(), mjOBJ_BODY, "target");
  for (int geom = 0; geom < valid.model->ngeom; ++geom) {
    (valid.model->geom_bodyid[geom] == valid.tool_body ? valid.tool_geoms : valid.target_geoms).push_back(geom);
  }
  valid.task.start_offset_m = {0, 0, 0.06};
  valid.task.workspace_m = {0.05, 0.05, 0.09};
  return valid;
}

Eigen::Vector3d DisplacementOf(const ContactMap& map, const Cell& cell, double cell_m) {
  return (cell.cast<double>() + map.phase()) * cell_m;
}

Cell RandomCell(RandomStream& random, const CellBox& box) {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = box.min[axis] + static_cast<int>(random.Index(static_cast<std::uint64_t>(box.Size()[axis])));
  }
  return cell;
}

TEST(ContactMap, BoxAgainstBoxIsAnalytic) {
  RandomStream random(3, 0, "boxes");
  for (int trial = 0; trial < 4; ++trial) {
    const auto size = [&] {
      return Eigen::Vector3d(random.Uniform(0.003, 0.015), random.Uniform(0.003, 0.015), random.Uniform(0.003, 0.015));
    };
    const Eigen::Vector3d tool = size();
    const Eigen::Vector3d target = size();
    const Eigen::Vector3d at(random.Uniform(-0.01, 0.01), random.Uniform(-0.01, 0.01), -target.z());
    const TaskModel task_model =
        WithGeoms(fmt::format(R"(<geom type="box" size="{} {} {}"/>)", tool.x(), tool.y(), tool.z()),
                  fmt::format(R"(<geom type="box" size="{} {} {}" pos="{} {} {}"/>)", target.x(), target.y(),
                              target.z(), at.x(), at.y(), at.z()));
    const ContactMap map = BuildContactMap(task_model, Opening::kClosed);
    const Eigen::Vector3d low = at - tool - target;
    const Eigen::Vector3d high = at + tool + target;
    ForEachCell(map.domain(), [&](const Cell& cell) {
      const Eigen::Vector3d p = DisplacementOf(map, cell, task_model.task.cell_m);
      for (const Direction d : kDirections) {
        const int axis = AxisOf(d);
        bool in_line = true;
        for (const int across : {(axis + 1) % 3, (axis + 2) % 3}) {
          in_line = in_line && p[across] > low[across] && p[across] < high[across];
        }
        const bool blocked = in_line && p[axis] > low[axis] && p[axis] < high[axis];
        const double way = SignOf(d) > 0 ? low[axis] - p[axis] : p[axis] - high[axis];
        const double travel = blocked               ? 0
                              : in_line && way >= 0 ? way / task_model.task.cell_m
                                                    : double{ContactMap::kUnlimited};
        ASSERT_EQ(map.Blocked(cell), blocked);
        ASSERT_NEAR(map.Travel(cell, d), travel, 1e-3) << cell.transpose() << " " << ToString(d);
      }
    });
    EXPECT_GT(map.margin_cells(), 0.24);
  }
}

/// Checks random travels of a map against stepping with MuJoCo's collision detection. A surface that the tool grazes
/// within `slack_m` may be judged either way.
void CheckByStepping(const TaskModel& task_model, const std::vector<int>& target_geoms, const ContactMap& map,
                     int layer, const Eigen::Quaterniond& orientation, int samples, const char* name) {
  OverlapJudge judge(task_model, target_geoms, orientation);
  RandomStream random(4, 0, name);
  const double cell_m = task_model.task.cell_m;
  int walls = 0;
  for (int sample = 0; sample < samples; ++sample) {
    const Cell cell = RandomCell(random, map.domain());
    const Eigen::Vector3d p = DisplacementOf(map, cell, cell_m);
    const Direction d = kDirections[random.Index(kDirectionCount)];
    const auto overlap = [&](double cells) { return judge.Overlap(p + UnitVector(d) * (cells * cell_m)); };
    if (map.Blocked(cell, layer)) {
      ASSERT_TRUE(overlap(0)) << name << " " << cell.transpose();
      ASSERT_EQ(map.Travel(cell, d, layer), 0.0F);
      continue;
    }
    const double travel = map.Travel(cell, d, layer);
    for (double t = 0; t < std::min(travel - 0.01, 40.0); t += 0.05) {
      ASSERT_FALSE(overlap(t)) << name << " " << cell.transpose() << " " << ToString(d) << " at " << t << " of "
                               << travel;
    }
    if (travel > 100) continue;
    ++walls;
    ASSERT_FALSE(overlap(travel - 0.01)) << name << " " << cell.transpose() << " " << ToString(d) << " " << travel;
    // Past a grazed surface the overlap may be too shallow to be seen at once.
    bool hit = false;
    for (double t = travel + 0.002; t < travel + 0.5 && !hit; t += 0.01) hit = overlap(t);
    ASSERT_TRUE(hit) << name << " " << cell.transpose() << " " << ToString(d) << " " << travel;
  }
  EXPECT_GT(walls, samples / 50) << name;
}

void CheckStepLaw(const ContactMap& map, int layer = 0) {
  ForEachCell(map.domain(), [&](const Cell& cell) {
    for (const Direction d : kDirections) {
      const Cell next = cell + UnitCell(d);
      if (!map.domain().Contains(next) || !map.StepFree(cell, d, layer)) continue;
      ASSERT_FALSE(map.Blocked(next, layer));
      if (map.Travel(cell, d, layer) == ContactMap::kUnlimited) {
        ASSERT_EQ(map.Travel(next, d, layer), ContactMap::kUnlimited);
      } else {
        ASSERT_NEAR(map.Travel(next, d, layer), map.Travel(cell, d, layer) - 1, 1e-3);
      }
    }
  });
}

TEST(ContactMap, CurvedAndSlantedPartsMatchStepping) {
  const std::string wedge =
      R"(<asset><mesh name="wedge" vertex="0 0 0  0.03 0 0  0 0.02 0  0 0 0.025  0.03 0 0.025"/></asset>)";
  const std::vector<std::pair<std::string, std::string>> parts = {
      {R"(<geom type="cylinder" size="0.006 0.01"/>)",
       R"(<geom type="capsule" size="0.007 0.01" euler="40 20 0"/><geom type="sphere" size="0.008" pos="0.02 0 0"/>)"},
      {R"(<geom type="mesh" mesh="wedge"/>)",
       R"(<geom type="ellipsoid" size="0.006 0.012 0.009" euler="10 30 0"/>
          <geom type="box" size="0.005 0.01 0.004" pos="-0.02 0.01 0" euler="0 30 45"/>)"},
      {R"(<geom type="box" size="0.004 0.004 0.01" euler="0 0 30"/><geom type="sphere" size="0.003" pos="0 0.01 0"/>)",
       R"(<geom type="cylinder" size="0.012 0.006" euler="70 0 0"/><geom type="mesh" mesh="wedge" pos="0.01 -0.03 0"/>
          <geom type="plane" size="1 1 1" pos="0 0 -0.03" euler="3 0 0"/>)"},
  };
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const TaskModel task_model = WithGeoms(parts[i].first, parts[i].second, wedge);
    const ContactMap map = BuildContactMap(task_model, Opening::kClosed);
    CheckByStepping(task_model, task_model.target_geoms, map, 0, Eigen::Quaterniond::Identity(), 1500,
                    std::to_string(i).c_str());
    CheckStepLaw(map);
  }
}

TEST(ContactMap, OneLayerPerOrientation) {
  TaskModel task_model = WithGeoms(R"(<geom type="box" size="0.004 0.006 0.01"/>)",
                                   R"(<geom type="box" size="0.02 0.01 0.004" pos="0.005 0 -0.004"/>)");
  task_model.task.axes[2] = {AxisKind::kYaw, 0.2, 2, 3};
  const auto orientations = TargetOrientations(task_model.task);
  ASSERT_EQ(orientations.size(), 3U);
  EXPECT_TRUE(orientations[1].isApprox(Eigen::Quaterniond::Identity()));
  const ContactMap map = BuildContactMap(task_model, Opening::kClosed);
  ASSERT_EQ(map.orientations(), 3);
  for (int layer = 0; layer < 3; ++layer) {
    CheckByStepping(task_model, task_model.target_geoms, map, layer, orientations[static_cast<std::size_t>(layer)], 400,
                    "yaw");
    CheckStepLaw(map, layer);
  }
}

TEST(ContactMap, MirroredTaskHasMirroredMap) {
  const auto build = [](double sign) {
    return BuildContactMap(
        WithGeoms(fmt::format(R"(<geom type="capsule" size="0.004 0.006" euler="0 {} 0" pos="{} 0 0"/>)", sign * 30,
                              sign * 0.0013),
                  fmt::format(R"(<geom type="box" size="0.01 0.006 0.005" pos="{} 0 -0.005"/>
                                 <geom type="cylinder" size="0.004 0.01" pos="{} 0.02 0"/>)",
                              sign * 0.0052, sign * 0.01)),
        Opening::kClosed);
  };
  const ContactMap map = build(1);
  const ContactMap mirror = build(-1);
  ASSERT_NEAR(map.phase().x(), -mirror.phase().x(), 1e-6);
  ASSERT_EQ(map.domain().min.x(), -map.domain().max.x());
  ForEachCell(map.domain(), [&](const Cell& cell) {
    const Cell other(-cell.x(), cell.y(), cell.z());
    ASSERT_EQ(map.Blocked(cell), mirror.Blocked(other)) << cell.transpose();
    for (const Direction d : kDirections) {
      const Direction other_d = AxisOf(d) == 0 ? Opposite(d) : d;
      // Along a grazing line MuJoCo's collider decides within its tolerance.
      ASSERT_NEAR(map.Travel(cell, d), mirror.Travel(other, other_d), 5e-3) << cell.transpose() << " " << ToString(d);
    }
  });
}

class PlugMap : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    plug_ = new TaskModel(LoadTask("plug"));
    closed_ = new ContactMap(BuildContactMap(*plug_, Opening::kClosed, Parallelism(2)));
    open_ = new ContactMap(BuildContactMap(*plug_, Opening::kOpen, Parallelism(2)));
  }
  static void TearDownTestSuite() {
    delete plug_;
    delete closed_;
    delete open_;
  }
  static std::vector<int> AllGeoms() {
    std::vector<int> geoms = plug_->target_geoms;
    geoms.insert(geoms.end(), plug_->lid_geoms.begin(), plug_->lid_geoms.end());
    return geoms;
  }
  static TaskModel* plug_;
  static ContactMap* closed_;
  static ContactMap* open_;
};
TaskModel* PlugMap::plug_ = nullptr;
ContactMap* PlugMap::closed_ = nullptr;
ContactMap* PlugMap::open_ = nullptr;

TEST_F(PlugMap, WallsLieMidCell) {
  // Housing 58 x 50 mm and plug 24 x 16 mm: walls at 41 and 33 mm, top at 0, panel at -30 mm, cells of 2 mm.
  EXPECT_NEAR(closed_->phase().x(), 0, 1e-6);
  EXPECT_NEAR(closed_->phase().y(), 0, 1e-6);
  EXPECT_NEAR(closed_->phase().z(), 0.5, 1e-6);
  EXPECT_NEAR(closed_->margin_cells(), 0.5, 1e-5);
  // The open socket has walls 0.5 mm, a quarter of a cell, beside its axis.
  EXPECT_NEAR(open_->margin_cells(), 0.25, 1e-5);
  EXPECT_NEAR(closed_->Travel({0, 0, 12}, Direction::kMinusZ), 12.5, 1e-3);
  EXPECT_NEAR(closed_->Travel({25, 0, 12}, Direction::kMinusZ), 27.5, 1e-3);
  EXPECT_NEAR(closed_->Travel({25, 0, -3}, Direction::kMinusX), 4.5, 1e-3);
  EXPECT_NEAR(closed_->Travel({0, -25, -3}, Direction::kPlusY), 8.5, 1e-3);
}

TEST_F(PlugMap, MatchesStepping) {
  CheckByStepping(*plug_, AllGeoms(), *closed_, 0, Eigen::Quaterniond::Identity(), 1500, "closed");
  CheckByStepping(*plug_, plug_->target_geoms, *open_, 0, Eigen::Quaterniond::Identity(), 1500, "open");
}

TEST_F(PlugMap, StepLaw) {
  CheckStepLaw(*closed_);
  CheckStepLaw(*open_);
}

TEST_F(PlugMap, MirrorLaw) {
  // Plug and inlet are symmetric in x, and the phase of x is zero.
  for (const ContactMap* map : {closed_, open_}) {
    ForEachCell(map->domain(), [&](const Cell& cell) {
      const Cell mirrored(-cell.x(), cell.y(), cell.z());
      ASSERT_EQ(map->Blocked(cell), map->Blocked(mirrored));
      for (const Direction d : kDirections) {
        const Direction other = AxisOf(d) == 0 ? Opposite(d) : d;
        ASSERT_NEAR(map->Travel(cell, d), map->Travel(mirrored, other), 2e-3) << cell.transpose() << ToString(d);
      }
    });
  }
}

TEST_F(PlugMap, OpenAndClosedDifferAtTheOpeningOnly) {
  const CellBox mouth{{0, 0, -10}, {0, 0, -1}};  // one column of cells, 20 mm deep
  ASSERT_TRUE(open_->domain() == closed_->domain());
  ASSERT_EQ(open_->phase(), closed_->phase());
  ForEachCell(closed_->domain(), [&](const Cell& cell) {
    ASSERT_EQ(closed_->Blocked(cell) && !open_->Blocked(cell), mouth.Contains(cell)) << cell.transpose();
    for (const Direction d : kDirections) {
      const bool above_mouth = d == Direction::kMinusZ && cell.x() == 0 && cell.y() == 0 && cell.z() >= -10;
      if (mouth.Contains(cell) || above_mouth) continue;
      ASSERT_EQ(closed_->Travel(cell, d), open_->Travel(cell, d)) << cell.transpose() << ToString(d);
    }
  });
  EXPECT_NEAR(open_->Travel({0, 0, 5}, Direction::kMinusZ), 15.5, 1e-3);
  EXPECT_NEAR(closed_->Travel({0, 0, 5}, Direction::kMinusZ), 5.5, 1e-3);
}

TEST_F(PlugMap, DomainHoldsEveryDisplacementOfEveryProblem) {
  for (const int n : {2, 3, 14, 15}) {
    const Cell cuboid(n, 17 - n, n);
    const CellBox workspace = WorkspaceCells(plug_->task, cuboid);
    EXPECT_TRUE(closed_->domain().Contains(workspace.min - (cuboid - Cell::Ones())));
    EXPECT_TRUE(closed_->domain().Contains(workspace.max));
  }
}

TEST_F(PlugMap, MujocoAgreesWithTheSweeps) {
  const ObstacleSet set(*plug_, GeomsOf(*plug_, Opening::kClosed), Eigen::Quaterniond::Identity());
  LineSweep sweep(set, 2e-6);
  RandomStream random(5, 0, "lines");
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d point(random.Uniform(-0.08, 0.08), random.Uniform(-0.07, 0.07), random.Uniform(-0.04, 0.01));
    sweep.Sweep(i % 3, point, true);
  }
  EXPECT_LT(sweep.corrections(), 30);
  EXPECT_LT(sweep.largest_correction_m(), 1e-4);
}

// What others cover is left out of a sweep that MuJoCo does not judge: the union is that of all, to the bit.
TEST_F(PlugMap, ASweepIsTheUnionOfAllObstacles) {
  const ObstacleSet set(*plug_, GeomsOf(*plug_, Opening::kOpen), Eigen::Quaterniond::Identity());
  LineSweep sweep(set, 1e-9);
  RandomStream random(6, 0, "lines");
  for (int i = 0; i < 3000; ++i) {
    const int axis = i % 3;
    const Eigen::Vector3d point(random.Uniform(-0.08, 0.08), random.Uniform(-0.07, 0.07), random.Uniform(-0.04, 0.01));
    const std::vector<BlockedStretch>& stretches = sweep.Sweep(axis, point, false);
    std::vector<bool> low_met(stretches.size(), false);
    std::vector<bool> high_met(stretches.size(), false);
    for (const ObstacleSet::Obstacle& obstacle : set.obstacles) {
      const auto cut = obstacle.shape.CutBy(axis, point);
      if (!cut) continue;
      bool held = false;
      for (std::size_t k = 0; k < stretches.size(); ++k) {
        held = held || (stretches[k].low_m <= cut->low_m && cut->high_m <= stretches[k].high_m);
        low_met[k] = low_met[k] || cut->low_m == stretches[k].low_m;
        high_met[k] = high_met[k] || cut->high_m == stretches[k].high_m;
      }
      EXPECT_TRUE(held) << i;
    }
    if (!set.half_spaces.empty()) continue;
    EXPECT_THAT(low_met, testing::Each(true)) << i;
    EXPECT_THAT(high_met, testing::Each(true)) << i;
  }
}

TEST_F(PlugMap, SameAtAnyNumberOfThreads) {
  std::int64_t last = 0;
  std::int64_t all = 0;
  const ContactMap alone = BuildContactMap(*plug_, Opening::kClosed, Parallelism(1), [&](auto done, auto total) {
    EXPECT_GE(done, last);
    last = done;
    all = total;
  });
  EXPECT_EQ(last, all);
  EXPECT_EQ(alone.phase(), closed_->phase());
  const ContactMap::Layer own = alone.CopyOfLayer(0);
  const ContactMap::Layer together = closed_->CopyOfLayer(0);
  EXPECT_EQ(own.blocked, together.blocked);
  for (int d = 0; d < kDirectionCount; ++d) EXPECT_EQ(own.travel[d], together.travel[d]);
}

TEST(ContactMap, StartInCollisionIsAnError) {
  TaskModel task_model = WithGeoms(R"(<geom type="box" size="0.004 0.004 0.01" pos="0 0 0.01"/>)",
                                   R"(<geom type="box" size="0.02 0.02 0.01" pos="0 0 -0.01"/>)");
  task_model.task.start_offset_m = {0, 0, 0.003};
  try {
    BuildContactMap(task_model, Opening::kClosed);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("feeler_start_offset"));
  }
}

TEST(LatticePhase, NoOtherPhaseHasALargerMargin) {
  RandomStream random(6, 0, "walls");
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> walls(1 + random.Index(4));
    for (double& wall : walls) wall = random.Uniform(-30, 30);
    const auto margin = [&](double phase) {
      double smallest = 1;
      for (const double wall : walls) smallest = std::min(smallest, std::abs(wall - phase - std::round(wall - phase)));
      return smallest;
    };
    const LatticePhase chosen = ChoosePhase(walls);
    EXPECT_GT(chosen.phase, -0.5);
    EXPECT_LE(chosen.phase, 0.5);
    EXPECT_NEAR(margin(chosen.phase), chosen.margin, 1e-5);
    for (double phase = -0.5; phase < 0.5; phase += 1e-3) ASSERT_LE(margin(phase), chosen.margin + 1e-5);
  }
}

}  // namespace
}  // namespace feeler::env
