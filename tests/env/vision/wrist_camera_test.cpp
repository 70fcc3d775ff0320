// The eye on the wrist and the motions that follow it. Laws: the plug tasks of other looks are felt like plug (equal
// fingerprints); the calibration is right (what the depth says of a pixel lies on the part that the pixel shows); same
// seed, same picture, and noise is noise; a twist moves the camera as commanded, goes on smoothly from call to call,
// keeps to the speed limits of the joints, stops at contact and where the arm ends; a robot without a camera says so.

#include "feeler/env/vision/wrist_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "feeler/core/error.h"
#include "feeler/env/model/fingerprint.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

SimulatedRobot RobotAt(const Eigen::Vector3d& displacement_m) {
  SimulatedRobot robot(PlugScene());
  const Scene& scene = *PlugScene();
  robot.Reset(At(scene, ToolAt(scene, displacement_m)), scene.task.world_T_target, {}, RandomStream(1, 0, "sensor"));
  return robot;
}

TwistMotion Moving(const Eigen::Vector3d& linear_m_s, const Eigen::Vector3d& angular_rad_s, double duration_s) {
  TwistMotion motion;
  motion.linear_m_s = linear_m_s;
  motion.angular_rad_s = angular_rad_s;
  motion.duration_s = duration_s;
  return motion;
}

TEST(Looks, AreNeverFelt) {
  const TaskModel plug = LoadTask("plug");
  for (const char* name : {"plug-black", "plug-black-on-white", "plug-textured", "plug-red-tape"}) {
    const TaskModel task = LoadTask(name);
    for (const Opening opening : {Opening::kClosed, Opening::kOpen}) {
      EXPECT_EQ(ContactMapFingerprint(task, opening), ContactMapFingerprint(plug, opening)) << name;
      EXPECT_EQ(Fingerprint(task, opening), Fingerprint(plug, opening)) << name;
    }
    const Scene scene = BuildScene(task);
    EXPECT_EQ(scene.model->ngeom, PlugScene()->model->ngeom) << name;
    EXPECT_EQ(scene.model->nbody, PlugScene()->model->nbody) << name;
  }
}

TEST(WristCamera, IsCalibratedAndKnowsItsOwnTool) {
  const Scene& scene = *PlugScene();
  const DataHandle data = MakeData(*scene.model);
  ResetScene(scene, At(scene, ToolAt(scene, {0.0, 0.0, 0.02})), *data);
  WristCamera camera(PlugScene());
  const CameraView view = camera.Look(*data, nullptr);
  const SurfaceImage surface = camera.Surface(*data);
  const std::vector<std::uint8_t> own = camera.OwnBody(surface);
  const auto pixel_of = [&](const Eigen::Vector3d& in_tool) {
    const Eigen::Vector3d p = view.tool_T_camera.inverse() * in_tool;
    const auto column = static_cast<int>(std::lround(view.cx + view.fx * p.x() / p.z()));
    const auto row = static_cast<int>(std::lround(view.cy + view.fy * p.y() / p.z()));
    EXPECT_TRUE(column >= 0 && column < view.width && row >= 0 && row < view.height);
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(column);
  };
  // The side of the plug that faces the camera, 10 mm above its tip.
  const Eigen::Vector3d on_plug(0.0, -0.008, 0.010);
  EXPECT_EQ(own[pixel_of(on_plug)], 1);
  EXPECT_NEAR(surface.depth.depth_m[pixel_of(on_plug)], (view.tool_T_camera.inverse() * on_plug).z(), 5e-4);
  // The rim of the housing on the camera's side, 20 mm below the tip.
  const Eigen::Vector3d on_rim(0.012, -0.0175, -0.020);
  EXPECT_EQ(own[pixel_of(on_rim)], 0);
  EXPECT_NEAR(surface.depth.depth_m[pixel_of(on_rim)], (view.tool_T_camera.inverse() * on_rim).z(), 5e-4);
  const auto hidden = std::count(own.begin(), own.end(), 1);
  EXPECT_GT(hidden, view.width * view.height / 20) << "the plug is in the way";
  EXPECT_LT(hidden, view.width * view.height / 2);
}

TEST(WristCamera, SameSeedSamePictureAndNoiseHasItsSize) {
  const Scene& scene = *PlugScene();
  const DataHandle data = MakeData(*scene.model);
  ResetScene(scene, At(scene, ToolAt(scene, {0.0, 0.0, 0.03})), *data);
  WristCameraOptions options;
  options.noise_levels = 2.0;
  WristCamera camera(PlugScene(), options);
  RandomStream first(1, 0, "image");
  RandomStream second(1, 0, "image");
  const CameraView clean = camera.Look(*data, nullptr);
  const CameraView noisy = camera.Look(*data, &first);
  EXPECT_EQ(camera.Look(*data, &second).rgb, noisy.rgb);
  EXPECT_EQ(camera.Look(*data, nullptr).rgb, clean.rgb);
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < clean.rgb.size(); ++i) {
    if (clean.rgb[i] < 20 || clean.rgb[i] > 235) continue;  // not cut off
    squares += std::pow(noisy.rgb[i] - clean.rgb[i], 2);
    count += 1.0;
  }
  EXPECT_NEAR(std::sqrt(squares / count), 2.0, 0.15);
}

TEST(FollowTwist, MovesTheFrameAsCommandedAndGoesOnSmoothly) {
  SimulatedRobot robot = RobotAt({0.0, 0.0, 0.08});
  Pose tool_T_frame = Pose::Identity();
  tool_T_frame.translation() = Eigen::Vector3d(0.0, -0.08, 0.15);
  tool_T_frame.linear() = Eigen::AngleAxisd(2.6, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Pose start = robot.ToolPose() * tool_T_frame;
  TwistMotion motion = Moving({0.02, -0.01, 0.015}, {0.0, 0.0, 0.2}, 1.0 / 30.0);
  motion.tool_T_frame = tool_T_frame;
  double fastest_change = 0.0;
  Eigen::Vector3d before = robot.ToolPose().translation();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (int i = 0; i < 30; ++i) {
    ASSERT_EQ(robot.FollowTwist(motion).reason, StopReason::kReached);
    const Eigen::Vector3d now = robot.ToolPose().translation();
    const Eigen::Vector3d faster = (now - before) * 30.0;
    if (i > 2) fastest_change = std::max(fastest_change, (faster - velocity).norm());
    velocity = faster;
    before = now;
  }
  EXPECT_LT(fastest_change, 2e-3) << "m/s from call to call";
  // Integrated in the frame's own axes: a screw with constant velocities.
  Pose expected = start;
  for (int i = 0; i < 10000; ++i) {
    expected.translation() += 1e-4 * (expected.linear() * motion.linear_m_s);
    expected.linear() = expected.linear() * Eigen::AngleAxisd(2e-5, Eigen::Vector3d::UnitZ());
  }
  const Pose end = robot.ToolPose() * tool_T_frame;
  EXPECT_LT((end.translation() - expected.translation()).norm(), 1.5e-3) << "but for the time to speed up";
  EXPECT_LT(Eigen::AngleAxisd(end.linear().transpose() * expected.linear()).angle(), 0.02);
  EXPECT_GT((end.translation() - start.translation()).norm(), 0.02);
}

TEST(FollowTwist, KeepsToTheSpeedLimitsOfTheJointsAndToReach) {
  SimulatedRobot robot = RobotAt({0.0, 0.0, 0.08});
  const Scene& scene = *PlugScene();
  double fraction = 0.0;
  robot.SetObserver(
      [&](const World& world) {
        fraction = std::max(fraction, world.qd_rad_s().cwiseAbs().cwiseQuotient(scene.velocity_limit_rad_s).maxCoeff());
      },
      scene.model->opt.timestep);
  MotionResult result;
  for (int i = 0; i < 60 && result.reason == StopReason::kReached; ++i) {
    result = robot.FollowTwist(Moving({20.0, 0.0, 20.0}, Eigen::Vector3d::Zero(), 0.05));
  }
  EXPECT_EQ(result.reason, StopReason::kUnplanned) << "the arm is at its end";
  EXPECT_FALSE(result.detail.empty());
  EXPECT_LT(fraction, 1.1);
  EXPECT_THROW(robot.FollowTwist(Moving(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.0)), InputError);
  EXPECT_THROW(robot.FollowTwist(Moving(Eigen::Vector3d::Constant(NAN), Eigen::Vector3d::Zero(), 0.1)), InputError);
}

TEST(FollowTwist, StopsAtContactAndReplaysAfterRestore) {
  SimulatedRobot robot = RobotAt({0.02, 0.0, 0.01});
  const TwistMotion down = Moving({0.0, 0.0, -0.03}, Eigen::Vector3d::Zero(), 0.1);
  ASSERT_EQ(robot.FollowTwist(down).reason, StopReason::kReached);
  const RobotState middle = robot.Save();
  Pose end = Pose::Identity();
  for (int time = 0; time < 2; ++time) {
    robot.Restore(middle);
    MotionResult result;
    int calls = 0;
    while (!result.contact && calls++ < 50) result = robot.FollowTwist(down);
    EXPECT_TRUE(result.contact);
    EXPECT_EQ(result.reason, StopReason::kContact);
    EXPECT_NEAR(result.world_T_tool.translation().z(), PlugScene()->task.world_T_target.translation().z(), 1e-3);
    if (time == 0) end = robot.ToolPose();
    EXPECT_EQ(robot.ToolPose().matrix(), end.matrix());
  }
}

class Blind : public Robot {
 public:
  Pose ToolPose() const override { return Pose::Identity(); }
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return 0.0; }
  MotionResult Transfer(const Pose& /*world_T_tool*/) override { return {}; }
  MotionResult LinearMove(const Pose& /*p*/, double /*speed_m_s*/, double /*force_n*/) override { return {}; }
  MotionResult Guarded(const GuardedMotion& /*motion*/) override { return {}; }
  MotionResult Compliant(const CompliantMotion& /*motion*/) override { return {}; }
};

TEST(RobotInterface, ARobotWithoutACameraSaysSo) {
  Blind robot;
  EXPECT_EQ(robot.Look().width, 0);
  EXPECT_EQ(robot.FollowTwist({}).reason, StopReason::kUnplanned);
  EXPECT_FALSE(robot.FollowTwist({}).detail.empty());
}

}  // namespace
}  // namespace feeler::env
