// Free-space motions over a validity function. Oracles: validity re-checked along the way at a far finer resolution
// than the planner's; derivatives by finite differences; a solvable world (a wall with a gap) and an unsolvable one (a
// closed wall). Laws: in transfer_planner.h and time_parametrization.h.

#include <gtest/gtest.h>

#include <cmath>
#include <future>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/planner/motion/time_parametrization.h"
#include "feeler/planner/motion/transfer_planner.h"

namespace feeler::planner {
namespace {

constexpr double kPi = std::numbers::pi;

JointBounds Box(int joints) {
  return {Eigen::VectorXd::Constant(joints, -kPi), Eigen::VectorXd::Constant(joints, kPi)};
}

TransferOptions Options(int joints, std::uint64_t seed = 0) {
  TransferOptions options;
  options.seed = seed;
  options.reach_m = Eigen::VectorXd::LinSpaced(joints, 1.0, 0.3);
  options.check_spacing_m = 0.01;
  return options;
}

// A wall across joint 0 at zero, 0.2 thick, with a gap in joint 1 around +2.5.
bool GapWall(const Eigen::VectorXd& q) { return std::abs(q[0]) > 0.1 || std::abs(q[1] - 2.5) < 0.2; }
// The same with a clearance of half the check spacing in sweep: what is valid here at the spacing is free in between.
bool GapWallWithClearance(const Eigen::VectorXd& q) { return std::abs(q[0]) > 0.1051 || std::abs(q[1] - 2.5) < 0.18; }
bool ClosedWall(const Eigen::VectorXd& q) { return std::abs(q[0]) > 0.1; }

Eigen::VectorXd Point(int joints, double first, double others = 0.0) {
  Eigen::VectorXd q = Eigen::VectorXd::Constant(joints, others);
  q[0] = first;
  return q;
}

void ExpectFree(const TransferPlan& plan, const ValidityFunction& valid) {
  for (std::size_t i = 1; i < plan.way_points.size(); ++i) {
    for (int k = 0; k <= 2000; ++k) {
      const Eigen::VectorXd q = plan.way_points[i - 1] + k / 2000.0 * (plan.way_points[i] - plan.way_points[i - 1]);
      ASSERT_TRUE(valid(q)) << q.transpose();
      ASSERT_LE(q.cwiseAbs().maxCoeff(), kPi);
    }
  }
}

TEST(TransferPlanner, GoesStraightWhereItCan) {
  const TransferPlanner planner(
      Box(6), [](const Eigen::VectorXd&) { return true; }, Options(6));
  const TransferPlan plan = planner.Plan(Point(6, -1), {Point(6, 2), Point(6, 1)});
  ASSERT_TRUE(plan.planned());
  EXPECT_EQ(plan.goal, 1) << "the nearer goal";
  ASSERT_EQ(plan.way_points.size(), 2U);
  EXPECT_EQ(plan.way_points.front(), Point(6, -1));
  EXPECT_EQ(plan.way_points.back(), Point(6, 1));
  EXPECT_NEAR(plan.sweep_m, 2.0, 1e-12);
}

TEST(TransferPlanner, GoesAroundObstacles) {
  for (const int joints : {2, 6}) {
    const TransferPlanner planner(Box(joints), GapWallWithClearance, Options(joints));
    for (int seed = 0; seed < 5; ++seed) {
      TransferOptions options = Options(joints, static_cast<std::uint64_t>(seed));
      const TransferPlanner seeded(Box(joints), GapWallWithClearance, options);
      const TransferPlan plan = seeded.Plan(Point(joints, -1), {Point(joints, 1)});
      ASSERT_TRUE(plan.planned()) << plan.reason;
      EXPECT_EQ(plan.way_points.front(), Point(joints, -1));
      EXPECT_EQ(plan.way_points.back(), Point(joints, 1));
      EXPECT_GE(plan.sweep_m, planner.Sweep(Point(joints, -1), Point(joints, 1)));
      ExpectFree(plan, GapWall);
    }
  }
}

TEST(TransferPlanner, TakesTheGoalThatCanBeReached) {
  const TransferPlanner planner(Box(3), ClosedWall, Options(3));
  const TransferPlan plan = planner.Plan(Point(3, -1), {Point(3, 1), Point(3, 0.05), Point(3, -3, 3)});
  ASSERT_TRUE(plan.planned());
  EXPECT_EQ(plan.goal, 2);
}

TEST(TransferPlanner, EndsWhenItIsStoppedOrHasLookedLongEnough) {
  TransferOptions options = Options(3);
  options.iterations_all_goals = 1'000'000;  // for ever
  options.most_checks = 5000;
  const TransferPlan given_up = TransferPlanner(Box(3), ClosedWall, options).Plan(Point(3, -1), {Point(3, 1)});
  EXPECT_EQ(given_up.status, TransferStatus::kStopped);
  EXPECT_EQ(given_up.checks, options.most_checks);
  options.most_checks = 0;
  int asked = 0;
  options.stop = [&] { return ++asked > 300; };
  const TransferPlan stopped = TransferPlanner(Box(3), ClosedWall, options).Plan(Point(3, -1), {Point(3, 1)});
  EXPECT_EQ(stopped.status, TransferStatus::kStopped);
  EXPECT_EQ(stopped.checks, 300);
}

TEST(TransferPlanner, ReportsWhatCannotBePlanned) {
  TransferOptions options = Options(3);
  options.iterations_all_goals = 500;
  const TransferPlanner planner(Box(3), ClosedWall, options);
  EXPECT_EQ(planner.Plan(Point(3, -1), {Point(3, 1)}).status, TransferStatus::kNotFound);
  EXPECT_EQ(planner.Plan(Point(3, 0), {Point(3, 1)}).status, TransferStatus::kStartInvalid);
  EXPECT_EQ(planner.Plan(Point(3, 4), {Point(3, 1)}).status, TransferStatus::kStartInvalid);
  EXPECT_EQ(planner.Plan(Point(3, -1), {}).status, TransferStatus::kNoGoal);
  EXPECT_EQ(planner.Plan(Point(3, -1), {Point(3, 0), Point(3, 4)}).status, TransferStatus::kNoGoal);
  EXPECT_FALSE(planner.Plan(Point(3, -1), {}).reason.empty());
  EXPECT_THROW(planner.Plan(Point(2, -1), {Point(3, 0)}), InputError);
  options.check_spacing_m = 0.0;
  EXPECT_THROW(TransferPlanner(Box(3), ClosedWall, options), InputError);
}

// Same seed, same plan: whatever OMPL's process-wide generator has been through, on any thread.
TEST(TransferPlanner, IsDeterministicOnAnyThreadAndAfterAnyHistory) {
  const auto plan = [](std::uint64_t seed) {
    const TransferPlanner planner(Box(6), GapWall, Options(6, seed));
    return planner.Plan(Point(6, -1), {Point(6, 1), Point(6, 1.5, 0.5)});
  };
  const TransferPlan first = plan(7);
  ASSERT_TRUE(first.planned());
  bool differs = false;
  for (std::uint64_t seed = 0; seed < 5; ++seed) differs = differs || plan(seed).way_points != first.way_points;
  EXPECT_TRUE(differs) << "the seed must matter";
  std::vector<std::future<TransferPlan>> others;
  for (int i = 0; i < 4; ++i) others.push_back(std::async(std::launch::async, plan, 7));
  for (auto& other : others) {
    const TransferPlan again = other.get();
    EXPECT_EQ(again.way_points, first.way_points);
    EXPECT_EQ(again.checks, first.checks);
  }
}

struct Case {
  std::vector<Eigen::VectorXd> way_points;
  MotionLimits limits;
};

Case RandomCase(RandomStream& random, int joints, int points) {
  Case result;
  for (int i = 0; i < points; ++i) {
    Eigen::VectorXd q(joints);
    for (double& angle : q) angle = random.Uniform(-2.0, 2.0);
    result.way_points.push_back(q);
  }
  result.limits.velocity_rad_s = Eigen::VectorXd::Constant(joints, 1.5) + 0.5 * result.way_points[0].cwiseAbs();
  result.limits.acceleration_rad_s2 = Eigen::VectorXd::Constant(joints, 4.0) + result.way_points[0].cwiseAbs();
  return result;
}

double DistanceToPolyline(const Eigen::VectorXd& q, const std::vector<Eigen::VectorXd>& way_points) {
  double nearest = 1e9;
  for (std::size_t i = 1; i < way_points.size(); ++i) {
    const Eigen::VectorXd along = way_points[i] - way_points[i - 1];
    const double t = std::clamp(along.dot(q - way_points[i - 1]) / along.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (q - way_points[i - 1] - t * along).norm());
  }
  return nearest;
}

TEST(TimeParametrization, KeepsLimitsPathAndDerivatives) {
  RandomStream random(1, 0, "time");
  for (int sample = 0; sample < 30; ++sample) {
    const Case c = RandomCase(random, 6, 2 + sample % 5);
    for (const double deviation : {0.0, 0.002, 0.3}) {
      TimeParametrizationOptions options;
      options.corner_deviation_m = deviation;
      const JointTrajectory trajectory = Parametrize(c.way_points, c.limits, options);
      const double duration = trajectory.duration_s();
      ASSERT_GT(duration, 0.0);
      EXPECT_LT((trajectory.Sample(0.0).q_rad - c.way_points.front()).norm(), 1e-12);
      EXPECT_LT((trajectory.Sample(duration).q_rad - c.way_points.back()).norm(), 1e-9);
      EXPECT_LT(trajectory.Sample(0.0).qd_rad_s.norm() + trajectory.Sample(duration).qd_rad_s.norm(), 1e-6);
      constexpr int kSteps = 3000;
      const double dt = duration / kSteps;
      JointState before = trajectory.Sample(0.0);
      for (int k = 1; k <= kSteps; ++k) {
        const JointState state = trajectory.Sample(k * dt);
        for (int i = 0; i < 6; ++i) {
          ASSERT_LE(std::abs(state.qd_rad_s[i]), c.limits.velocity_rad_s[i] * (1.0 + 1e-3));
          ASSERT_LE(std::abs(state.qdd_rad_s2[i]), c.limits.acceleration_rad_s2[i] * (1.0 + 1e-3));
        }
        // q and qd are continuous, and each is the integral of the next.
        const double bound = c.limits.acceleration_rad_s2.norm() * dt;
        ASSERT_LT((state.qd_rad_s - before.qd_rad_s).norm(), 1.01 * bound + 1e-9);
        ASSERT_LT((state.q_rad - before.q_rad - 0.5 * dt * (state.qd_rad_s + before.qd_rad_s)).norm(), bound * dt);
        ASSERT_LT(DistanceToPolyline(state.q_rad, c.way_points), deviation + 1e-9);
        before = state;
      }
    }
  }
}

// One straight segment has a closed form: the slowest joint's trapezoid.
TEST(TimeParametrization, IsTimeOptimalOnAStraightLine) {
  MotionLimits limits{Eigen::VectorXd::Constant(2, 1.0), Eigen::VectorXd::Constant(2, 2.0)};
  for (const double way : {0.1, 0.5, 3.0}) {
    Eigen::VectorXd end(2);
    end << way, 0.4 * way;
    TimeParametrizationOptions options;
    options.stages_per_segment = 1000;
    const double expected = way < 0.5 ? 2.0 * std::sqrt(way / 2.0) : way / 1.0 + 1.0 / 2.0;
    const double duration = Parametrize({Eigen::VectorXd::Zero(2), end}, limits, options).duration_s();
    EXPECT_NEAR(duration, expected, 2e-3 * expected);
    EXPECT_GE(duration, expected - 1e-9);
  }
}

TEST(TimeParametrization, RoundingCornersSavesTimeAndScalingScales) {
  RandomStream random(2, 0, "time");
  for (int sample = 0; sample < 20; ++sample) {
    const Case c = RandomCase(random, 6, 4);
    TimeParametrizationOptions options;
    options.corner_deviation_m = 0.0;
    const double stopping = Parametrize(c.way_points, c.limits, options).duration_s();
    options.corner_deviation_m = 0.1;
    const double rounded = Parametrize(c.way_points, c.limits, options).duration_s();
    EXPECT_LT(rounded, stopping);
    // Velocities halved and accelerations quartered: twice the time.
    const MotionLimits slow{0.5 * c.limits.velocity_rad_s, 0.25 * c.limits.acceleration_rad_s2};
    EXPECT_NEAR(Parametrize(c.way_points, slow, options).duration_s(), 2.0 * rounded, 1e-6 * rounded);
  }
}

TEST(TimeParametrization, StandsStillWhereThereIsNoWay) {
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(3, 0.7);
  MotionLimits limits{Eigen::VectorXd::Ones(3), Eigen::VectorXd::Ones(3)};
  const JointTrajectory trajectory = Parametrize({q, q}, limits);
  EXPECT_EQ(trajectory.duration_s(), 0.0);
  EXPECT_EQ(trajectory.Sample(1.0).q_rad, q);
  limits.velocity_rad_s[1] = 0.0;
  EXPECT_THROW(Parametrize({q}, limits), InputError);
  EXPECT_THROW(Parametrize({}, limits), InputError);
}

}  // namespace
}  // namespace feeler::planner
