// Laws of the fallback ladder, each rung forced by a fault of the world that the bare policy cannot mend:
// - a truth outside the hypotheses is found and inserted, a turned target is measured and inserted;
// - an opening turned or displaced against its housing is found by sweep and spiral;
// - false readings end in a new attempt, not in a wrong insertion;
// - where there is no opening the ladder ends, with the reason; switched off it is never used;
// - what was used stands in the record, and the record is the same again.
// The yaw fit is compared with the yaw that the world was built with.
#include "feeler/execution/recovery/fallback_ladder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "feeler/execution/contact/wall_touch.h"
#include "feeler/execution/executor.h"
#include "feeler/execution/lattice/yaw_fit.h"
#include "feeler/execution/recovery/online_planner.h"
#include "feeler/planner/family/problem_family.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

const planner::Problem& FiveCubed() {
  static const planner::Problem kProblem = planner::MakeCuboidProblem(HousingTask(), HousingMap(), {5, 5, 5});
  return kProblem;
}

std::shared_ptr<OnlinePlanner> SharedPlanner() {
  static const auto kPlanner = std::make_shared<OnlinePlanner>();
  return kPlanner;
}

struct Case {
  Pose truth = Pose::Identity();
  RobotFaults faults;
  bool ladder = true;
};

struct Result {
  ExecutionRecord record;
  bool inserted = false;
};

Result RunCase(const Case& c, std::uint64_t number = 0, policies::Policy* given = nullptr) {
  const Task task = HousingTask();
  KinematicRobot robot(HousingOverPanel(), task, c.truth, LatticeStartPose(task, FiveCubed(), Pose::Identity()),
                       c.faults, RandomStream(7, number, "robot"));
  const auto policy = SharedPlanner()->PolicyFor(FiveCubed());
  ExecutorOptions options;
  options.ladder = c.ladder;
  options.online_planner = SharedPlanner();
  Result result;
  result.record = Execute(task, FiveCubed(), Pose::Identity(), given != nullptr ? *given : *policy, robot, options);
  result.inserted = robot.Inserted();
  return result;
}

bool Used(const ExecutionRecord& record, const char* name) {
  return std::any_of(record.ladder.begin(), record.ladder.end(),
                     [&](const LadderRecord& used) { return used.rung == name; });
}

std::string Log(const ExecutionRecord& record) {
  std::string text = record.reason;
  for (const LadderRecord& used : record.ladder) text += "\n  " + used.rung + ": " + used.reason;
  return text;
}

/// Along one axis, a little or far outside the box of +-5 mm.
std::vector<Pose> TruthsOutside() {
  std::vector<Pose> truths;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      for (const double beyond : {0.0009, 0.0039}) {
        Eigen::Vector3d position(0.0011, -0.0023, 0.0007);
        position[axis] = side * (0.005 + beyond);
        truths.push_back(MakePose(position));
      }
    }
  }
  return truths;
}

TEST(FallbackLadder, TruthOutsideTheHypothesesIsFoundAndInserted) {
  int lost_without = 0;
  int resolved = 0;
  for (const Pose& truth : TruthsOutside()) {
    const Result with = RunCase({truth, {}, true});
    EXPECT_TRUE(with.record.believed_inserted && with.inserted) << truth.translation().transpose() << "\n"
                                                                << Log(with.record);
    ASSERT_TRUE(with.record.world_T_estimate);
    const Eigen::Vector3d error = with.record.world_T_estimate->translation() - truth.translation();
    // A truth just outside may be inserted by what the chamfer forgives, without being looked for.
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 1.5 * HousingTask().tolerance.lateral_m) << Log(with.record);
    resolved += Used(with.record, rung::kResolve);
    const Result without = RunCase({truth, {}, false});
    lost_without += !without.inserted;
    EXPECT_TRUE(without.record.ladder.empty());
    // The ladder is used exactly where the bare policy fails.
    EXPECT_EQ(with.record.ladder.empty(), without.inserted) << Log(with.record);
  }
  EXPECT_GT(lost_without, 4);
  EXPECT_GT(resolved, 0);
}

TEST(FallbackLadder, TurnedTargetIsMeasuredAndInserted) {
  for (const double degrees : {-3.2, -2.7, 2.7, 3.2}) {
    const Pose truth = MakePose({0.0013, -0.0021, 0.0009}, degrees * kDegree);
    EXPECT_FALSE(RunCase({truth, {}, false}).inserted);
    const Result with = RunCase({truth, {}, true});
    EXPECT_TRUE(with.record.believed_inserted && with.inserted) << degrees << "\n" << Log(with.record);
    EXPECT_TRUE(Used(with.record, rung::kYawFit)) << Log(with.record);
    const Eigen::Matrix3d turn = with.record.world_T_estimate->linear();
    EXPECT_NEAR(std::atan2(turn(1, 0), turn(0, 0)), degrees * kDegree, 0.4 * kDegree);
  }
}

// A turned target is felt as one: the tool is not pushed at a place that its touches do not agree on.
TEST(FallbackLadder, TouchesThatAgreeOnNoPlaceMeasureTheTurnFirst) {
  int first = 0;
  for (const double degrees : {-5.0, -4.4, -3.7, 3.7, 4.4, 5.0}) {
    for (const double x_m : {-0.0043, 0.0013, 0.0037}) {
      const Result result = RunCase({MakePose({x_m, -0.0021, 0.0009}, degrees * kDegree), {}, true});
      EXPECT_TRUE(result.record.believed_inserted && result.inserted) << degrees << "\n" << Log(result.record);
      if (result.record.ladder.empty() || result.record.ladder.front().rung != rung::kYawFit) continue;
      if (!result.record.ladder.front().reason.starts_with("touches that agree on no place")) continue;
      ++first;
      const auto kind_at = [&](const char* kind) {
        const auto& moves = result.record.moves;
        return std::ranges::find(moves, kind, &MoveRecord::kind) - moves.begin();
      };
      EXPECT_LT(kind_at("yaw"), kind_at("insert")) << degrees << "\n" << Log(result.record);
    }
  }
  EXPECT_GT(first, 0);
}

TEST(FallbackLadder, OpeningTurnedAgainstItsHousingIsFoundBySweep) {
  Case c;
  c.truth = MakePose({0.0013, -0.0021, 0.0009});
  for (const double degrees : {-3.0, 3.0, 5.0}) {
    c.faults.opening_yaw_rad = degrees * kDegree;
    const Result result = RunCase(c);
    EXPECT_TRUE(result.record.believed_inserted && result.inserted) << Log(result.record);
    EXPECT_TRUE(Used(result.record, rung::kYawSweep)) << Log(result.record);
  }
}

TEST(FallbackLadder, OpeningDisplacedInItsHousingIsFoundBySpiral) {
  Case c;
  c.truth = MakePose({0.0013, -0.0021, 0.0009});
  for (const double offset_m : {-0.004, -0.0025, 0.0025, 0.004}) {
    c.faults.opening_offset_x_m = offset_m;
    const Result result = RunCase(c);
    EXPECT_TRUE(result.record.believed_inserted && result.inserted) << offset_m << " " << Log(result.record);
    EXPECT_TRUE(Used(result.record, rung::kSpiral)) << Log(result.record);
    const Eigen::Vector3d opening = c.truth * Eigen::Vector3d(offset_m, 0.0, 0.0);
    const Eigen::Vector3d error = result.record.world_T_estimate->translation() - opening;
    EXPECT_LT(error.head<2>().cwiseAbs().maxCoeff(), 0.001);
  }
}

TEST(FallbackLadder, FalseReadingsDoNotEndInAWrongBelief) {
  for (int phantoms = 1; phantoms <= 6; ++phantoms) {
    Case c;
    c.truth = MakePose({0.0013, -0.0021, 0.0009});
    c.faults.phantom_contacts = phantoms;
    const Result result = RunCase(c, static_cast<std::uint64_t>(phantoms));
    EXPECT_EQ(result.record.believed_inserted, result.inserted) << phantoms << " " << Log(result.record);
    EXPECT_FALSE(result.record.reason.empty());
    if (phantoms <= 3) {
      EXPECT_TRUE(result.inserted) << phantoms << " " << Log(result.record);
    }
  }
}

class HelplessPolicy : public policies::Policy {
 public:
  std::string_view name() const override { return "helpless"; }
  void Begin(const planner::Problem&) override {}
  policies::Decision Next(const policies::Belief&) override { return policies::GiveUp{"no idea"}; }
  bool Observe(const Outcome&) override { return false; }
};

// Nothing was felt, so there is nothing to fit.
TEST(FallbackLadder, PolicyThatGivesUpAtOnceIsReplacedByAPlanForTheWholeCuboid) {
  HelplessPolicy policy;
  Case c;
  c.truth = MakePose({0.0013, -0.0021, 0.0009});
  const Result result = RunCase(c, 0, &policy);
  EXPECT_TRUE(result.record.believed_inserted && result.inserted) << Log(result.record);
  ASSERT_EQ(result.record.ladder.size(), 1u) << Log(result.record);
  EXPECT_EQ(result.record.ladder.front().rung, rung::kWholeCuboid);
  EXPECT_EQ(result.record.ladder.front().reason, "policy gave up: no idea");
}

TEST(FallbackLadder, EndsWithTheReasonWhereThereIsNoOpening) {
  Case c;
  c.truth = MakePose({0.0013, -0.0021, 0.0009});
  c.faults.opening_offset_x_m = 0.030;
  const Result result = RunCase(c);
  EXPECT_FALSE(result.record.believed_inserted);
  EXPECT_FALSE(result.inserted);
  ASSERT_FALSE(result.record.ladder.empty());
  EXPECT_TRUE(result.record.ladder.back().rung == rung::kGiveUp || result.record.reason.starts_with("limit:"))
      << Log(result.record);
  EXPECT_LE(result.record.sim_time_s, ExecutorOptions{}.time_limit_s + 15.0);
}

TEST(FallbackLadder, SameAnswersSameRecord) {
  Case c;
  c.truth = MakePose({0.0089, -0.0021, 0.0009});
  const Result a = RunCase(c);
  const Result b = RunCase(c);
  EXPECT_EQ(Log(a.record), Log(b.record));
  EXPECT_EQ(a.record.sim_time_s, b.record.sim_time_s);
  EXPECT_EQ(a.record.path_length_m, b.record.path_length_m);
  EXPECT_FALSE(a.record.ladder.empty());
}

TEST(YawFit, EqualsTheYawOfTheWorld) {
  const Task task = HousingTask();
  for (const double degrees : {-5.0, -3.0, -1.0, 0.0, 0.5, 2.0, 4.5, 5.0}) {
    const Pose truth = MakePose({0.0004, -0.0003, 0.0}, degrees * kDegree);
    const LatticeFrame frame{Pose::Identity(), Eigen::Vector3d::Zero(), task.cell_m};
    KinematicRobot robot(HousingOverPanel(), task, truth, MakePose({0.0, 0.0, 0.02}), {}, RandomStream(3, 1, "robot"));
    ExecutionRecord record;
    const ExecutorOptions options;
    Mover mover(robot, frame, Direction::kMinusZ, options, record, 0.0);
    std::vector<Touch> evidence;
    const auto fit = MeasureYaw(task, *HousingMap(), Eigen::Vector3d::Zero(), 0, mover, evidence);
    ASSERT_TRUE(fit) << degrees;
    EXPECT_NEAR(fit->yaw_rad, degrees * kDegree, 0.15 * kDegree);
    EXPECT_EQ(evidence.size(), 2u);
  }
}

struct Centring {
  std::optional<Eigen::Vector3d> centre;
  int touches = 0;
};

/// Recenter from above the mouth of a target that stands `off` (cells) from where it is believed.
Centring Centre(Sides sides, double slack, const Eigen::Vector3d& off) {
  const Task task = HousingTask();
  const LatticeFrame frame{Pose::Identity(), Eigen::Vector3d::Zero(), task.cell_m};
  const Pose truth = MakePose(off * task.cell_m);
  RobotFaults faults;
  faults.tracking_m = 0.0;
  KinematicRobot robot(HousingOverPanel(), task, truth, MakePose({0.0, 0.0, 0.02}), faults,
                       RandomStream(3, 1, "robot"));
  ExecutionRecord record;
  const ExecutorOptions options;
  Mover mover(robot, frame, Direction::kMinusZ, options, record, 0.0);
  Centring found;
  found.centre = Recenter(task, *HousingMap(), Eigen::Vector3d::Zero(), 0, sides, slack, mover);
  for (const MoveRecord& move : record.moves) found.touches += move.kind == "confirm" ? 1 : 0;
  return found;
}

// One touch an axis is off by what a touch is read deeper by, two touches cancel it.
TEST(Recenter, FindsTheMiddleFromOneSideOrFromBoth) {
  for (const Eigen::Vector3d& off : {Eigen::Vector3d(0.4, -0.7, 0.0), Eigen::Vector3d(-0.9, 0.2, 0.0)}) {
    const Centring nearest = Centre(Sides::kNearest, 1.25, off);
    ASSERT_TRUE(nearest.centre);
    EXPECT_EQ(nearest.touches, 2);
    EXPECT_LT((*nearest.centre - off).cwiseAbs().maxCoeff(), 0.25);
    const Centring both = Centre(Sides::kBoth, 1.25, off);
    ASSERT_TRUE(both.centre);
    EXPECT_EQ(both.touches, 4);
    EXPECT_LT((*both.centre - off).cwiseAbs().maxCoeff(), 0.12);
  }
}

TEST(Recenter, LooksTwiceAsFarAroundForAWallThatIsNotThere) {
  // To either side of the slack, whichever wall of an axis is the nearest.
  for (const double off : {-2.2, 2.2}) {
    const Centring found = Centre(Sides::kNearest, 1.25, {off, off, 0.0});
    ASSERT_TRUE(found.centre) << off;
    EXPECT_NEAR(found.centre->x(), off, 0.25);
    EXPECT_NEAR(found.centre->y(), off, 0.25);
  }
  EXPECT_FALSE(Centre(Sides::kNearest, 1.25, {6.0, 0.0, 0.0}).centre);
}

}  // namespace
}  // namespace feeler::execution
