// Visual servoing in the closed loop: camera, policy, robot, insertion by the common executor. Laws: red tape is
// inserted from starts spread over the largest box of the task; a black port before black ends with "features lost" and
// untouched, not with a guess; records are the same whatever ran before; the truth that the goal was taught with does
// not leak into episodes (the goal is that of the nominal pose, whatever the episode).

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/setup/policy_registry.h"
#include "feeler/workflow/setup/visual_goal.h"

namespace feeler::workflow {
namespace {

EpisodeRunner Runner(const std::string& task, const std::string& policy) {
  const auto setup = std::make_shared<const PlanningSetup>(LoadPlanningSetup(task));
  EpisodeOptions options;
  options.seed = 23;
  options.family = planner::ParseProblemFamily("15x15x15");
  options.ladder = UsesLadder(policy);
  return {setup, BuildEpisodeScene(*setup), MakePolicyFactory(policy, nullptr), options};
}

TEST(VisualServoing, InsertsByRedTapeAndRepeats) {
  EpisodeRunner runner = Runner("plug-red-tape", "visual-servoing");
  EpisodeRecord first;
  for (std::uint64_t episode = 0; episode < 3; ++episode) {
    const EpisodeRecord record = runner.Run(episode);
    EXPECT_TRUE(record.inserted) << record.reason;
    EXPECT_TRUE(record.localized);
    ASSERT_TRUE(record.error.has_value());
    EXPECT_LT(record.error->lateral_m, 6e-4);
    EXPECT_GT(record.execution.pictures, 5);
    EXPECT_EQ(record.execution.policy_moves, 0);
    EXPECT_EQ(record.execution.contacts, 0) << "nothing is touched before the insertion";
    ASSERT_FALSE(record.execution.moves.empty());
    EXPECT_EQ(record.execution.moves.front().kind, "servo");
    if (episode == 0) first = record;
  }
  const EpisodeRecord again = runner.Run(0);
  EXPECT_EQ(again.execution.sim_time_s, first.execution.sim_time_s);
  EXPECT_EQ(again.execution.path_length_m, first.execution.path_length_m);
  EXPECT_EQ(again.execution.world_T_estimate->matrix(), first.execution.world_T_estimate->matrix());
}

// What is taught is the picture at the nominal target: the same pixels and the same place whoever taught before, at
// whatever truth the scene's episodes stand.
TEST(VisualServoing, TheGoalKnowsNothingOfTheTruth) {
  const auto setup = std::make_shared<const PlanningSetup>(LoadPlanningSetup("plug-red-tape"));
  const auto scene = BuildEpisodeScene(*setup);
  const auto fresh = TeachVisualGoal(scene);
  EpisodeRunner runner = Runner("plug-red-tape", "visual-servoing");
  const EpisodeRecord elsewhere = runner.Run(1);
  ASSERT_GT((elsewhere.world_T_true.translation() - setup->task().world_T_target.translation()).norm(), 1e-3);
  const auto later = TeachVisualGoal(scene);
  VisualGoalOnce once;
  const auto shared = once.For(*setup);
  for (const auto& goal : {later, shared}) {
    EXPECT_EQ(goal->view.rgb, fresh->view.rgb);
    EXPECT_EQ(goal->depth_m, fresh->depth_m);
    EXPECT_EQ(goal->tool_T_target.matrix(), fresh->tool_T_target.matrix());
  }
  // A moved target gives another picture: the comparison can fail.
  PlanningSetup moved = *setup;
  moved.model.task.world_T_target.translation().x() += 0.01;
  VisualGoalOnce other;
  EXPECT_NE(other.For(moved)->depth_m, fresh->depth_m);
}

TEST(VisualServoing, FindsNothingOnABlackPort) {
  EpisodeRunner runner = Runner("plug-black", "visual-servoing");
  const EpisodeRecord record = runner.Run(0);
  EXPECT_FALSE(record.inserted);
  EXPECT_EQ(record.reason.rfind("policy gave up: features lost", 0), 0U) << record.reason;
  EXPECT_EQ(record.execution.contacts, 0);
  EXPECT_TRUE(record.execution.ladder.empty());
}

}  // namespace
}  // namespace feeler::workflow
