// Transfers in the scenes with obstacles. Oracle: MuJoCo's own contacts without any margin, at way points, every 0.002
// rad of the straight pieces between them, and every 2 ms of the timed motion. Laws: every goal at which the robot can
// stand is reached by a plan; it is free everywhere; joints stay within their velocities and accelerations; the same
// seed gives the same plan; in physics nothing is touched; a goal that cannot be planned leaves the robot where it is
// and says why.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "feeler/core/random.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/env/robot/transfer_checker.h"
#include "feeler/planner/motion/time_parametrization.h"

namespace feeler::env {
namespace {

using planner::TransferPlan;
using planner::TransferStatus;

class TransferScene : public testing::TestWithParam<const char*> {
 protected:
  TransferScene()
      : scene_(std::make_shared<const Scene>(
            BuildScene(LoadTask((ModelsFolder() / "scenes" / (std::string(GetParam()) + ".xml")).string())))),
        data_(MakeData(*scene_->model)) {
    ResetScene(*scene_, scene_->home_q_rad, *data_);
  }

  bool Touches(const JointVector& q) {
    SetJointPositions(*scene_, q, *data_);
    mj_kinematics(scene_->model.get(), data_.get());
    mj_collision(scene_->model.get(), data_.get());
    return data_->ncon > 0;
  }

  void ExpectFreeAndWithinLimits(const TransferPlan& plan) {
    for (std::size_t i = 1; i < plan.way_points.size(); ++i) {
      const Eigen::VectorXd way = plan.way_points[i] - plan.way_points[i - 1];
      const int steps = static_cast<int>(way.cwiseAbs().maxCoeff() / 0.002) + 1;
      for (int k = 0; k <= steps; ++k) {
        const JointVector q = plan.way_points[i - 1] + static_cast<double>(k) / steps * way;
        ASSERT_FALSE(Touches(q)) << "piece " << i << ", step " << k;
        ASSERT_LE(q.cwiseAbs().maxCoeff(), 2.0 * std::numbers::pi);
      }
    }
    const planner::MotionLimits limits{0.5 * scene_->velocity_limit_rad_s, JointVector::Constant(5.0)};
    planner::TimeParametrizationOptions timing;
    timing.reach_m = JointVector::Constant(1.5);
    const planner::JointTrajectory motion = planner::Parametrize(plan.way_points, limits, timing);
    for (double t = 0.0; t < motion.duration_s(); t += 0.002) {
      const planner::JointState state = motion.Sample(t);
      ASSERT_FALSE(Touches(state.q_rad)) << t;
      ASSERT_LE((state.qd_rad_s.cwiseAbs() - limits.velocity_rad_s).maxCoeff(), 1e-3);
      ASSERT_LE((state.qdd_rad_s2.cwiseAbs() - limits.acceleration_rad_s2).maxCoeff(), 1e-2);
    }
  }

  std::shared_ptr<const Scene> scene_;
  DataHandle data_;
};

Pose RandomPose(RandomStream& random) {
  return MakePose(Eigen::Vector3d(random.Uniform(0.4, 0.85), random.Uniform(-0.45, 0.45), random.Uniform(0.05, 0.5)),
                  random.Uniform(-3.0, 3.0));
}

TEST_P(TransferScene, EveryPlanIsFreeAndWithinLimits) {
  TransferChecker checker(*scene_);
  RandomStream random(1, 0, "transfer scenes");
  JointVector start = scene_->home_q_rad;
  int planned = 0;
  for (int trial = 0; trial < 4; ++trial) {
    TransferSettings settings;
    settings.seed = static_cast<std::uint64_t>(trial);
    const Pose goal = RandomPose(random);
    const TransferPlan plan = PlanTransfer(checker, *scene_, start, goal, settings);
    if (plan.status == TransferStatus::kNoGoal) {
      EXPECT_FALSE(plan.reason.empty());
      continue;
    }
    ASSERT_TRUE(plan.planned()) << "trial " << trial << ": " << plan.reason;
    ++planned;
    ExpectFreeAndWithinLimits(plan);
    if (plan.checks < 20000) {
      EXPECT_EQ(PlanTransfer(checker, *scene_, start, goal, settings).way_points, plan.way_points);
    }
    const Pose end = ToolForwardKinematics(*scene_, plan.way_points.back());
    EXPECT_LT((end.translation() - goal.translation()).norm(), 1e-9);
    start = plan.way_points.back();
  }
  EXPECT_GE(planned, 2);
}

TEST_P(TransferScene, NothingIsTouchedInPhysics) {
  SimulatedRobot robot(scene_);
  bool touched = false;
  robot.SetObserver([&](const World& world) { touched = touched || world.data().ncon > 0; },
                    scene_->model->opt.timestep);
  RandomStream random(2, 0, "transfer scenes");
  int reached = 0;
  for (int trial = 0; trial < 6 && reached < 2; ++trial) {
    const Pose goal = RandomPose(random);
    const Pose before = robot.ToolPose();
    const MotionResult result = robot.Transfer(goal);
    if (result.reason == StopReason::kUnplanned) {
      EXPECT_FALSE(result.detail.empty());
      EXPECT_EQ(robot.ToolPose().matrix(), before.matrix()) << "it did not move";
      continue;
    }
    ASSERT_EQ(result.reason, StopReason::kReached) << result.detail;
    EXPECT_LT((result.world_T_tool.translation() - goal.translation()).norm(), 5e-4);
    ++reached;
  }
  EXPECT_EQ(reached, 2);
  EXPECT_FALSE(touched);
}

TEST_P(TransferScene, WhatCannotBePlannedIsReportedNotForced) {
  SimulatedRobot robot(scene_);
  const Pose before = robot.ToolPose();
  for (const Pose& goal :
       {MakePose(Eigen::Vector3d(0.65, 0.0, 0.05), 0.0), MakePose(Eigen::Vector3d(2.0, 0.0, 0.3), 0.0)}) {
    const MotionResult result = robot.Transfer(goal);
    EXPECT_EQ(result.reason, StopReason::kUnplanned);
    EXPECT_FALSE(result.detail.empty());
    EXPECT_EQ(robot.ToolPose().matrix(), before.matrix());
    EXPECT_EQ(robot.Time(), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, TransferScene, testing::Values("table", "fixtures", "pillar", "wall"),
                         [](const auto& scene) { return std::string(scene.param); });

}  // namespace
}  // namespace feeler::env
