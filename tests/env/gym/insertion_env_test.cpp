// Laws of InsertionEnv: Gymnasium's contract. Same seed, same episode, bit for bit, after any past and on any thread;
// success and time limit are independent flags; a withheld true pose changes nothing else; an action that makes no
// sense is refused and leaves the episode as it was; a broken world ends the episode with its reason.

#include "feeler/env/gym/insertion_env.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "feeler/core/error.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

void Append(const StepResult& r, std::vector<double>& trace) {
  for (int i = 0; i < kJointCount; ++i) trace.insert(trace.end(), {r.observation.q_rad[i], r.observation.qd_rad_s[i]});
  for (int i = 0; i < 3; ++i) {
    trace.insert(trace.end(), {r.observation.raw_wrench.force_n[i], r.observation.filtered_wrench.force_n[i],
                               r.observation.raw_wrench.torque_nm[i], r.observation.world_T_tool.translation()[i]});
  }
  trace.insert(trace.end(), {r.observation.travelled_m, r.reward, r.info.peak_force_n, r.info.sim_time_s,
                             r.info.path_length_m, static_cast<double>(r.terminated), static_cast<double>(r.truncated),
                             static_cast<double>(r.observation.contact), static_cast<double>(r.info.stop_reason)});
  for (const bool flag : r.info.contact_pairs) trace.push_back(flag);
}

Action Down(double distance_m) {
  GuardedMoveAction action;
  action.motion.distance_m = distance_m;
  action.motion.contact_force_n = 10.0;
  return action;
}

Action Across(double x_m) {
  GuardedMoveAction action;
  action.motion.direction = Eigen::Vector3d::UnitX() * (x_m > 0 ? 1 : -1);
  action.motion.distance_m = std::abs(x_m);
  action.motion.contact_force_n = 10.0;
  return action;
}

std::vector<double> Episode(InsertionEnv& env, std::uint64_t seed, const ResetOptions& options = {}) {
  std::vector<double> trace;
  Append(env.Reset(seed, options), trace);
  LowLevelAction servo;
  servo.delta << 0.001, 0, 0.0005, 0, 0, 0.001;
  servo.steps = 20;
  for (const Action& action : {Across(0.01), Down(0.04), Across(0.004), Action(servo)}) {
    Append(env.Step(action), trace);
  }
  return trace;
}

class InsertionEnvTest : public ::testing::Test {
 protected:
  std::shared_ptr<const Scene> scene_ = PlugScene();
  InsertionEnv env_{scene_};

  ResetOptions Known() const {
    ResetOptions options;
    options.world_T_target = scene_->task.world_T_target;
    return options;
  }
};

TEST_F(InsertionEnvTest, SameSeedSameBitsWhateverRanBeforeAndWherever) {
  ResetOptions options;
  options.noise = NoisePreset("friction");
  options.episode = 5;
  InsertionEnv fresh(scene_);
  const std::vector<double> expected = Episode(fresh, 11, options);
  Episode(env_, 12);
  env_.Reset(13);
  EXPECT_EQ(Episode(env_, 11, options), expected);
  EXPECT_NE(Episode(env_, 12, options), expected);
  options.episode = 6;
  EXPECT_NE(Episode(env_, 11, options), expected);
  options.episode = 5;
  std::vector<std::vector<double>> traces(2);
  std::vector<std::thread> threads;
  for (auto& trace : traces) {
    threads.emplace_back([&] {
      InsertionEnv other(scene_);
      trace = Episode(other, 11, options);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& trace : traces) EXPECT_EQ(trace, expected);
}

TEST_F(InsertionEnvTest, WithholdingTheTruthChangesNothingElse) {
  ResetOptions options;
  EXPECT_TRUE(env_.Reset(3, options).info.world_T_target.has_value());
  const std::vector<double> open = Episode(env_, 3, options);
  options.withhold_true_pose = true;
  EXPECT_FALSE(env_.Reset(3, options).info.world_T_target.has_value());
  EXPECT_EQ(Episode(env_, 3, options), open);
}

TEST_F(InsertionEnvTest, InsertionIsRewardedAndEndsTheEpisode) {
  StepResult result = env_.Reset(1, Known());
  EXPECT_FALSE(result.terminated);
  EXPECT_LT((result.observation.world_T_tool.translation() -
             NominalStartPose(scene_->task, scene_->task.world_T_target).translation())
                .norm(),
            1e-6);
  TransferAction above;
  above.world_T_tool = ToolAt(*scene_, {0.0005, -0.0005, 0.003});
  above.straight = true;
  result = env_.Step(above);
  EXPECT_EQ(result.reward, 0.0);
  EXPECT_FALSE(result.terminated);
  InsertAction insert;
  insert.distance_m = 0.003 + 0.019;
  result = env_.Step(insert);
  EXPECT_TRUE(result.info.inserted) << ToString(result.info.insertion_reason);
  EXPECT_TRUE(result.terminated);
  EXPECT_FALSE(result.truncated);
  EXPECT_EQ(result.reward, 1.0);
  EXPECT_TRUE(env_.Judge().inserted);
  EXPECT_THROW(env_.Step(insert), InputError);
}

TEST_F(InsertionEnvTest, TimeLimitTruncatesIndependentlyOfSuccess) {
  EnvOptions options;
  options.limits = LimitsOf(scene_->task);
  options.limits->time_s = 0.5;
  InsertionEnv hasty(scene_, options);
  hasty.Reset(1, Known());
  StepResult result = hasty.Step(Down(0.01));
  EXPECT_FALSE(result.truncated);
  result = hasty.Step(Across(0.03));
  EXPECT_TRUE(result.truncated);
  EXPECT_FALSE(result.terminated);
  EXPECT_EQ(result.info.stop_reason, StopReason::kTimeLimit);
  EXPECT_NEAR(result.info.sim_time_s, 0.5, 2e-3);
  EXPECT_THROW(hasty.Step(Down(0.01)), InputError);
  EXPECT_NO_THROW(hasty.Reset(2));
  EXPECT_NO_THROW(hasty.Step(Down(0.01)));
}

TEST_F(InsertionEnvTest, TooMuchForceTerminatesWithoutSuccess) {
  EnvOptions options;
  options.limits = LimitsOf(scene_->task);
  options.limits->force_n = 30.0;
  InsertionEnv fragile(scene_, options);
  ResetOptions aside = Known();
  aside.world_T_target->translation().x() += 0.02;
  fragile.Reset(1, aside);
  const StepResult result = fragile.Step(Down(0.04));
  EXPECT_TRUE(result.terminated);
  EXPECT_FALSE(result.info.inserted);
  EXPECT_EQ(result.reward, 0.0);
}

TEST_F(InsertionEnvTest, BadActionsAreRefusedAndTheEpisodeGoesOn) {
  EXPECT_THROW(env_.Step(Down(0.01)), InputError);  // before the first reset
  const double nan = std::nan("");
  const std::vector<double> expected = Episode(env_, 4);

  std::vector<double> trace;
  Append(env_.Reset(4), trace);
  const auto refused = [&](const Action& action) { EXPECT_THROW(env_.Step(action), InputError); };
  refused(Down(nan));
  refused(Down(-0.1));
  refused(Down(10.0));
  GuardedMoveAction crooked;
  crooked.motion.distance_m = 0.01;
  crooked.motion.direction = {1, 1, 0};
  refused(crooked);
  TransferAction transfer;
  transfer.world_T_tool.translation().x() = nan;
  refused(transfer);
  transfer = {};
  transfer.speed_m_s = 5.0;
  refused(transfer);
  InsertAction insert;
  insert.force_limit_n = -1.0;
  refused(insert);
  LowLevelAction servo;
  servo.delta[0] = nan;
  refused(servo);
  servo.delta[0] = 0.1;
  refused(servo);
  servo.delta[0] = 0.0;
  servo.steps = 0;
  refused(servo);
  servo.delta << 0.001, 0, 0.0005, 0, 0, 0.001;
  servo.steps = 20;
  for (const Action& action : {Across(0.01), Down(0.04), Across(0.004), Action(servo)}) {
    Append(env_.Step(action), trace);
  }
  EXPECT_EQ(trace, expected);
}

TEST_F(InsertionEnvTest, BadResetsAreRefusedAndTheNextOneWorks) {
  ResetOptions far = Known();
  far.world_T_estimate = MakePose({3, 0, 0.2});
  EXPECT_THROW(env_.Reset(1, far), InputError);
  EXPECT_THROW(env_.Step(Down(0.01)), InputError);
  ResetOptions collision = Known();
  collision.world_T_target = NominalStartPose(scene_->task, scene_->task.world_T_target);
  collision.world_T_target->translation().x() += 0.02;
  EXPECT_THROW(env_.Reset(1, collision), InputError);
  ResetOptions wrong_extents;
  wrong_extents.extents = {7, 7};
  EXPECT_THROW(env_.Reset(1, wrong_extents), InputError);
  ResetOptions noise;
  noise.noise.force_noise_n = -1.0;
  EXPECT_THROW(env_.Reset(1, noise), InputError);
  EXPECT_THROW(NoisePreset("loud"), InputError);
  EXPECT_NO_THROW(env_.Reset(1));
  EXPECT_NO_THROW(env_.Step(Down(0.01)));
}

TEST_F(InsertionEnvTest, ABrokenWorldEndsTheEpisodeWithItsReason) {
  const TaskModel task = LoadTask("plug");
  SceneOptions options;
  options.max_contacts = 2;
  const auto tight = std::make_shared<const Scene>(BuildScene(task.task, task.xml, ModelsFolder().string(), options));
  InsertionEnv env(tight);
  ResetOptions aside = Known();
  aside.world_T_target->translation().x() += 0.02;
  env.Reset(1, aside);
  const StepResult result = env.Step(Down(0.04));
  EXPECT_TRUE(result.terminated);
  EXPECT_FALSE(result.info.inserted);
  EXPECT_EQ(result.info.stop_reason, StopReason::kAborted);
  EXPECT_NE(result.info.detail.find("contact buffer full"), std::string::npos) << result.info.detail;
  EXPECT_NO_THROW(env.Reset(1, Known()));
  EXPECT_FALSE(env.Step(Down(0.005)).terminated);
}

TEST_F(InsertionEnvTest, TrueposesFillTheBoxAndNoMore) {
  Task task = scene_->task;
  const Pose estimate = MakePose({0.6, 0, 0.2}, 0.4);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1), high = -low;
  for (std::uint64_t episode = 0; episode < 2000; ++episode) {
    RandomStream random(1, episode, "true-pose");
    const Pose truth = DrawTruePose(task, estimate, {3, 7, 15}, random);
    const Eigen::Vector3d offset = (estimate.inverse() * truth).translation();
    low = low.cwiseMin(offset);
    high = high.cwiseMax(offset);
  }
  const Eigen::Vector3d half = 0.001 * Eigen::Vector3d(3, 7, 15);
  EXPECT_TRUE((high.array() <= half.array()).all() && (low.array() >= -half.array()).all());
  EXPECT_TRUE((high.array() > 0.99 * half.array()).all() && (low.array() < -0.99 * half.array()).all());

  task.axes = {{AxisKind::kYaw, 0.05, 2, 6}};
  double widest = 0.0;
  for (std::uint64_t episode = 0; episode < 500; ++episode) {
    RandomStream random(1, episode, "true-pose");
    const Pose offset = estimate.inverse() * DrawTruePose(task, estimate, {5}, random);
    EXPECT_LT(offset.translation().norm(), 1e-12);
    widest = std::max(widest, Eigen::AngleAxisd(offset.linear()).angle());
  }
  EXPECT_NEAR(widest, 0.1, 0.002);  // half the lattice span of five angles
}

TEST(TargetCandidatesTest, AreTheCentreAndTheCornersOfTheBox) {
  const Task task = LoadTask("plug").task;
  const Pose estimate = MakePose(Eigen::Vector3d(0.4, 0.1, 0.2), 0.3);
  const std::vector<Pose> plug = TargetCandidates(task, estimate, {3, 7, 15});
  ASSERT_EQ(plug.size(), 9U);
  EXPECT_EQ(plug.front().matrix(), estimate.matrix());
  for (std::size_t i = 1; i < plug.size(); ++i) {
    const Eigen::Vector3d offset_m = (estimate.inverse() * plug[i]).translation();
    EXPECT_LT((offset_m.cwiseAbs() - Eigen::Vector3d(0.003, 0.007, 0.015)).norm(), 1e-12);
  }
  // Turned targets reach farther than shifted ones: a point on each candidate's side arm bounds that of every truth.
  const Task pipe = LoadTask("pipe-into-elbow").task;
  const std::vector<Pose> pipes = TargetCandidates(pipe, estimate, {10, 10, 6, 6});
  EXPECT_EQ(pipes.size(), 17U);
  EXPECT_EQ(TargetCandidates(pipe, estimate, {10, 10, 1, 6}).size(), 9U);
  const Eigen::Vector3d arm(0.1, 0.0, 0.0);
  Eigen::AlignedBox3d hull;
  for (const Pose& candidate : pipes) hull.extend(estimate.inverse() * candidate * arm);
  RandomStream random(3, 0, "candidates");
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d end = estimate.inverse() * DrawTruePose(pipe, estimate, {10, 10, 6, 6}, random) * arm;
    EXPECT_LT(hull.exteriorDistance(end), 1e-3) << "the arc between two corners bulges by less";
  }
}

TEST_F(InsertionEnvTest, EpisodesCanBeginAtHome) {
  ResetOptions options = Known();
  options.start = StartPlace::kHome;
  const StepResult begin = env_.Reset(1, options);
  EXPECT_EQ(begin.observation.q_rad, scene_->home_q_rad);
  TransferAction transfer;
  transfer.world_T_tool = NominalStartPose(scene_->task, scene_->task.world_T_target);
  const StepResult result = env_.Step(transfer);
  EXPECT_EQ(result.info.stop_reason, StopReason::kReached) << result.info.detail;
}

}  // namespace
}  // namespace feeler::env
