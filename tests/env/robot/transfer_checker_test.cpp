// Transfers of the arm in its scene. Oracle: MuJoCo's own contacts along the timed motion at 2 ms and along the plan at
// 0.002 rad, with no margin. Laws: the plan ends with the tool at the goal; free everywhere; joints within +-pi; the
// same seed gives the same plan; candidate poses of the target are all respected; what cannot be planned is reported.

#include "feeler/env/robot/transfer_checker.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <numbers>
#include <string>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/planner/motion/time_parametrization.h"

namespace feeler::env {
namespace {

using planner::TransferPlan;
using planner::TransferStatus;

const Scene& SceneOfPlug() {
  static const Scene scene = BuildScene(LoadTask("plug"));
  return scene;
}

Pose NominalStartPose(const Scene& scene, const Eigen::Vector3d& shift_m = Eigen::Vector3d::Zero()) {
  return scene.task.world_T_target * Eigen::Translation3d(scene.task.start_offset_m + shift_m);
}

const DataHandle& TestData(const Scene& scene) {
  static const DataHandle data = MakeData(*scene.model);
  return data;
}

int Contacts(const Scene& scene, const JointVector& q, mjData& data) {
  SetJointPositions(scene, q, data);
  mj_kinematics(scene.model.get(), &data);
  mj_collision(scene.model.get(), &data);
  return data.ncon;
}

void ExpectFree(const Scene& scene, const TransferPlan& plan, const TransferChecker& checker) {
  const DataHandle data = MakeData(*scene.model);
  ResetScene(scene, scene.home_q_rad, *data);
  for (std::size_t i = 1; i < plan.way_points.size(); ++i) {
    const Eigen::VectorXd way = plan.way_points[i] - plan.way_points[i - 1];
    const int steps = static_cast<int>(way.cwiseAbs().maxCoeff() / 0.002) + 1;
    for (int k = 0; k <= steps; ++k) {
      const JointVector q = plan.way_points[i - 1] + static_cast<double>(k) / steps * way;
      ASSERT_EQ(Contacts(scene, q, *data), 0);
      ASSERT_LE(q.cwiseAbs().maxCoeff(), std::numbers::pi);
    }
  }
  planner::MotionLimits limits{0.5 * scene.velocity_limit_rad_s, JointVector::Constant(5.0)};
  planner::TimeParametrizationOptions options;
  options.reach_m = checker.reach_m();
  options.corner_deviation_m = 0.5 * checker.clearance_m();
  const planner::JointTrajectory trajectory = planner::Parametrize(plan.way_points, limits, options);
  for (double t = 0.0; t < trajectory.duration_s(); t += 0.002) {
    ASSERT_EQ(Contacts(scene, trajectory.Sample(t).q_rad, *data), 0);
  }
}

TEST(Transfer, FromHomeToTheStartPose) {
  const Scene& scene = SceneOfPlug();
  TransferChecker checker(scene);
  const auto begin = std::chrono::steady_clock::now();
  const TransferPlan plan = PlanTransfer(checker, scene, scene.home_q_rad, NominalStartPose(scene));
  const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - begin;
  RecordProperty("planning_ms", std::to_string(elapsed.count()));
  RecordProperty("checks", plan.checks);
  ASSERT_TRUE(plan.planned()) << plan.reason;
  EXPECT_EQ(JointVector(plan.way_points.front()), scene.home_q_rad);
  const Pose end = ToolForwardKinematics(scene, plan.way_points.back());
  EXPECT_LT((end.translation() - NominalStartPose(scene).translation()).norm(), 1e-9);
  ExpectFree(scene, plan, checker);
}

// Between random free poses over the table, among which the panel and the arm itself stand in the way.
TEST(Transfer, AnywhereOverTheTable) {
  const Scene& scene = SceneOfPlug();
  TransferChecker checker(scene);
  RandomStream random(1, 0, "transfer test");
  JointVector start = scene.home_q_rad;
  int planned = 0;
  int searched = 0;
  double slowest_ms = 0.0;
  double total_ms = 0.0;
  for (int trial = 0; trial < 12; ++trial) {
    const Pose goal =
        MakePose(Eigen::Vector3d(random.Uniform(0.45, 0.85), random.Uniform(-0.4, 0.4), random.Uniform(0.08, 0.45)),
                 random.Uniform(-3.0, 3.0));
    TransferSettings settings;
    settings.seed = static_cast<std::uint64_t>(trial);
    const auto begin = std::chrono::steady_clock::now();
    const TransferPlan plan = PlanTransfer(checker, scene, start, goal, settings);
    const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - begin;
    total_ms += elapsed.count();
    slowest_ms = std::max(slowest_ms, elapsed.count());
    if (!plan.planned()) {
      EXPECT_NE(plan.status, TransferStatus::kNotFound) << "every free goal over the table can be reached";
      continue;
    }
    ++planned;
    searched += plan.way_points.size() > 2 ? 1 : 0;
    ExpectFree(scene, plan, checker);
    const TransferPlan again = PlanTransfer(checker, scene, start, goal, settings);
    EXPECT_EQ(plan.way_points, again.way_points);
    start = plan.way_points.back();
  }
  RecordProperty("planned", planned);
  RecordProperty("searched", searched);
  RecordProperty("mean_ms", std::to_string(total_ms / 12));
  RecordProperty("slowest_ms", std::to_string(slowest_ms));
  EXPECT_GT(planned, 6);
}

// The panel of the target stood upright between start and goal: the straight motion is barred and RRT-Connect must find
// the way around it.
TEST(Transfer, GoesAroundAWall) {
  const Scene& scene = SceneOfPlug();
  TransferChecker checker(scene);
  const Pose wall = MakePose(Eigen::Vector3d(0.7, 0.0, 0.2),
                             Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX())));
  checker.SetTargetPoses({wall});
  const Eigen::Quaterniond down = Eigen::Quaterniond::Identity();
  // The free branch nearest to a posture.
  const auto branch_near = [&](const Eigen::Vector3d& position, const JointVector& posture) {
    JointVector best = JointVector::Constant(1e9);
    for (const JointVector& q : ToolInverseKinematics(scene, MakePose(position, down))) {
      if (checker.Free(q) && (q - posture).norm() < (best - posture).norm()) best = q;
    }
    return best;
  };
  const JointVector start = branch_near(Eigen::Vector3d(0.65, -0.25, 0.12), scene.home_q_rad);
  const JointVector goal = branch_near(Eigen::Vector3d(0.65, 0.25, 0.12), start);
  ASSERT_LT((goal - start).norm(), 3.0);
  const auto plan_once = [&] {
    planner::TransferOptions options;
    options.reach_m = checker.reach_m();
    options.check_spacing_m = checker.clearance_m();
    const planner::JointBounds bounds{JointVector::Constant(-std::numbers::pi),
                                      JointVector::Constant(std::numbers::pi)};
    const planner::TransferPlanner planner(
        bounds, [&](const Eigen::VectorXd& q) { return checker.Free(q); }, options);
    return planner.Plan(start, {goal});
  };
  const auto begin = std::chrono::steady_clock::now();
  const TransferPlan plan = plan_once();
  const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - begin;
  RecordProperty("rrt_planning_ms", std::to_string(elapsed.count()));
  RecordProperty("rrt_checks", plan.checks);
  ASSERT_TRUE(plan.planned()) << plan.reason;
  EXPECT_GT(plan.way_points.size(), 2U);
  EXPECT_EQ(plan.way_points, plan_once().way_points);
  for (std::size_t i = 1; i < plan.way_points.size(); ++i) {
    for (int k = 0; k <= 1000; ++k) {
      const JointVector q = plan.way_points[i - 1] + k / 1000.0 * (plan.way_points[i] - plan.way_points[i - 1]);
      const DataHandle& data = TestData(scene);
      SetTargetPose(scene, wall, *data);
      ASSERT_EQ(Contacts(scene, q, *data), 0);
    }
  }
}

TEST(Transfer, RespectsEveryPlaceTheTargetMayBe) {
  const Scene& scene = SceneOfPlug();
  TransferChecker checker(scene);
  const Pose low = NominalStartPose(scene, Eigen::Vector3d(0.0, 0.0, -0.016));  // 8 mm above the nominal rim
  const std::vector<JointVector> branches = ToolInverseKinematics(scene, low);
  ASSERT_FALSE(branches.empty());
  const auto any_free = [&] {
    for (const JointVector& q : branches) {
      if (checker.Free(q)) return true;
    }
    return false;
  };
  EXPECT_TRUE(any_free());
  checker.SetTargetPoses(TargetCandidates(scene.task, scene.task.world_T_target, {15, 15, 15}));
  EXPECT_FALSE(any_free()) << "the target may stand 15 mm higher";
  // The start pose of a task is chosen so that it is free wherever the target may be.
  const TransferPlan plan = PlanTransfer(checker, scene, scene.home_q_rad, NominalStartPose(scene));
  EXPECT_TRUE(plan.planned()) << plan.reason;
}

TEST(Transfer, ReportsWhatCannotBe) {
  const Scene& scene = SceneOfPlug();
  TransferChecker checker(scene);
  const Pose far = MakePose(Eigen::Vector3d(3, 0, 0.3), Eigen::Quaterniond::Identity());
  EXPECT_EQ(PlanTransfer(checker, scene, scene.home_q_rad, far).status, TransferStatus::kNoGoal);
  const Pose inside = NominalStartPose(scene, Eigen::Vector3d(0.02, 0.02, -0.05));
  const TransferPlan blocked = PlanTransfer(checker, scene, scene.home_q_rad, inside);
  EXPECT_EQ(blocked.status, TransferStatus::kNoGoal);
  EXPECT_FALSE(blocked.reason.empty());
  JointVector start = scene.home_q_rad;
  start[1] = 0.3;  // the arm points into the table
  const TransferPlan stuck = PlanTransfer(checker, scene, start, NominalStartPose(scene));
  EXPECT_EQ(stuck.status, TransferStatus::kStartInvalid);
  EXPECT_NE(checker.Collision(start), "");
  EXPECT_EQ(checker.Collision(scene.home_q_rad), "");
  EXPECT_THROW(TransferChecker(scene, 0.1), InputError);
}

/// Free, and cut off by the table above it.
Pose BelowTheTable() { return MakePose(Eigen::Vector3d(0.65, 0.0, -0.4), Eigen::Quaterniond::Identity()); }

TEST(Transfer, ASearchThatWouldGoOnIsGivenUpOrStopped) {
  RobotOptions options;
  options.transfer.most_checks = 3000;
  SimulatedRobot robot(std::make_shared<const Scene>(SceneOfPlug()), options);
  const MotionResult given_up = robot.Transfer(BelowTheTable());
  EXPECT_EQ(given_up.reason, StopReason::kUnplanned);
  EXPECT_NE(given_up.detail.find("given up"), std::string::npos) << given_up.detail;
  int asked = 0;
  robot.SetInterruption([&] { return std::string(++asked > 5 ? "stopped by order" : ""); });
  const MotionResult stopped = robot.Transfer(BelowTheTable());
  EXPECT_EQ(stopped.reason, StopReason::kAborted);
  EXPECT_EQ(stopped.detail, "stopped by order");
  EXPECT_EQ(asked, 6) << "asked while it plans, and no more then";
  EXPECT_EQ(robot.Time(), 0.0) << "nothing moved";
  robot.SetInterruption({});
  EXPECT_EQ(robot.Transfer(NominalStartPose(SceneOfPlug())).reason, StopReason::kReached);
}

// No point of the robot moves farther than the sweep says: the law the spacing of checks rests on.
TEST(Transfer, SweepBoundsTheWayOfEveryPoint) {
  const Scene& scene = SceneOfPlug();
  const TransferChecker checker(scene);
  const mjModel& model = *scene.model;
  const DataHandle data = MakeData(model);
  RandomStream random(3, 0, "sweep");
  for (int sample = 0; sample < 50; ++sample) {
    JointVector q;
    JointVector step;
    for (double& angle : q) angle = random.Uniform(-3.0, 3.0);
    for (double& angle : step) angle = random.Uniform(-0.2, 0.2);
    const double sweep = checker.reach_m().dot(step.cwiseAbs());
    std::vector<Eigen::Vector3d> before;
    for (const JointVector& at : {q, JointVector(q + step)}) {
      SetJointPositions(scene, at, *data);
      mj_kinematics(&model, data.get());
      std::size_t index = 0;
      for (const auto* list : {&scene.robot_geoms, &scene.tool_geoms}) {
        for (const int geom : *list) {
          for (int corner = 0; corner < 8; ++corner) {
            // Points on the bounding sphere of the geom.
            const Eigen::Vector3d local =
                Eigen::Vector3d((corner & 1) ? 1 : -1, (corner & 2) ? 1 : -1, (corner & 4) ? 1 : -1).normalized() *
                model.geom_rbound[geom];
            const Eigen::Vector3d point =
                Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->geom_xmat + 9 * geom) * local +
                Eigen::Map<const Eigen::Vector3d>(data->geom_xpos + 3 * geom);
            if (before.size() <= index) {
              before.push_back(point);
            } else {
              EXPECT_LE((point - before[index]).norm(), sweep);
            }
            ++index;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace feeler::env
