// Laws of VectorEnv: environment i does what an InsertionEnv alone does with the same keys, bit for bit, for any number
// of threads, by Step or by Send and Receive in any order; the three modes of auto-reset differ only in when the next
// episode begins, and the last observation of an episode is kept; a refused action changes nothing in its
// environment and does not keep the others from theirs; an auto-reset that fails is named, after the step that ended
// the episode is published, and every environment is reported once.

#include "feeler/env/gym/vector_env.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "feeler/core/error.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

constexpr int kEnvironments = 5;

VectorEnvOptions Options(int threads, AutoResetMode mode = AutoResetMode::kNextStep) {
  VectorEnvOptions options;
  options.environments = kEnvironments;
  options.threads = Parallelism(threads);
  options.auto_reset = mode;
  options.episode.noise = NoisePreset("friction");
  options.env.limits = LimitsOf(PlugScene()->task);
  options.env.limits->time_s = 0.35;  // a few steps an episode
  return options;
}

// Of different length in every environment and step.
Action Move(int environment, int step) {
  GuardedMoveAction action;
  action.motion.direction = step % 2 == 0 ? Eigen::Vector3d(-Eigen::Vector3d::UnitZ()) : Eigen::Vector3d::UnitX();
  action.motion.distance_m = 0.001 + 0.001 * ((environment * 7 + step * 3) % 5);
  action.motion.contact_force_n = 10.0;
  return action;
}

std::vector<double> Row(const VectorEnv& envs, int i) {
  const auto at = static_cast<std::size_t>(i);
  std::vector<double> row(envs.observation(i).begin(), envs.observation(i).end());
  row.push_back(envs.rewards()[at]);
  row.push_back(envs.terminated()[at]);
  row.push_back(envs.truncated()[at]);
  return row;
}

using Traces = std::vector<std::vector<double>>;

Traces ByStep(int threads, int steps, AutoResetMode mode = AutoResetMode::kNextStep) {
  VectorEnv envs(PlugScene(), Options(threads, mode));
  envs.Reset(3);
  Traces traces(kEnvironments);
  for (int step = 0; step < steps; ++step) {
    std::vector<Action> actions;
    for (int i = 0; i < kEnvironments; ++i) actions.push_back(Move(i, step));
    envs.Step(actions);
    for (int i = 0; i < kEnvironments; ++i) {
      const std::vector<double> row = Row(envs, i);
      auto& trace = traces[static_cast<std::size_t>(i)];
      trace.insert(trace.end(), row.begin(), row.end());
    }
  }
  return traces;
}

TEST(VectorEnv, AnyNumberOfThreadsGivesTheSameBits) {
  const Traces one = ByStep(1, 8);
  EXPECT_EQ(ByStep(2, 8), one);
  EXPECT_EQ(ByStep(4, 8), one);
  EXPECT_NE(one[0], one[1]);  // streams of their own
}

TEST(VectorEnv, EachDoesWhatItWouldDoAlone) {
  const Traces together = ByStep(2, 8);
  const VectorEnvOptions options = Options(1);
  for (int i = 0; i < kEnvironments; ++i) {
    InsertionEnv alone(PlugScene(), options.env);
    ResetOptions episode = options.episode;
    episode.episode = static_cast<std::uint64_t>(i);
    alone.Reset(3, episode);
    std::vector<double> trace;
    for (int step = 0; step < 8; ++step) {
      StepResult result;
      if (alone.running()) {
        result = alone.Step(Move(i, step));
      } else {
        episode.episode += kEnvironments;
        result = alone.Reset(3, episode);
      }
      std::vector<double> row(kObservationSize);
      Flatten(result.observation, row);
      trace.insert(trace.end(), row.begin(), row.end());
      trace.insert(trace.end(),
                   {result.reward, static_cast<double>(result.terminated), static_cast<double>(result.truncated)});
    }
    EXPECT_EQ(together[static_cast<std::size_t>(i)], trace) << i;
  }
}

TEST(VectorEnv, SendAndReceiveGiveWhatStepGives) {
  const Traces expected = ByStep(1, 8);
  for (const int threads : {1, 3}) {
    VectorEnv envs(PlugScene(), Options(threads));
    envs.Reset(3);
    Traces traces(kEnvironments);
    std::vector<int> steps(kEnvironments, 0);
    for (int i = 0; i < kEnvironments; ++i) envs.Send(i, Move(i, 0));
    EXPECT_THROW(envs.Send(0, Move(0, 1)), InputError);  // busy, or done and not received
    int received = 0;
    while (received < 8 * kEnvironments) {
      const std::vector<int> done = envs.Receive(2);
      ASSERT_FALSE(done.empty());
      for (const int i : done) {
        const auto at = static_cast<std::size_t>(i);
        const std::vector<double> row = Row(envs, i);
        traces[at].insert(traces[at].end(), row.begin(), row.end());
        ++received;
        if (++steps[at] < 8) envs.Send(i, Move(i, steps[at]));
      }
    }
    EXPECT_EQ(traces, expected) << threads;
    EXPECT_THROW(envs.Receive(), InputError);
  }
}

TEST(VectorEnv, ModesOfAutoReset) {
  for (const AutoResetMode mode : {AutoResetMode::kNextStep, AutoResetMode::kSameStep, AutoResetMode::kDisabled}) {
    VectorEnvOptions options = Options(2, mode);
    options.environments = 1;
    VectorEnv envs(PlugScene(), options);
    EXPECT_EQ(envs.auto_reset(), mode);
    envs.Reset(1);
    const std::vector<double> begin(envs.observation(0).begin(), envs.observation(0).end());
    int steps = 0;
    while (!envs.truncated()[0]) {
      ASSERT_LT(steps++, 100);
      envs.Step(std::vector<Action>{Move(0, steps)});
    }
    const std::vector<double> end(envs.final_observation(0).begin(), envs.final_observation(0).end());
    const std::vector<double> shown(envs.observation(0).begin(), envs.observation(0).end());
    EXPECT_NEAR(envs.final_info(0).sim_time_s, 0.35, 2e-3);
    EXPECT_NE(end, begin);
    EXPECT_EQ(envs.episodes(0), mode == AutoResetMode::kSameStep ? 2u : 1u);
    EXPECT_EQ(shown == end, mode != AutoResetMode::kSameStep);
    if (mode == AutoResetMode::kDisabled) {
      EXPECT_THROW(envs.Step(std::vector<Action>{Move(0, 0)}), InputError);
      envs.ResetOne(0);
    } else {
      envs.Step(std::vector<Action>{Move(0, 0)});
      EXPECT_EQ(envs.rewards()[0], 0.0);
    }
    EXPECT_EQ(envs.episodes(0), 2u);
    EXPECT_FALSE(envs.truncated()[0]);
    EXPECT_EQ(std::vector<double>(envs.final_observation(0).begin(), envs.final_observation(0).end()), end);
  }
}

LowLevelAction Bad() {
  LowLevelAction bad;
  bad.delta[2] = std::nan("");
  return bad;
}

TEST(VectorEnv, ARefusedActionDoesNotKeepTheOthersFromTheirs) {
  VectorEnv envs(PlugScene(), Options(2));
  EXPECT_THROW(envs.Send(0, Move(0, 0)), InputError);  // before the first reset
  envs.Reset(3);
  const std::vector<double> before = Row(envs, 4);
  std::vector<Action> actions;
  for (int i = 0; i < kEnvironments; ++i) actions.push_back(Move(i, 0));
  actions.back() = Bad();
  try {
    envs.Step(actions);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("environment 4"), std::string::npos) << error.what();
  }
  EXPECT_EQ(Row(envs, 4), before);
  EXPECT_EQ(envs.environment(4).robot().Time(), 0.0);
  EXPECT_FALSE(envs.failure(4).empty());
  for (int i = 0; i < 4; ++i) {
    EXPECT_GT(envs.environment(i).robot().Time(), 0.0) << i;
    EXPECT_TRUE(envs.failure(i).empty());
  }
  EXPECT_THROW(envs.Step(std::vector<Action>(2, Move(0, 0))), InputError);
  EXPECT_THROW(envs.Send(kEnvironments, Move(0, 0)), InputError);
  actions.back() = Move(kEnvironments - 1, 0);
  EXPECT_NO_THROW(envs.Step(actions));
  EXPECT_TRUE(envs.failure(4).empty());
  VectorEnvOptions none = Options(1);
  none.environments = 0;
  EXPECT_THROW(VectorEnv(PlugScene(), none), InputError);
}

TEST(VectorEnv, AnAutoResetThatFailsNamesItsEnvironmentOnce) {
  VectorEnvOptions options = Options(2, AutoResetMode::kSameStep);
  options.env.limits = InsertionLimits{};
  options.env.limits->time_s = 0.05;  // every step ends its episode
  VectorEnv envs(PlugScene(), options);
  envs.Reset(1);
  envs.Send(0, Move(0, 0));
  envs.Send(1, Move(1, 0));
  ResetOptions out_of_reach;
  Pose far = PlugScene()->task.world_T_target;
  far.translation().x() += 3.0;
  out_of_reach.world_T_estimate = far;
  envs.SetEpisodeOptions(out_of_reach);  // waits for 0 and 1: their next episodes have begun
  for (int i = 2; i < kEnvironments; ++i) envs.Send(i, Move(i, 0));
  std::multiset<int> reported;
  std::set<int> failed;
  while (static_cast<int>(reported.size()) < kEnvironments) {
    try {
      for (const int i : envs.Receive(kEnvironments)) reported.insert(i);
    } catch (const InputError& error) {
      const std::string what = error.what();
      ASSERT_EQ(what.find("environment "), 0U) << what;
      const int i = std::stoi(what.substr(12));
      failed.insert(i);
      reported.insert(i);
    }
  }
  EXPECT_EQ(failed, (std::set<int>{2, 3, 4}));
  for (int i = 0; i < kEnvironments; ++i) {
    EXPECT_EQ(reported.count(i), 1U) << i;
    EXPECT_TRUE(envs.truncated()[static_cast<std::size_t>(i)]) << i;  // the step that ended the episode
    EXPECT_EQ(envs.failure(i).empty(), i < 2) << i;
  }
  EXPECT_THROW(envs.Receive(), InputError);  // nothing is left
}

}  // namespace
}  // namespace feeler::env
