// Laws of motions by steps that fail:
// - cells travelled and contact of a drawn way that meets a wall are distributed as the planner's model of noise says,
//   for every kind of noise and all at once, with and without a wall;
// - without such noise a way is as long as it is told, and nothing is drawn;
// - on the robot a wall is missed as often as the steps that are left make it, the tool stays there, and the time of
// the
//   steps passes; a motion whose steps are spent ends short without a contact.
#include "feeler/env/robot/watched_way.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/noise/noisy_outcomes.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

constexpr double kCell_m = 0.002;

NoiseOptions StepNoiseOf(const planner::Noise& noise) {
  NoiseOptions options;
  options.false_stops_per_m = -std::log1p(-noise.false_stop) / kCell_m;
  options.missed_contact = noise.missed_contact;
  options.spent_step = noise.slip / (1.0 - noise.false_stop);
  options.step_m = kCell_m;
  return options;
}

TEST(WatchedWay, OutcomesAreThoseOfTheModel) {
  constexpr int kDraws = 40'000;
  constexpr int kCells = 4;
  for (const planner::Noise& noise : {planner::Noise{0.3, 0.0, 0.0}, planner::Noise{0.0, 0.2, 0.0},
                                      planner::Noise{0.0, 0.0, 0.3}, planner::Noise{0.2, 0.1, 0.15}}) {
    const NoiseOptions options = StepNoiseOf(noise);
    for (const int room : {0, 2, 3, kCells}) {
      RandomStream false_stops(3, static_cast<std::uint64_t>(room), "false"), spent(3, 1, "spent"),
          missed(3, 2, "missed");
      std::map<std::pair<int, bool>, int> counts;
      for (int i = 0; i < kDraws; ++i) {
        // The wall stands in the middle of the cell; a probe looks a quarter beyond its last one.
        const WatchedWay way = DrawWatchedWay(options, (kCells + 0.25) * kCell_m, false_stops, spent);
        const double wall_m = (room + 0.5) * kCell_m;
        std::pair<int, bool> outcome;
        if (room < kCells && way.advance_m + way.look_m > wall_m) {
          outcome = {room, false};
          for (int left = way.StepsLeft(wall_m); left > 0 && !outcome.second; --left) {
            outcome.second = missed.Uniform() >= noise.missed_contact;
          }
        } else {
          const int cells = std::min(kCells, static_cast<int>(std::floor(way.advance_m / kCell_m + 1e-6)));
          outcome = {cells, way.false_contact && cells < kCells};
        }
        ++counts[outcome];
      }
      planner::NoisyMoves moves(noise);
      for (const planner::NoisyOutcome& expected : moves.Of(kCells, room).outcomes) {
        const double share = static_cast<double>(counts[{expected.outcome.cells, expected.outcome.contact}]) / kDraws;
        const double sigma = std::sqrt(expected.probability * (1.0 - expected.probability) / kDraws);
        // Behind half a free cell a false contact comes before the wall could be missed: that much apart.
        const double apart = noise.false_stop * noise.missed_contact;
        EXPECT_NEAR(share, expected.probability, 5.0 * sigma + apart + 1e-9)
            << room << " free: " << expected.outcome.cells << (expected.outcome.contact ? " contact" : "");
      }
    }
  }
}

TEST(WatchedWay, WithoutNoiseNothingIsDrawn) {
  RandomStream a(1, 2, "a"), b(1, 2, "a");
  const WatchedWay way = DrawWatchedWay({}, 0.03, a, a);
  EXPECT_EQ(way.advance_m, 0.03);
  EXPECT_FALSE(way.false_contact);
  EXPECT_EQ(way.spent_m, 0.0);
  EXPECT_EQ(way.StepsLeft(0.01), 1);
  EXPECT_EQ(a.Next(), b.Next());
}

class StepsOfTheRobot : public ::testing::Test {
 protected:
  std::shared_ptr<const Scene> scene_ = PlugScene();
  SimulatedRobot robot_{scene_};

  /// Down onto the face, which is `above_m` below; the move is `cells` long.
  MotionResult Down(const NoiseOptions& noise, std::uint64_t episode, double above_m, double cells) {
    robot_.Reset(At(*scene_, ToolAt(*scene_, {0.02, 0.02, above_m})), scene_->task.world_T_target, noise,
                 RandomStream(1, episode, "sensor"));
    GuardedMotion motion;
    motion.direction = -(scene_->task.world_T_target.linear() * Eigen::Vector3d::UnitZ());
    motion.distance_m = cells * kCell_m;
    motion.speed_m_s = 0.01;
    return robot_.Guarded(motion);
  }
};

TEST_F(StepsOfTheRobot, MissAWallAsOftenAsStepsAreLeft) {
  constexpr int kMoves = 60;
  const NoiseOptions noise = StepNoiseOf({0.5, 0.0, 0.0});
  int missed = 0;
  double seconds[2] = {0.0, 0.0};
  for (std::uint64_t i = 0; i < kMoves; ++i) {
    // Half a cell free, two and a quarter to go: the steps that read the wall are two.
    const MotionResult result = Down(noise, i, 0.5 * kCell_m, 2.25);
    ASSERT_EQ(result.reason, result.contact ? StopReason::kContact : StopReason::kReached) << result.detail;
    EXPECT_NEAR(result.travelled_m, 0.5 * kCell_m, 1e-4);
    EXPECT_LT(result.peak_force_n, 25.0);
    missed += result.contact ? 0 : 1;
    seconds[result.contact] = std::max(seconds[result.contact], robot_.Time());
  }
  // A quarter of 60, 3.4 standard deviations.
  EXPECT_GE(missed, 4);
  EXPECT_LE(missed, 27);
  EXPECT_GT(seconds[0], 2.0 * kCell_m / 0.01) << "two steps were spent at the wall";
  const MotionResult sure = Down(StepNoiseOf({0.0, 0.0, 0.0}), 0, 0.5 * kCell_m, 2.25);
  EXPECT_TRUE(sure.contact);
}

TEST_F(StepsOfTheRobot, ThatAreSpentLeaveTheMotionShort) {
  const NoiseOptions noise = StepNoiseOf({0.0, 0.0, 0.4});
  int spent = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const MotionResult result = Down(noise, i, 0.02, 3.0);
    EXPECT_EQ(result.reason, StopReason::kReached);
    EXPECT_FALSE(result.contact);
    const double cells = result.travelled_m / kCell_m;
    EXPECT_NEAR(cells, std::round(cells), 0.05);
    spent += 3 - static_cast<int>(std::lround(cells));
    EXPECT_GT(robot_.Time(), 3.0 * kCell_m / 0.01) << "spent or not, three steps take their time";
  }
  EXPECT_GE(spent, 11);  // 24 of 60 expected, 3.4 standard deviations
  EXPECT_LE(spent, 38);
}

TEST(StepNoise, IsRefusedWithoutAStep) {
  NoiseOptions noise;
  noise.missed_contact = 0.1;
  EXPECT_THROW(noise.Validate(), InputError);
  noise.step_m = kCell_m;
  EXPECT_NO_THROW(noise.Validate());
  noise.spent_step = 1.0;
  EXPECT_THROW(noise.Validate(), InputError);
}

}  // namespace
}  // namespace feeler::env
