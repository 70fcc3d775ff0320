// Laws of a guarded move. It stops at the wall: within v * dt (0.05 mm at 50 mm/s) of where the geometry says, from
// any start and in any direction; in free space it ends where it was told and reports no contact; it agrees with the
// kinematic outcome (the tool slid along the line until it overlaps) except within 0.1 mm of a tie. A retreat from a
// contact does not stop at once, a push into it does. One that begins at its wall, or nearly, pushes no harder than one
// that comes from afar.

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/core/random.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

struct Approach {
  Eigen::Vector3d start_m;
  Eigen::Vector3d direction;
  double wall_m;
};

class GuardedMoveTest : public ::testing::TestWithParam<const char*> {
 protected:
  std::shared_ptr<const Scene> scene_ = PlugScene();
  SimulatedRobot robot_{scene_};
  NoiseOptions noise_ = NoisePreset(GetParam());
  Pose target_ = scene_->task.world_T_target;

  void Place(const Eigen::Vector3d& displacement_m, std::uint64_t episode = 0) {
    robot_.Reset(At(*scene_, ToolAt(*scene_, displacement_m)), target_, noise_, RandomStream(1, episode, "sensor"));
  }
  MotionResult Move(const Eigen::Vector3d& direction, double distance_m) {
    GuardedMotion motion;
    motion.direction = target_.linear() * direction;
    motion.distance_m = distance_m;
    motion.contact_force_n = noise_.contact_threshold_n;
    return robot_.Guarded(motion);
  }
};

TEST_P(GuardedMoveTest, StopsAtTheWall) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  const bool ideal = noise_.joint_friction_nm.isZero();
  for (const Approach& a : {
           Approach{{-0.06, 0.003, -0.01}, x, 0.06 - kWallX_m},
           Approach{{-0.0573, -0.017, -0.02}, x, 0.0573 - kWallX_m},
           Approach{{0.0611, 0, -0.008}, -x, 0.0611 - kWallX_m},
           Approach{{0.01, 0.0487, -0.01}, -y, 0.0487 - kWallY_m},
           Approach{{-0.02, -0.0502, -0.006}, y, 0.0502 - kWallY_m},
           Approach{{0.02, 0.02, 0.0113}, -z, 0.0113},
           Approach{{-0.03, 0.0, 0.0209}, -z, 0.0209},
           Approach{{0.055, 0.01, -0.0102}, -z, -0.0102 - kPanel_m},
       }) {
    Place(a.start_m);
    const MotionResult result = Move(a.direction, 0.032);
    EXPECT_EQ(result.reason, StopReason::kContact);
    EXPECT_TRUE(result.contact);
    EXPECT_NEAR(result.travelled_m, a.wall_m, ideal ? 1e-4 : 2e-4) << a.start_m.transpose();
    EXPECT_GE(result.peak_force_n, noise_.contact_threshold_n);
    EXPECT_LT(result.peak_force_n, 150.0);
    // It rests at the wall afterwards: the push has gone, the sideways coordinates are kept.
    EXPECT_LT(robot_.ContactWrench().force_n.norm(), 20.0);
    const Eigen::Vector3d moved = robot_.ToolPose().translation() - ToolAt(*scene_, a.start_m).translation();
    const Eigen::Vector3d along = target_.linear() * a.direction;
    EXPECT_LT((moved - moved.dot(along) * along).norm(), 1e-4);
    // Retreat, and press again.
    const MotionResult retreat = Move(-a.direction, 0.001);
    EXPECT_EQ(retreat.reason, StopReason::kReached);
    EXPECT_NEAR(retreat.travelled_m, 0.001, 1e-4);
    EXPECT_LT(robot_.ContactWrench().force_n.norm(), 5.0);
    const MotionResult again = Move(a.direction, 0.005);
    EXPECT_TRUE(again.contact);
    EXPECT_NEAR(again.travelled_m, 0.001, 2e-4);
    EXPECT_TRUE(Move(a.direction, 0.005).contact);
  }
}

TEST_P(GuardedMoveTest, OneThatBeginsAtItsWallPushesNoHarder) {
  GuardedMotion motion;
  motion.direction = -(target_.linear() * Eigen::Vector3d::UnitZ());
  motion.distance_m = 0.008;
  motion.speed_m_s = 0.0099;  // what 25 N allow along the insertion
  motion.contact_force_n = noise_.contact_threshold_n;
  const auto peak_n = [&](double above_m) {
    Place({0.02, 0.02, above_m});
    const MotionResult result = robot_.Guarded(motion);
    EXPECT_TRUE(result.contact) << above_m;
    return result.peak_force_n;
  };
  const double afar_n = peak_n(0.004);
  for (const double above_m : {0.0, 1e-5, 2e-5, 4e-5, 7e-5, 1e-4, 2e-4, 5e-4}) {
    EXPECT_LE(peak_n(above_m), 1.2 * afar_n) << above_m;
  }
}

TEST_P(GuardedMoveTest, FreeMovesAreNeitherStoppedNorShort) {
  RandomStream random(2, 0, "free-moves");
  Place({-0.03, -0.03, 0.03});
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d goal(random.Uniform(-0.05, 0.05), random.Uniform(-0.05, 0.05), random.Uniform(0.004, 0.06));
    const Eigen::Vector3d way = ToolAt(*scene_, goal).translation() - robot_.ToolPose().translation();
    const MotionResult result = Move(target_.linear().transpose() * way.normalized(), way.norm());
    EXPECT_EQ(result.reason, StopReason::kReached);
    EXPECT_FALSE(result.contact);
    EXPECT_NEAR(result.travelled_m, way.norm(), 1e-4);
    EXPECT_LT((robot_.ToolPose().translation() - ToolAt(*scene_, goal).translation()).norm(), 1e-4);
    EXPECT_EQ(robot_.statistics().peak_force_n, 0.0);
  }
}

// How far the tool can go: the target is slid against it in a world of its own.
double KinematicTravel(const Scene& scene, mjData& data, const Eigen::Vector3d& start_m,
                       const Eigen::Vector3d& direction, double distance_m) {
  const auto overlaps = [&](double travel_m) {
    Pose target = scene.task.world_T_target;
    target.translation() -= target.linear() * (travel_m * direction);
    SetTargetPose(scene, target, data);
    mj_kinematics(scene.model.get(), &data);
    mj_collision(scene.model.get(), &data);
    for (int i = 0; i < data.ncon; ++i) {
      const auto part = [&](int geom) { return scene.geom_part[static_cast<std::size_t>(geom)]; };
      const ScenePart a = part(data.contact[i].geom1), b = part(data.contact[i].geom2);
      if (a == ScenePart::kTarget || b == ScenePart::kTarget) return true;
    }
    return false;
  };
  ResetScene(scene, At(scene, ToolAt(scene, start_m)), data);
  double free_m = 0.0;
  while (free_m < distance_m && !overlaps(free_m + 2e-4)) free_m += 2e-4;
  double low = free_m, high = free_m + 2e-4;
  for (int i = 0; i < 12; ++i) (overlaps((low + high) / 2) ? high : low) = (low + high) / 2;
  return low;
}

TEST_P(GuardedMoveTest, AgreesWithTheKinematicOutcome) {
  RandomStream random(4, 0, "outcomes");
  const DataHandle data = MakeData(*scene_->model);
  constexpr int kMoves = 60;
  int contacts = 0, disagreements = 0;
  for (int i = 0; i < kMoves; ++i) {
    // Free starts: above the rim or beside the housing, anywhere between lattice points.
    Eigen::Vector3d start(random.Uniform(-0.06, 0.06), random.Uniform(-0.055, 0.055), random.Uniform(0.0015, 0.02));
    Direction towards = Direction::kMinusZ;
    if (i % 2 == 0) {
      start.z() = random.Uniform(-0.028, -0.002);
      const int axis = static_cast<int>(random.Index(2));
      const int side = random.Uniform() < 0.5 ? -1 : 1;
      const double edge = axis == 0 ? kWallX_m : kWallY_m;
      start[axis] = side * random.Uniform(edge + 0.001, edge + 0.02);
      towards = MakeDirection(axis, -side);
    }
    if (random.Uniform() < 0.4) towards = kDirections[random.Index(kDirectionCount)];
    const Eigen::Vector3d direction = UnitVector(towards);
    const double distance_m = 0.002 * static_cast<double>(1 << random.Index(5));
    const double free_m = KinematicTravel(*scene_, *data, start, direction, distance_m + 0.001);
    Place(start, static_cast<std::uint64_t>(i));
    const MotionResult result = Move(direction, distance_m);
    ASSERT_TRUE(result.reason == StopReason::kReached || result.reason == StopReason::kContact) << result.detail;
    contacts += result.contact ? 1 : 0;
    if (std::abs(free_m - distance_m) < 1e-4) continue;
    const bool agrees =
        result.contact == (free_m < distance_m) && std::abs(result.travelled_m - std::min(free_m, distance_m)) < 2e-4;
    disagreements += agrees ? 0 : 1;
    // A contact just before the end of the move may stay below the threshold: the tool is slow there.
    if (free_m < distance_m - 6e-4 || free_m > distance_m) {
      EXPECT_TRUE(agrees) << "move " << i << " from " << start.transpose() << " along " << direction.transpose()
                          << ": kinematic " << free_m << " of " << distance_m << ", measured " << result.travelled_m
                          << (result.contact ? " contact" : " free");
    }
  }
  RecordProperty("disagreements", disagreements);
  EXPECT_GT(contacts, kMoves / 6);
  EXPECT_LE(disagreements, 1);
}

INSTANTIATE_TEST_SUITE_P(Noise, GuardedMoveTest, ::testing::Values("ideal", "friction"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace feeler::env
