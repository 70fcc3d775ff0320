// Laws of a mover under a force budget, against a wall that pushes back in proportion to speed, harder than the robot
// says:
//   - the first probe into it may pass the budget; no later one in its direction does, and other directions stay as
//   fast;
//   - a probe into what holds the tool is slower by the masses, one that may meet an edge keeps the budget whatever the
//   normal of the edge;
//   - after a transfer that met something above the budget, transfers keep within it; before, they go at full speed;
//   - once the plan has failed, transfers and insertions keep within it;
//   - ways that stay over all of the target, whose height was felt, need no care.
#include "feeler/execution/contact/mover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "feeler/execution/contact/force_budget.h"

namespace feeler::execution {
namespace {

/// A tool that meets something at the end of every motion, as long as it `meets` anything.
class HardRobot final : public Robot {
 public:
  explicit HardRobot(double harder) : harder_(harder) {
    contact_.held_mass_kg = 12.0;
    contact_.free_mass_kg = 3.0;
    contact_.stiffness_n_m = 2e4;
  }
  Pose ToolPose() const override { return pose_; }
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return time_s_; }
  ContactResponse Contact(const Eigen::Vector3d& direction) const override {
    EXPECT_NEAR(direction.norm(), 1.0, 1e-9) << "a direction is a unit vector";
    ContactResponse contact = contact_;
    if (stiff_n_m) contact.stiffness_n_m = direction.cwiseAbs2().dot(*stiff_n_m);
    return contact;
  }
  MotionResult Transfer(const Pose& goal) override { return Meet(goal, 0.25); }
  MotionResult LinearMove(const Pose& goal, double speed_m_s, double /*force*/) override {
    return Meet(goal, speed_m_s);
  }
  MotionResult Guarded(const GuardedMotion& motion) override {
    Pose goal = pose_;
    goal.translation() += motion.distance_m * motion.direction;
    return Meet(goal, motion.speed_m_s);
  }
  MotionResult Compliant(const CompliantMotion& motion) override {
    return Meet(motion.world_T_tool.back(), motion.speed_m_s);
  }

  std::vector<double> speeds_m_s;
  bool meets = true;
  std::optional<Eigen::Vector3d> stiff_n_m;  ///< along each axis, between them by the squares of the cosines

 private:
  MotionResult Meet(const Pose& goal, double speed_m_s) {
    speeds_m_s.push_back(speed_m_s);
    pose_ = goal;
    time_s_ += 0.1;
    MotionResult result;
    result.world_T_tool = pose_;
    if (!meets) return result;
    result.reason = StopReason::kContact;
    result.contact = true;
    result.peak_force_n = harder_ * speed_m_s * ForcePerSpeed(contact_);
    return result;
  }

  double harder_;
  ContactResponse contact_;
  Pose pose_ = Pose::Identity();
  double time_s_ = 0.0;
};

struct Bench {
  explicit Bench(double harder) : robot(harder) {
    options.force_budget_n = 20.0;
    options.probe_speed_m_s = 1.0;
  }
  double Probe(Direction direction, const MayMeet& may_meet = {}) {
    Mover mover(robot, frame, Direction::kMinusZ, options, record, 0.0);  // movers come and go within an episode
    mover.Probe(direction, mover.position()[AxisOf(direction)] + SignOf(direction) * 2.0, "probe", {}, may_meet);
    return record.moves.back().peak_force_n;
  }
  HardRobot robot;
  LatticeFrame frame;
  ExecutorOptions options;
  ExecutionRecord record;
};

TEST(Mover, AContactThatIsHarderThanToldIsNotMetTwice) {
  for (const double harder : {1.3, 2.0, 5.0}) {
    Bench bench(harder);
    EXPECT_GT(bench.Probe(Direction::kPlusY), 20.0);
    const double first_m_s = bench.robot.speeds_m_s.back();
    for (int i = 0; i < 3; ++i) EXPECT_LE(bench.Probe(Direction::kPlusY), 20.0) << harder;
    bench.Probe(Direction::kMinusX);
    EXPECT_DOUBLE_EQ(bench.robot.speeds_m_s.back(), first_m_s) << "nothing was learned of this direction";
    EXPECT_EQ(bench.record.budget_passings, 2);
  }
}

TEST(Mover, AContactAsToldChangesNothing) {
  Bench bench(1.0);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(bench.Probe(Direction::kMinusY), kShareOfBudget * 20.0, 1e-9);
}

TEST(Mover, WhatHoldsTheToolIsMetSlower) {
  Bench bench(1.0);
  bench.Probe(Direction::kPlusX);
  const double free_m_s = bench.robot.speeds_m_s.back();
  bench.Probe(Direction::kPlusX, {.long_wall = true, .edge_towards = {}});
  const ContactResponse told = bench.robot.Contact(Eigen::Vector3d::UnitX());
  EXPECT_NEAR(free_m_s / bench.robot.speeds_m_s.back(), told.held_mass_kg / told.mass_kg(), 1e-9);
}

// Faces lie across the insertion: the tool cannot turn away from them. Out of the opening nothing holds it.
TEST(Mover, FacesAlongTheInsertionAreMetAsSlowAsWhatHoldsTheTool) {
  Bench bench(1.0);
  bench.Probe(Direction::kPlusZ);
  const double free_m_s = bench.robot.speeds_m_s.back();
  bench.Probe(Direction::kMinusZ);
  const ContactResponse told = bench.robot.Contact(-Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(free_m_s / bench.robot.speeds_m_s.back(), told.held_mass_kg / told.mass_kg(), 1e-9);
  EXPECT_NEAR(bench.robot.speeds_m_s.back() * ForcePerSpeed(told.Held()), kShareOfBudget * 20.0, 1e-9);
}

TEST(Mover, AnEdgeIsMetSlowEnoughForEveryNormal) {
  // Stiff along z, soft across: what an edge between them pushes with is between, by the angle of its normal.
  Bench bench(1.0);
  bench.robot.stiff_n_m = Eigen::Vector3d(2e4, 2e4, 4e5);
  bench.Probe(Direction::kPlusX);
  const double face_m_s = bench.robot.speeds_m_s.back();
  bench.Probe(Direction::kPlusX, {.long_wall = false, .edge_towards = Eigen::Vector3d::UnitZ()});
  const double edge_m_s = bench.robot.speeds_m_s.back();
  EXPECT_LT(edge_m_s, face_m_s);
  for (double angle = 0.0; angle < 1.55; angle += 0.01) {
    const Eigen::Vector3d normal(std::cos(angle), 0.0, std::sin(angle));
    EXPECT_LE(std::cos(angle) * edge_m_s * ForcePerSpeed(bench.robot.Contact(normal)), 20.0) << angle;
  }
}

TEST(Mover, TransfersAreCarefulOnceOneMetSomethingHard) {
  Bench bench(1.0);
  Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
  mover.Fast({4.0, 0.0, 0.0}, "transfer");
  EXPECT_DOUBLE_EQ(bench.robot.speeds_m_s.back(), bench.options.transfer_speed_m_s);
  EXPECT_GT(bench.record.moves.back().peak_force_n, 20.0);
  for (int i = 1; i < 4; ++i) {
    mover.Fast({4.0, 3.0 * i, 0.0}, "transfer");
    EXPECT_LE(bench.record.moves.back().peak_force_n, 20.0);
  }
}

TEST(Mover, TransfersAreCarefulOnceOneMetAnythingUnforeseen) {
  for (const bool foreseen : {true, false}) {
    Bench bench(0.1);
    Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
    mover.Fast({4.0, 0.0, 0.0}, "transfer",
               foreseen ? PredictedCells(std::array<double, 2>{1.0, 4.0}) : PredictedCells());
    EXPECT_LE(bench.record.moves.back().peak_force_n, 20.0);
    mover.Fast({4.0, 3.0, 0.0}, "transfer");
    EXPECT_EQ(bench.robot.speeds_m_s.back() < bench.options.transfer_speed_m_s, !foreseen);
  }
}

TEST(Mover, WaysOverAllThatWasFeltAreFastWhateverIsBelow) {
  Bench bench(0.1);
  bench.robot.meets = false;
  bench.record.careful = true;
  const double fast_m_s = bench.options.transfer_speed_m_s;
  const auto speed_to = [&](Mover& mover, const Eigen::Vector3d& to) {
    bench.record.startled = 5;
    mover.Fast(to, "transfer", std::array<double, 2>{0.0, 100.0});
    return bench.robot.speeds_m_s.back();
  };
  Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
  EXPECT_LT(speed_to(mover, {0.0, 0.0, 6.0}), fast_m_s) << "nothing was told";
  mover.KeepClearOf(5.0);
  EXPECT_EQ(speed_to(mover, {20.0, 0.0, 5.5}), fast_m_s);
  EXPECT_LT(speed_to(mover, {20.0, 0.0, 4.5}), fast_m_s) << "down into it";
  EXPECT_LT(speed_to(mover, {20.5, 0.0, 4.5}), fast_m_s) << "below";
  EXPECT_LT(speed_to(mover, {20.5, 0.1, 5.0}), fast_m_s) << "out of it";
  EXPECT_EQ(speed_to(mover, {20.0, 0.0, 8.0}), fast_m_s);
  // Out is against the insertion, along any axis.
  Mover along_x(bench.robot, bench.frame, Direction::kPlusX, bench.options, bench.record, 0.0);
  along_x.KeepClearOf(30.0);
  EXPECT_EQ(speed_to(along_x, {29.5, 0.0, 0.0}), fast_m_s);
  EXPECT_LT(speed_to(along_x, {31.0, 0.0, 0.0}), fast_m_s);
}

// A careful way straight in is fast up to what stands out farthest; the two motions make the whole way.
TEST(Mover, GoesFastDownToWhatItIsToKeepClearOf) {
  Bench bench(1.0);
  bench.record.careful = true;
  bench.robot.meets = false;
  Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
  mover.Retreat({20.0, 0.0, 12.0});
  mover.KeepClearOf(5.0);
  const std::size_t before = bench.robot.speeds_m_s.size();
  mover.Fast({20.0, 0.0, 2.0}, "transfer", {{{8.0, 9.0}}});
  ASSERT_EQ(bench.robot.speeds_m_s.size(), before + 2);
  EXPECT_EQ(bench.robot.speeds_m_s[before], bench.options.transfer_speed_m_s);
  EXPECT_LT(bench.robot.speeds_m_s[before + 1], bench.options.transfer_speed_m_s);
  ASSERT_GE(bench.record.moves.size(), 2u);
  const MoveRecord& inner = bench.record.moves.back();
  EXPECT_NEAR(inner.commanded_m, 3.0 * bench.frame.cell_m, 1e-9);
  ASSERT_TRUE(inner.predicted_m);
  EXPECT_NEAR((*inner.predicted_m)[0], 1.0 * bench.frame.cell_m, 1e-9) << "counted from where the second begins";
  // Nothing is gained where the way does not come from well outside, or is fast anyway.
  mover.Retreat({20.0, 0.0, 5.5});
  std::size_t count = bench.robot.speeds_m_s.size();
  bench.record.careful = true;
  mover.Fast({20.0, 0.0, 2.0}, "transfer");
  EXPECT_EQ(bench.robot.speeds_m_s.size(), count + 1);
  mover.TrustAgain();
  mover.Retreat({20.0, 0.0, 12.0});
  count = bench.robot.speeds_m_s.size();
  mover.Fast({20.0, 0.0, 2.0}, "transfer");
  EXPECT_EQ(bench.robot.speeds_m_s.size(), count + 1);
}

// After a surprise a long way beside the target goes out, over and in: only what lies below is slow. A short one, one
// that stays below by much, or one without a surprise goes straight.
TEST(Mover, LongWaysAfterASurprisePassOverTheTarget) {
  const auto ways = [](int startled, const Eigen::Vector3d& to) {
    Bench bench(1.0);
    bench.robot.meets = false;
    bench.record.startled = startled;
    Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
    mover.KeepClearOf(3.0);
    EXPECT_FALSE(mover.Fast(to, "transfer").contact);
    EXPECT_EQ(mover.position(), to);
    return bench.robot.speeds_m_s;
  };
  const double fast_m_s = ExecutorOptions{}.transfer_speed_m_s;
  const std::vector<double> over = ways(2, {20.0, 5.0, 1.0});
  ASSERT_EQ(over.size(), 3u);
  EXPECT_LT(over[0], fast_m_s);
  EXPECT_EQ(over[1], fast_m_s);
  EXPECT_LT(over[2], fast_m_s);
  const std::vector<double> out = ways(2, {20.0, 0.0, 4.0});
  ASSERT_EQ(out.size(), 2u);
  EXPECT_LT(out[0], fast_m_s);
  EXPECT_EQ(out[1], fast_m_s);
  EXPECT_EQ(ways(2, {4.0, 0.0, 0.0}).size(), 1u) << "short";
  {
    Bench bench(1.0);
    bench.robot.meets = false;
    Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
    mover.Retreat({0.0, 0.0, 6.0});
    mover.KeepClearOf(3.0);
    bench.record.startled = 2;
    const std::size_t before = bench.robot.speeds_m_s.size();
    mover.Fast({20.0, 5.0, 1.0}, "transfer");
    ASSERT_EQ(bench.robot.speeds_m_s.size(), before + 2) << "from outside: over, and in";
    EXPECT_EQ(bench.robot.speeds_m_s[before], fast_m_s);
    EXPECT_LT(bench.robot.speeds_m_s[before + 1], fast_m_s);
  }
  EXPECT_EQ(ways(2, {20.0, 0.0, -15.0}).size(), 1u) << "deep";
  EXPECT_EQ(ways(0, {20.0, 5.0, 1.0}).size(), 1u) << "no surprise";
}

// The robot of the bench says so where one is none: after a surprise ways are judged at edges slanted to them.
TEST(Mover, AsksForContactsAlongUnitVectors) {
  Bench bench(1.0);
  bench.robot.stiff_n_m = Eigen::Vector3d(2e4, 2e4, 9e4);
  for (const Eigen::Vector3d& to : {Eigen::Vector3d(-5.0, 4.0, 6.6), Eigen::Vector3d(0.0, 3.0, -3.0)}) {
    bench.record.startled = 1;
    Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
    mover.Fast(mover.position() + to, "transfer");
    EXPECT_LT(bench.robot.speeds_m_s.back(), bench.options.transfer_speed_m_s);
  }
}

TEST(Mover, RecoveryKeepsWithinTheBudgetFromItsStart) {
  Bench bench(1.0);
  bench.record.FallBack("refit", "off the policy tree");
  Mover mover(bench.robot, bench.frame, Direction::kMinusZ, bench.options, bench.record, 0.0);
  mover.Fast({4.0, 0.0, 0.0}, "transfer");
  EXPECT_LE(bench.record.moves.back().peak_force_n, 20.0);
  mover.Insert({4.0, 0.0, -6.0}, bench.options.transfer_speed_m_s, false);
  EXPECT_LE(bench.record.moves.back().peak_force_n, 20.0) << "nor is a way in known to be free";
}

}  // namespace
}  // namespace feeler::execution
