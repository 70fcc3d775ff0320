// Laws: a place is a pure function of the stream; it lies in the workspace, upright, turned within the limits; the
// robot can serve it (oracle: inverse kinematics and collision checks of the start and the inserted pose); the same
// draw through a rejecting `accept` comes later and counts the rejections; what lies in the bench, out of reach or on
// the arm, or so low that the tool beside it would meet the bench, is refused with a reason; wherever the target stands
// in its box of hypotheses, the arm at home is free.
#include "feeler/workflow/setup/placement_draw.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/model/task_file.h"

namespace feeler::workflow {
namespace {

std::shared_ptr<const env::Scene> PlugScene() {
  static const auto kScene = std::make_shared<const env::Scene>(env::BuildScene(env::LoadTask("plug")));
  return kScene;
}

TEST(Placement, DrawsWhatTheRobotCanServe) {
  PlacementSampler sampler(PlugScene());
  PlacementSampler again(PlugScene());
  env::TransferChecker checker(*PlugScene());
  for (std::uint64_t episode = 0; episode < 10; ++episode) {
    RandomStream random(3, episode, "placement");
    RandomStream same(3, episode, "placement");
    const PlacementDraw draw = sampler.Draw(random);
    EXPECT_EQ(draw.world_T_target.matrix(), again.Draw(same).world_T_target.matrix());
    EXPECT_LE(draw.world_T_target.translation().head<2>().cwiseAbs().maxCoeff(), 1.0);
    EXPECT_NEAR(draw.world_T_target.linear().col(2).z(), 1.0, 1e-12);
    EXPECT_LE(Eigen::AngleAxisd(draw.world_T_target.linear()).angle(), 15.0 * std::numbers::pi / 180.0 + 1e-12);
    checker.SetTargetPoses({draw.world_T_target});
    bool free = false;
    for (const env::JointVector& q :
         env::ToolInverseKinematics(*PlugScene(), env::NominalStartPose(PlugScene()->task, draw.world_T_target))) {
      free = free || checker.Free(q);
    }
    EXPECT_TRUE(free);
  }
}

TEST(Placement, LeavesTheArmAtHomeFreeWhereverTheTargetIs) {
  const auto scene = std::make_shared<const env::Scene>(env::BuildScene(env::LoadTask("pipe-into-elbow")));
  PlacementSampler sampler(scene);
  env::TransferChecker checker(*scene, 0.0);
  for (std::uint64_t episode = 0; episode < 12; ++episode) {
    RandomStream random(8, episode, "placement");
    const Pose estimate = sampler.Draw(random).world_T_target;
    checker.SetTargetPoses({env::DrawTruePose(scene->task, estimate, {10, 10, 6, 6}, random)});
    EXPECT_EQ(checker.Collision(scene->home_q_rad), "") << episode;
  }
}

TEST(Placement, RejectionsAreCounted) {
  PlacementSampler sampler(PlugScene());
  RandomStream plain(4, 0, "placement");
  const int own = sampler.Draw(plain).rejected;
  const Pose second = sampler.Draw(plain).world_T_target;
  RandomStream picky(4, 0, "placement");
  int asked = 0;
  const PlacementDraw draw = sampler.Draw(picky, [&](const Pose&) { return ++asked > 1; });
  EXPECT_EQ(asked, 2);
  EXPECT_GT(draw.rejected, own);
  EXPECT_EQ(draw.world_T_target.matrix(), second.matrix());
}

TEST(Placement, RefusesWithAReason) {
  PlacementSampler sampler(PlugScene());
  EXPECT_EQ(sampler.Obstacle(PlugScene()->task.world_T_target), "");
  EXPECT_NE(sampler.Obstacle(MakePose(Eigen::Vector3d(2.0, 0.0, 0.2))), "");
  EXPECT_NE(sampler.Obstacle(MakePose(Eigen::Vector3d(0.6, 0.0, 0.02))), "");
  // So low that the tool beside it would meet the bench.
  const auto pipes = std::make_shared<const env::Scene>(env::BuildScene(env::LoadTask("pipe-into-elbow")));
  PlacementSampler of_pipes(pipes);
  EXPECT_EQ(of_pipes.Obstacle(MakePose(Eigen::Vector3d(0.07, 0.65, 0.15))), "");
  EXPECT_NE(of_pipes.Obstacle(MakePose(Eigen::Vector3d(0.07, 0.65, 0.01))), "");
  EXPECT_THROW(ParsePlacement("anywhere"), InputError);
  EXPECT_EQ(ParsePlacement("workspace"), Placement::kWorkspace);
}

}  // namespace
}  // namespace feeler::workflow
