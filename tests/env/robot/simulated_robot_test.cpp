// Laws of the simulated robot. A transfer or a straight motion ends at its goal; what cannot be reached is unplanned
// and the robot has not moved; an unexpected contact stops it. The sensor reads what physics says: the contact wrench
// on gripper and tool equals the inverse dynamics at the wrist. Bad arguments are refused and change nothing. Same
// calls, same bits: again, in a used robot, and on other threads.

#include "feeler/env/robot/simulated_robot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "feeler/core/error.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

class SimulatedRobotTest : public ::testing::Test {
 protected:
  std::shared_ptr<const Scene> scene_ = PlugScene();
  SimulatedRobot robot_{scene_};
  Pose target_ = scene_->task.world_T_target;

  void Place(const Eigen::Vector3d& displacement_m, const NoiseOptions& noise = {}) {
    robot_.Reset(At(*scene_, ToolAt(*scene_, displacement_m)), target_, noise, RandomStream(1, 0, "sensor"));
  }
  double Distance(const Pose& pose) const { return (robot_.ToolPose().translation() - pose.translation()).norm(); }
  double Turn(const Pose& pose) const {
    return Eigen::AngleAxisd(robot_.ToolPose().linear().transpose() * pose.linear()).angle();
  }
};

TEST_F(SimulatedRobotTest, TransferFromHomeEndsAtTheGoal) {
  for (const char* noise : {"ideal", "friction"}) {
    robot_.Reset(scene_->home_q_rad, target_, NoisePreset(noise), RandomStream(1, 0, "sensor"));
    const Pose goal = ToolAt(*scene_, {0.01, -0.02, 0.024});
    const MotionResult result = robot_.Transfer(goal);
    EXPECT_EQ(result.reason, StopReason::kReached) << result.detail;
    EXPECT_LT(Distance(goal), 1e-4);
    EXPECT_LT(Turn(goal), 1e-3);
    EXPECT_EQ(robot_.statistics().peak_force_n, 0.0);
    EXPECT_GT(result.travelled_m, 0.01);
  }
}

TEST_F(SimulatedRobotTest, LinearMoveTurnsAndTravels) {
  Place({0, 0, 0.06});
  const Pose goal = ToolAt(*scene_, {0.02, -0.01, 0.05}) * MakePose({0, 0, 0}, 0.3);
  const MotionResult result = robot_.LinearMove(goal, 0.25, 5.0);
  EXPECT_EQ(result.reason, StopReason::kReached);
  EXPECT_LT(Distance(goal), 1e-4);
  EXPECT_LT(Turn(goal), 1e-4);
  EXPECT_NEAR(result.travelled_m, std::sqrt(0.0006), 1e-4);
}

TEST_F(SimulatedRobotTest, WhatIsOutOfReachIsUnplannedAndDoesNotMove) {
  Place({0, 0, 0.06});
  const JointVector before = robot_.q_rad();
  EXPECT_EQ(robot_.LinearMove(MakePose({1.9, 0, 0.2}), 0.25, 5.0).reason, StopReason::kUnplanned);
  EXPECT_EQ(robot_.Transfer(MakePose({1.9, 0, 0.2})).reason, StopReason::kUnplanned);
  EXPECT_EQ(robot_.Transfer(ToolAt(*scene_, {0, 0, -0.1})).reason, StopReason::kUnplanned);  // inside the table
  EXPECT_EQ(robot_.q_rad(), before);
  EXPECT_EQ(robot_.Time(), 0.0);
}

TEST_F(SimulatedRobotTest, TransferIntoAnUnknownObstacleIsAProtectiveStop) {
  // The robot believes the target elsewhere: it plans through where it really stands.
  Place({0.1, 0, -0.01});
  Pose elsewhere = target_;
  elsewhere.translation().x() += 0.6;
  robot_.SetTargetCandidates({elsewhere});
  const MotionResult result = robot_.Transfer(ToolAt(*scene_, {-0.1, 0, -0.01}));
  EXPECT_EQ(result.reason, StopReason::kAborted) << result.detail;
  EXPECT_TRUE(result.contact);
  EXPECT_NEAR((target_.inverse() * robot_.ToolPose()).translation().x(), kWallX_m, 0.01);
}

TEST_F(SimulatedRobotTest, ACompliantMotionGoesOnAsThePressedToolIs) {
  Place({0.02, 0.02, 0.004});
  CompliantMotion press;
  press.world_T_tool = {ToolAt(*scene_, {0.02, 0.02, -0.003})};
  press.stiffness_n_m.z() = 4000.0;
  ASSERT_EQ(robot_.Compliant(press).reason, StopReason::kContact);
  const double pressed_n = robot_.ContactWrench().force_n.z();
  ASSERT_GT(pressed_n, 8.0);
  const RobotState state = robot_.Save();
  const Pose aside = ToolAt(*scene_, {0.021, 0.02, -0.003});
  const auto least_force_n = [&](const std::vector<Pose>& way_points) {
    robot_.Restore(state);
    double least_n = pressed_n;
    robot_.SetObserver([&](const World&) { least_n = std::min(least_n, robot_.sensor().filtered().force_n.z()); }, 0.0);
    CompliantMotion motion = press;
    motion.world_T_tool = way_points;
    EXPECT_EQ(robot_.Compliant(motion).reason, StopReason::kContact);
    robot_.SetObserver({}, 0.0);
    return least_n;
  };
  EXPECT_GT(least_force_n({press.world_T_tool.back(), aside}), 0.5 * pressed_n);
  EXPECT_LT(least_force_n({aside}), 0.5 * pressed_n) << "from where the tool stands it is pressed anew";
}

TEST_F(SimulatedRobotTest, SensorReadsWhatInverseDynamicsDemands) {
  // Pressed on the rim off-centre, at rest: the joint torques beyond gravity are the contact wrench's.
  Place({0.02, 0.02, 0.004});
  CompliantMotion press;
  press.world_T_tool = {ToolAt(*scene_, {0.02, 0.02, -0.005})};
  robot_.Compliant(press);
  CompliantMotion hold = press;
  hold.time_limit_s = 0.5;
  robot_.Compliant(hold);
  const World& world = robot_.world();
  mjData* data = mj_copyData(nullptr, &world.model(), &world.data());
  const DataHandle owner(data);
  mj_forward(&world.model(), data);
  JointVector constraint;
  for (std::size_t i = 0; i < kJointCount; ++i) {
    constraint[static_cast<int>(i)] = data->qfrc_constraint[scene_->dof[i]];
  }
  const Vector6 wrench = ToolJacobian(*scene_, world.q_rad()).transpose().lu().solve(constraint);
  EXPECT_GT(robot_.ContactWrench().force_n.z(), 10.0);
  EXPECT_LT((robot_.ContactWrench().force_n - wrench.head<3>()).norm(), 0.2);
  EXPECT_LT((robot_.ContactWrench().torque_nm - wrench.tail<3>()).norm(), 0.03);
  EXPECT_TRUE(robot_.sensor().PairFlag(ContactPair::kToolTarget));
  EXPECT_FALSE(robot_.sensor().PairFlag(ContactPair::kToolEnvironment));
}

TEST_F(SimulatedRobotTest, FlagsDoNotChatter) {
  Hysteresis flag;
  EXPECT_FALSE(flag.Update(4.9));
  EXPECT_TRUE(flag.Update(5.1));
  EXPECT_TRUE(flag.Update(2.1));
  EXPECT_FALSE(flag.Update(1.9));
  EXPECT_FALSE(flag.Update(4.9));
}

TEST_F(SimulatedRobotTest, ZeroWrenchRemovesTheBiasAndNoiseIsAsAsked) {
  NoiseOptions noise;
  noise.force_bias_n = 20.0;
  noise.force_noise_n = 0.5;
  Place({0, 0, 0.05}, noise);
  robot_.Servo(Vector6::Zero(), 100);
  EXPECT_GT(robot_.ContactWrench().force_n.norm(), 2.0);
  robot_.ZeroWrench();
  double square = 0.0;
  constexpr int kSamples = 500;
  for (int i = 0; i < kSamples; ++i) {
    robot_.Servo(Vector6::Zero(), 1);
    square += robot_.sensor().raw().force_n.squaredNorm() / (3 * kSamples);
    EXPECT_LT(robot_.ContactWrench().force_n.norm(), 2.0);
  }
  EXPECT_NEAR(std::sqrt(square), 0.5, 0.1);
  EXPECT_EQ(robot_.sensor().exact().force_n.norm(), 0.0);
}

// A sensor with a delay of n steps reads what physics said n steps before.
TEST_F(SimulatedRobotTest, DelayShiftsTheReading) {
  for (const double delay_s : {0.0, 0.004, 0.01}) {
    NoiseOptions noise;
    noise.force_delay_s = delay_s;
    Place({0.02, 0.02, 0.001}, noise);
    Vector6 down = Vector6::Zero();
    down.z() = -2e-4;
    std::vector<Eigen::Vector3d> exact;
    std::vector<Eigen::Vector3d> read;
    for (int i = 0; i < 150; ++i) {
      robot_.Servo(down, 1);
      exact.push_back(robot_.sensor().exact().force_n);
      read.push_back(robot_.sensor().raw().force_n);
    }
    EXPECT_GT(exact.back().norm(), 5.0) << "the board is felt";
    const auto steps = static_cast<std::size_t>(std::lround(delay_s / scene_->model->opt.timestep));
    EXPECT_EQ(steps > 0, delay_s > 0.0);
    int changing = 0;
    for (std::size_t i = steps; i < read.size(); ++i) {
      EXPECT_EQ(read[i], exact[i - steps]) << "step " << i << ", delay " << delay_s;
      changing += i > 0 && exact[i] != exact[i - 1];
    }
    EXPECT_GT(changing, 20) << "else no delay would show";
  }
}

TEST_F(SimulatedRobotTest, BadArgumentsAreRefusedAndChangeNothing) {
  Place({0, 0, 0.05});
  const double nan = std::nan("");
  GuardedMotion guarded;
  guarded.distance_m = 0.01;
  const auto with = [&](auto change) {
    GuardedMotion motion = guarded;
    change(motion);
    return motion;
  };
  EXPECT_THROW(robot_.Guarded(with([&](auto& m) { m.direction *= 2; })), InputError);
  EXPECT_THROW(robot_.Guarded(with([&](auto& m) { m.direction.x() = nan; })), InputError);
  EXPECT_THROW(robot_.Guarded(with([&](auto& m) { m.distance_m = -0.1; })), InputError);
  EXPECT_THROW(robot_.Guarded(with([&](auto& m) { m.speed_m_s = 0; })), InputError);
  EXPECT_THROW(robot_.Guarded(with([&](auto& m) { m.contact_force_n = nan; })), InputError);
  Pose skewed = robot_.ToolPose();
  skewed.linear() *= 1.1;
  EXPECT_THROW(robot_.LinearMove(skewed, 0.1, 5.0), InputError);
  EXPECT_THROW(robot_.Transfer(skewed), InputError);
  EXPECT_THROW(robot_.Compliant({}), InputError);
  EXPECT_THROW(robot_.Servo(Vector6::Constant(nan), 1), InputError);
  EXPECT_THROW(robot_.SetTargetCandidates({}), InputError);
  EXPECT_EQ(robot_.Time(), 0.0);
  EXPECT_EQ(robot_.Guarded(guarded).reason, StopReason::kReached);
}

TEST_F(SimulatedRobotTest, DeadlineEndsMotions) {
  Place({0, 0, 0.05});
  robot_.SetDeadline(0.1);
  GuardedMotion motion;
  motion.direction = Eigen::Vector3d::UnitX();
  motion.distance_m = 0.03;
  EXPECT_EQ(robot_.Guarded(motion).reason, StopReason::kTimeLimit);
  EXPECT_NEAR(robot_.Time(), 0.1, 2e-3);
  EXPECT_EQ(robot_.Guarded(motion).reason, StopReason::kTimeLimit);
  EXPECT_NEAR(robot_.Time(), 0.1, 2e-3);
}

TEST_F(SimulatedRobotTest, ObserverSeesTheMotionAtItsPace) {
  Place({0, 0, 0.05});
  std::vector<double> seen;
  robot_.SetObserver([&](const World& world) { seen.push_back(world.time_s()); }, 0.04);
  GuardedMotion motion;
  motion.distance_m = 0.02;
  robot_.Guarded(motion);
  ASSERT_GE(seen.size(), 10U);
  for (std::size_t i = 2; i < seen.size(); ++i) EXPECT_NEAR(seen[i] - seen[i - 1], 0.04, 1.1e-3);
}

std::vector<double> Session(SimulatedRobot& robot) {
  const Scene& scene = robot.world().scene();
  robot.Reset(scene.home_q_rad, scene.task.world_T_target, NoisePreset("friction"), RandomStream(8, 3, "sensor"));
  std::vector<double> trace;
  const auto note = [&](const MotionResult& result) {
    trace.insert(trace.end(), {result.travelled_m, result.peak_force_n, robot.Time()});
    for (int i = 0; i < kJointCount; ++i) trace.push_back(robot.q_rad()[i]);
    for (int i = 0; i < 3; ++i) trace.push_back(robot.ContactWrench().force_n[i]);
  };
  note(robot.Transfer(ToolAt(scene, {0.02, 0.02, 0.02})));
  robot.ZeroWrench();
  GuardedMotion down;
  down.distance_m = 0.03;
  down.contact_force_n = 10.0;
  note(robot.Guarded(down));
  note(robot.LinearMove(ToolAt(scene, {0, 0, 0.005}), 0.25, 10.0));
  CompliantMotion insert;
  insert.world_T_tool = {ToolAt(scene, {0, 0, -0.019})};
  note(robot.Compliant(insert));
  return trace;
}

TEST_F(SimulatedRobotTest, SameCallsSameBitsAfterAnyPastOnAnyThread) {
  SimulatedRobot fresh(scene_);
  const std::vector<double> expected = Session(fresh);
  EXPECT_EQ(Session(fresh), expected);
  Place({0.02, 0.02, 0.01});
  GuardedMotion down;
  down.distance_m = 0.03;
  robot_.Guarded(down);
  EXPECT_EQ(Session(robot_), expected);
  std::vector<std::vector<double>> traces(2);
  std::vector<std::thread> threads;
  for (auto& trace : traces) {
    threads.emplace_back([&trace, this] {
      SimulatedRobot other(scene_);
      trace = Session(other);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& trace : traces) EXPECT_EQ(trace, expected);
}

}  // namespace
}  // namespace feeler::env
