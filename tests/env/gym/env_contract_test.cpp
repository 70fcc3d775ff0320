// The contract of an environment, for every task file that ships (Gymnasium's checker and DESIGN, as laws):
//   every observation lies in the observation space, and flattening loses nothing that a second flattening would show;
//   the same seed gives the same trajectory, bit for bit, whatever ran before; another seed another one;
//   a reset erases the past, an unfinished episode and a broken one included;
//   a saved state continues bit for bit, here and in another environment of the scene, and is refused by another scene;
//   after termination and after truncation a step is refused, and the two flags are independent;
//   actions of wrong length, out of bounds or not finite are refused and change nothing;
//   numbers and actions are two spellings of the same thing.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/gym/spaces.h"
#include "feeler/env/model/task_file.h"

namespace feeler::env {
namespace {

std::shared_ptr<const Scene> SceneOfTask(const std::string& task) {
  static std::map<std::string, std::shared_ptr<const Scene>> scenes;
  auto& scene = scenes[task];
  if (!scene) scene = std::make_shared<const Scene>(BuildScene(LoadTask(task)));
  return scene;
}

std::vector<double> Numbers(const Observation& observation) {
  std::vector<double> values(kObservationSize);
  Flatten(observation, values);
  return values;
}

// Guarded moves towards the target and across it, a servo burst, an insertion: all that a policy would do.
std::vector<Action> Programme(const InsertionEnv& env) {
  const Eigen::Matrix3d axes = env.world_T_estimate().linear();
  const Eigen::Vector3d inward = axes * UnitVector(env.task().insertion);
  const Eigen::Vector3d across = axes.col((AxisOf(env.task().insertion) + 1) % 3);
  const auto move = [](const Eigen::Vector3d& direction, double distance_m) {
    GuardedMoveAction action;
    action.motion.direction = direction.normalized();
    action.motion.distance_m = distance_m;
    action.motion.contact_force_n = 10.0;
    return Action(action);
  };
  LowLevelAction servo;
  servo.delta << 0.001 * across, 0, 0, 0.002;
  servo.steps = 15;
  InsertAction insert;
  insert.distance_m = 0.006;
  return {move(across, 0.006), move(inward, 0.012), servo, move(-across, 0.004), insert, move(inward, 0.02)};
}

class EnvContract : public testing::TestWithParam<std::string> {
 protected:
  std::shared_ptr<const Scene> scene_ = SceneOfTask(GetParam());
  InsertionEnv env_{scene_};

  static void Play(InsertionEnv& env, const std::vector<Action>& actions, std::vector<double>& trace) {
    for (const Action& action : actions) {
      if (!env.running()) break;
      const StepResult result = env.Step(action);
      const std::vector<double> seen = Numbers(result.observation);
      EXPECT_TRUE(ObservationSpace().Contains(seen));
      trace.insert(trace.end(), seen.begin(), seen.end());
      trace.insert(trace.end(), {result.reward, static_cast<double>(result.terminated), result.info.peak_force_n,
                                 result.info.sim_time_s, static_cast<double>(result.info.stop_reason)});
    }
  }

  static std::vector<double> Episode(InsertionEnv& env, std::uint64_t seed, const ResetOptions& options = {}) {
    const StepResult first = env.Reset(seed, options);
    EXPECT_FALSE(first.terminated);
    EXPECT_FALSE(first.truncated);
    std::vector<double> trace = Numbers(first.observation);
    EXPECT_TRUE(ObservationSpace().Contains(trace));
    Play(env, Programme(env), trace);
    return trace;
  }
};

TEST_P(EnvContract, SameSeedSameTrajectoryAndTheResetErasesThePast) {
  ResetOptions noisy;
  noisy.noise = NoisePreset("friction");
  noisy.noise.encoder_jitter_rad = 1e-6;
  InsertionEnv fresh(scene_);
  const std::vector<double> expected = Episode(fresh, 21, noisy);
  Episode(env_, 22);
  env_.Reset(23);
  env_.Step(Programme(env_).front());  // left unfinished
  EXPECT_EQ(Episode(env_, 21, noisy), expected);
  EXPECT_NE(Episode(env_, 22, noisy), expected);
}

TEST_P(EnvContract, SavedStatesContinueBitForBit) {
  ResetOptions noisy;
  noisy.noise = NoisePreset("friction");
  noisy.noise.force_delay_s = 0.004;
  env_.Reset(5, noisy);
  std::vector<double> ignored;
  const std::vector<Action> programme = Programme(env_);
  const std::vector<Action> before(programme.begin(), programme.begin() + 3);
  const std::vector<Action> after(programme.begin() + 3, programme.end());
  Play(env_, before, ignored);
  const EnvState state = env_.Save();
  std::vector<double> expected;
  Play(env_, after, expected);
  ASSERT_FALSE(expected.empty());

  std::vector<double> again;
  env_.Restore(state);
  Play(env_, after, again);
  EXPECT_EQ(again, expected);
  std::vector<double> elsewhere;
  InsertionEnv other(scene_);
  other.Restore(state);
  Play(other, after, elsewhere);
  EXPECT_EQ(elsewhere, expected);

  InsertionEnv foreign(SceneOfTask(GetParam() == "round-peg" ? "plug" : "round-peg"));
  foreign.Reset(1);
  EXPECT_THROW(foreign.Restore(state), InputError);
  EXPECT_NO_THROW(foreign.Step(Programme(foreign).front()));
}

TEST_P(EnvContract, FlagsAreIndependentAndTheEndIsTheEnd) {
  EnvOptions options;
  options.limits = LimitsOf(scene_->task);
  options.limits->time_s = 0.2;
  InsertionEnv hasty(scene_, options);
  hasty.Reset(1);
  const StepResult late = hasty.Step(Programme(hasty)[1]);
  EXPECT_TRUE(late.truncated);
  EXPECT_FALSE(late.terminated);
  EXPECT_THROW(hasty.Step(Programme(hasty)[0]), InputError);
  hasty.Reset(1);
  EXPECT_NO_THROW(hasty.Step(LowLevelAction{}));

  // An insertion from over the mouth of a target that stands where it is believed to be.
  ResetOptions known;
  known.world_T_target = scene_->task.world_T_target;
  env_.Reset(1, known);
  const double height_m = -scene_->task.start_offset_m.dot(UnitVector(scene_->task.insertion));
  TransferAction above;
  above.world_T_tool = scene_->task.world_T_target;
  above.world_T_tool.translation() -= 0.003 * (above.world_T_tool.linear() * UnitVector(scene_->task.insertion));
  above.straight = true;
  ASSERT_GT(height_m, 0.003);
  env_.Step(above);
  InsertAction insert;
  insert.distance_m = 0.003 + scene_->task.insertion_depth_m + 0.001;
  const StepResult result = env_.Step(insert);
  EXPECT_TRUE(result.info.inserted) << ToString(result.info.insertion_reason);
  EXPECT_TRUE(result.terminated);
  EXPECT_FALSE(result.truncated);
  EXPECT_EQ(result.reward, 1.0);
  EXPECT_THROW(env_.Step(insert), InputError);
}

TEST_P(EnvContract, BadActionsAreRefusedAndChangeNothing) {
  EXPECT_THROW(env_.Step(LowLevelAction{}), InputError);  // before any reset
  const std::vector<double> expected = Episode(env_, 9);
  env_.Reset(9);
  for (const ActionKind kind :
       {ActionKind::kGuardedMove, ActionKind::kTransfer, ActionKind::kInsert, ActionKind::kLowLevel}) {
    const Space space = ActionSpace(kind);
    std::vector<double> good;
    for (const SpaceComponent& c : space.components) {
      const double middle = 0.5 * (c.low + c.high);
      good.push_back(c.whole ? std::floor(middle) : middle);
    }
    if (kind == ActionKind::kGuardedMove) good[0] = 1.0;
    if (kind == ActionKind::kTransfer) good[3] = 1.0;
    EXPECT_TRUE(space.Contains(good));
    EXPECT_NO_THROW(env_.RequireWelcome(DecodeAction(space, kind, good)));
    for (std::size_t i = 0; i < good.size(); ++i) {
      for (const double bad : {std::nan(""), HUGE_VAL, space.components[i].high + 1.0, space.components[i].low - 1.0}) {
        std::vector<double> values = good;
        values[i] = bad;
        EXPECT_FALSE(space.Contains(values));
        EXPECT_THROW(DecodeAction(space, kind, values), InputError);
      }
    }
    good.push_back(0.0);
    EXPECT_THROW(DecodeAction(space, kind, good), InputError);
  }
  GuardedMoveAction crooked;
  crooked.motion.direction = {1, 1, 0};
  EXPECT_THROW(env_.Step(crooked), InputError);
  TransferAction nowhere;
  nowhere.world_T_tool.translation().x() = std::nan("");
  EXPECT_THROW(env_.Step(nowhere), InputError);

  std::vector<double> trace = Numbers(env_.Reset(9).observation);
  EXPECT_THROW(env_.Step(crooked), InputError);
  Play(env_, Programme(env_), trace);
  EXPECT_EQ(trace, expected);
}

TEST_P(EnvContract, ABrokenWorldEndsTheEpisodeAndLeavesNoFile) {
  SceneOptions small;
  small.max_contacts = 1;
  const auto tight = std::make_shared<const Scene>(BuildScene(LoadTask(GetParam()), small));
  InsertionEnv env(tight);
  ResetOptions aside;
  aside.world_T_target = tight->task.world_T_target;
  aside.world_T_target->translation() += 0.012 * tight->task.world_T_target.linear().col(0);
  env.Reset(1, aside);
  GuardedMoveAction in;
  in.motion.direction = tight->task.world_T_target.linear() * UnitVector(tight->task.insertion);
  in.motion.distance_m = 0.08;
  in.motion.contact_force_n = 200.0;
  const StepResult result = env.Step(in);
  EXPECT_FALSE(result.info.inserted);
  if (!result.terminated) GTEST_SKIP() << "this tool makes no more than one contact";
  EXPECT_NE(result.info.detail.find("contact buffer full"), std::string::npos) << result.info.detail;
  EXPECT_THROW(env.Step(in), InputError);
  EXPECT_NO_THROW(env.Reset(2));
  EXPECT_FALSE(std::filesystem::exists("MUJOCO_LOG.TXT"));
}

INSTANTIATE_TEST_SUITE_P(Models, EnvContract, testing::ValuesIn(ListTasks()), [](const auto& task) {
  std::string name = task.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char letter) { return std::isalnum(letter) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace feeler::env
