// Laws of the score, tried by those who would cheat it. Nothing but a tool at depth in the true port within the limits
// is a success, whatever is claimed:
// - policies that declare success, never decide, leave the workspace, answer nonsense or throw: the episode is recorded
//   as failed with the reason, and the next episode runs as if nothing had been;
// - users of the bare robot who ram the board, hammer on it, never move, command NaN: fail, and force, impulse and path
//   say what they did;
// - the same insertion with more force than is allowed, or after the time limit, is none.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/evaluation/records/episode_json.h"
#include "feeler/workflow/episode/episode.h"

namespace feeler::evaluation {
namespace {

using Act = std::function<policies::Decision(int)>;

/// Does what it is told, decision by decision.
class Adversary final : public policies::Policy {
 public:
  explicit Adversary(Act act) : act_(std::move(act)) {}
  std::string_view name() const override { return "adversary"; }
  void Begin(const planner::Problem& /*problem*/) override { decision_ = 0; }
  policies::Decision Next(const policies::Belief& /*belief*/) override { return act_(decision_); }
  bool Observe(const Outcome& /*outcome*/) override {
    ++decision_;
    return true;
  }

 private:
  Act act_;
  int decision_ = 0;
};

std::shared_ptr<const workflow::PlanningSetup> Setup() {
  static const auto setup = std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup("plug"));
  return setup;
}

workflow::EpisodeRecord RunOnce(const Act& act, bool ladder = false) {
  static const auto scene = workflow::BuildEpisodeScene(*Setup());
  workflow::EpisodeOptions options;
  options.seed = 4;
  options.family = planner::ParseProblemFamily("7x7x7");
  options.ladder = ladder;
  workflow::EpisodeRunner runner(
      Setup(), scene, [&](const workflow::PolicyRequest&) { return std::make_unique<Adversary>(act); }, options);
  workflow::EpisodeRecord first = runner.Run(2);
  EXPECT_EQ(ToJson(runner.Run(2))["reason"], first.reason) << "nothing of an episode stays for the next";
  return first;
}

TEST(Adversaries, PoliciesFailWithTheirReason) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    const char* name;
    Act act;
    const char* reason;  ///< begins with
  };
  const Case cases[] = {
      {"declares success",
       [](int) {
         return policies::Insert{false, std::nullopt};
       },
       ""},
      {"leaves the workspace",
       [](int) {
         return GuardedMove{Direction::kPlusX, 1000};
       },
       "policy: a guarded move out"},
      {"moves backwards",
       [](int) {
         return GuardedMove{Direction::kPlusX, -3};
       },
       "policy: a guarded move of -3"},
      {"never decides",
       [](int i) {
         return GuardedMove{i % 2 == 0 ? Direction::kPlusX : Direction::kMinusX, 1};
       },
       "limit: "},
      {"answers NaN",
       [nan](int) {
         return policies::SpiralSearch{nan, 0.001, 0.02, 10.0, 0.003};
       },
       "policy: a spiral"},
      {"spirals for ever",
       [](int) {
         return policies::SpiralSearch{0.9, 1e-9, 0.02, 10.0, 0.003};
       },
       "policy: a spiral"},
      {"throws",
       [](int i) -> policies::Decision {
         if (i > 0) throw std::runtime_error("no idea");
         return GuardedMove{Direction::kPlusX, 1};
       },
       "policy threw: no idea"},
      {"throws bad input", [](int) -> policies::Decision { throw InputError("me", "no idea", "ask somebody"); },
       "policy threw: me"},
      {"gives up", [](int) { return policies::GiveUp{"tired"}; }, "policy gave up: tired"},
  };
  for (const Case& c : cases) {
    const workflow::EpisodeRecord record = RunOnce(c.act);
    EXPECT_FALSE(record.inserted) << c.name;
    EXPECT_FALSE(record.localized) << c.name;
    EXPECT_FALSE(record.reason.empty()) << c.name;
    EXPECT_EQ(record.reason.find(c.reason), 0U) << c.name << ": " << record.reason;
    EXPECT_NE(record.reason, "inserted") << c.name;
  }
}

double DepthAsked() { return Setup()->task().insertion_depth_m; }

TEST(Adversaries, WhoLeavesAllToTheConfirmingTouchesIsScoredByWhereTheToolIs) {
  // The executor's own touches may find the target for it: then it has earned what the world says, and no more.
  const workflow::EpisodeRecord record = RunOnce([](int) { return policies::Insert{}; });
  EXPECT_EQ(record.inserted, record.depth_m > 0.9 * DepthAsked()) << record.reason;
  EXPECT_EQ(record.reason == "inserted", record.inserted);
  EXPECT_TRUE(record.localized) << "by the touches of the executor";
  ASSERT_TRUE(record.execution.world_T_estimate.has_value());
  EXPECT_LT((record.execution.world_T_estimate->translation() - record.world_T_true.translation()).head<2>().norm(),
            0.002);
}

/// What the world says of the present instant; nothing rests on what a policy or a user of the robot claims.
struct Score {
  explicit Score(const env::InsertionEnv& environment)
      : verdict(environment.Judge()), did(environment.robot().statistics()) {}
  bool success() const { return verdict.inserted; }
  env::InsertionVerdict verdict;
  env::RobotStatistics did;
};

struct User {
  User() : environment(workflow::BuildEpisodeScene(*Setup())) {
    env::ResetOptions options;
    options.world_T_target = environment.task().world_T_target;
    options.start = env::StartPlace::kStartPose;
    environment.Reset(1, options);
  }
  /// The tool displaced from the mouth of the true port.
  Pose At(double x_m, double z_m) const {
    Pose pose = environment.task().world_T_target;
    pose.translation() = pose * Eigen::Vector3d(x_m, 0.0, z_m);
    return pose;
  }
  void Press(const Pose& to, double force_n) {
    CompliantMotion motion;
    motion.world_T_tool = {to};
    motion.speed_m_s = 0.1;
    motion.force_limit_n = force_n;
    environment.robot().Compliant(motion);
  }
  env::InsertionEnv environment;
};

TEST(Adversaries, UsersOfTheRobotScoreWhatTheyDid) {
  User idle;
  const Score nothing(idle.environment);
  EXPECT_FALSE(nothing.success());
  EXPECT_EQ(nothing.did.path_length_m, 0.0);
  EXPECT_LE(nothing.verdict.depth_m, 0.0);
  EXPECT_EQ(nothing.did.peak_force_n, 0.0);

  // Commands that are no numbers change nothing.
  GuardedMotion nonsense;
  nonsense.distance_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(idle.environment.robot().Guarded(nonsense), InputError);
  EXPECT_EQ(Score(idle.environment).did.path_length_m, 0.0);

  User rammer;
  rammer.environment.robot().LinearMove(rammer.At(0.01, 0.002), 0.1, 1e6);
  rammer.Press(rammer.At(0.01, -0.05), 150.0);
  const Score rammed(rammer.environment);
  EXPECT_FALSE(rammed.success());
  EXPECT_FALSE(rammer.environment.limits().InsideOpening(rammer.environment.task(), Eigen::Vector3d(0.01, 0.0, 0.0)))
      << "beside the port, no depth counts";
  EXPECT_GT(rammed.did.peak_force_n, 30.0);
  EXPECT_GT(rammed.did.impulse_ns, 0.0);

  User hammerer;
  hammerer.environment.robot().LinearMove(hammerer.At(0.01, 0.002), 0.1, 1e6);
  double impulse_ns = 0.0;
  for (int blow = 0; blow < 3; ++blow) {
    hammerer.Press(hammerer.At(0.01, -0.02), 60.0);
    hammerer.environment.robot().LinearMove(hammerer.At(0.01, 0.004), 0.1, 1e6);
    const Score hammered(hammerer.environment);
    EXPECT_FALSE(hammered.success());
    EXPECT_GT(hammered.did.impulse_ns, impulse_ns) << "every blow counts";
    impulse_ns = hammered.did.impulse_ns;
  }

  // Half way into the port, then all the way.
  User honest;
  const double depth_m = honest.environment.task().insertion_depth_m;
  honest.environment.robot().LinearMove(honest.At(0.0, 0.002), 0.1, 1e6);
  honest.Press(honest.At(0.0, -0.5 * depth_m), 60.0);
  const Score half(honest.environment);
  EXPECT_FALSE(half.success());
  EXPECT_NEAR(half.verdict.depth_m, 0.5 * depth_m, 0.1 * depth_m);
  EXPECT_EQ(half.verdict.reason, env::InsertionReason::kTooShallow);
  honest.Press(honest.At(0.0, -depth_m - 0.001), 60.0);
  const Score whole(honest.environment);
  EXPECT_TRUE(whole.success()) << env::ToString(whole.verdict.reason);
  EXPECT_GT(whole.verdict.depth_m, 0.9 * depth_m);
  EXPECT_EQ(whole.did.forbidden_contacts, 0);

  // The hammer's blows are not forgiven: its force limit is the episode's, not the last motion's.
  const env::InsertionLimits limits = honest.environment.limits();
  const Pose inserted = honest.environment.robot().world().ToolPose();
  const Pose port = honest.environment.task().world_T_target;
  const Task& task = honest.environment.task();
  EXPECT_TRUE(env::JudgeInsertion(task, limits, inserted, port, limits.force_n, limits.time_s).inserted);
  EXPECT_FALSE(env::JudgeInsertion(task, limits, inserted, port, limits.force_n + 1, limits.time_s).inserted);
  EXPECT_FALSE(env::JudgeInsertion(task, limits, inserted, port, limits.force_n, limits.time_s + 1).inserted);
  EXPECT_FALSE(env::JudgeInsertion(task, limits, inserted, port, std::nan(""), 1.0).inserted);
  Pose elsewhere = port;
  elsewhere.translation().x() += 0.01;
  EXPECT_FALSE(env::JudgeInsertion(task, limits, inserted, elsewhere, 1.0, 1.0).inserted) << "not the right port";
}

}  // namespace
}  // namespace feeler::evaluation
