// Episodes of tasks with uncertain yaw and pitch, in physics, with truths between the lattice points. Laws:
//   the pose is found and the part inserted whatever the policy knows: one that knows nothing (touches chosen on the
//   way do all) and one that was planned;  the estimate is far within the tolerance;  an odd number of angles, whose
//   estimate lies beside the lattice frame, makes no difference;  the same episode twice gives the same record.

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"
#include "feeler/workflow/episode/episode.h"

namespace feeler::workflow {
namespace {

/// Ends before its first move.
class KnowsNothing final : public policies::Policy {
 public:
  std::string_view name() const override { return "knows-nothing"; }
  void Begin(const planner::Problem& /*problem*/) override {}
  policies::Decision Next(const policies::Belief& /*belief*/) override { return policies::Insert{}; }
  bool Observe(const Outcome& /*outcome*/) override { return false; }
};

std::unique_ptr<policies::Policy> Planned(const PolicyRequest& request) {
  planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kRtdpBel, 2.0);
  options.expansion_limit = 20000;
  const planner::SolverResult result = planner::Solve(request.problem, options);
  if (!result.policy) return nullptr;
  return std::make_unique<policies::DatabasePolicy>(std::make_shared<const planner::PolicyGraph>(*result.policy));
}

class PipeEpisode : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    setup_.model = env::LoadTask(GetParam());
    // Fewer angles than the task has: the map is built in seconds.
    for (UncertainAxis& axis : setup_.model.task.axes) {
      axis.min_cells = 1;
      axis.max_cells = axis.angular() ? 2 : 5;
    }
    setup_.map = std::make_shared<const planner::ContactMap>(
        env::BuildContactMap(setup_.model, env::Opening::kClosed, Parallelism(2)));
    scene_ = BuildEpisodeScene(setup_);
  }

  EpisodeRecord Run(const PolicyFactory& factory, const std::string& extents, std::uint64_t episode) {
    EpisodeOptions options;
    options.seed = 5;
    options.family = planner::ParseProblemFamily(extents, setup_.task());
    EpisodeRunner runner(std::make_shared<const PlanningSetup>(setup_), scene_, factory, options);
    return runner.Run(episode);
  }

  PlanningSetup setup_;
  std::shared_ptr<const env::Scene> scene_;
};

void ExpectInserted(const EpisodeRecord& record) {
  EXPECT_TRUE(record.inserted) << record.reason;
  EXPECT_TRUE(record.localized);
  ASSERT_TRUE(record.error.has_value());
  EXPECT_LT(record.error->largest_lateral_m, 5e-4);
  EXPECT_LT(record.error->angle_rad, 0.015);
  EXPECT_LT(record.execution.sim_time_s, 25.0);
}

// One test, because the contact map takes longer than an episode.
TEST_P(PipeEpisode, IsInsertedWhateverThePolicyKnowsAndAgainTheSame) {
  const auto nothing = [](const PolicyRequest&) { return std::make_unique<KnowsNothing>(); };
  const EpisodeRecord one = Run(nothing, "5x5x2x2", 0);
  ExpectInserted(one);
  ExpectInserted(Run(nothing, "5x4x1x2", 1));
  ExpectInserted(Run(Planned, "4x5x2x2", 2));

  const EpisodeRecord other = Run(nothing, "5x5x2x2", 0);
  ASSERT_EQ(one.execution.moves.size(), other.execution.moves.size());
  for (std::size_t i = 0; i < one.execution.moves.size(); ++i) {
    EXPECT_EQ(one.execution.moves[i].travelled_m, other.execution.moves[i].travelled_m) << i;
  }
  EXPECT_EQ(one.execution.sim_time_s, other.execution.sim_time_s);
  EXPECT_EQ(one.world_T_true.matrix(), other.world_T_true.matrix());
}

INSTANTIATE_TEST_SUITE_P(Tasks, PipeEpisode, testing::Values("pipe-into-elbow", "elbow-onto-pipe-sideways"),
                         [](const auto& task) { return std::string(task.param).substr(0, 4); });

}  // namespace
}  // namespace feeler::workflow
