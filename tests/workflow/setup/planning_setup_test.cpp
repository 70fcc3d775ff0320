// What costs count. Laws: seconds are those of the task's times, field by field, and grow with each of them; a slower
// arm makes every cell dearer; wrong times are an InputError that names the field; a setup for seconds has another
// fingerprint than one for distance; the identity of a database gives back the setup it was made for, and its unit.

#include "feeler/workflow/setup/planning_setup.h"

#include <gtest/gtest.h>

#include "feeler/core/error.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/planner/family/preprocess.h"
#include "feeler/workflow/setup/contact_speeds.h"
#include "feeler/workflow/setup/database_builder.h"
#include "tests/env/task_text.h"

namespace feeler::workflow {
namespace {

Task Load(const env::TaskText& text) { return env::LoadTaskFromText(text.Mjcf(), "peg.xml").task; }

TEST(TimeCost, FollowsTheTimesOfTheTask) {
  env::TaskText text;
  EXPECT_EQ(Load(text).times, MotionTimes{});
  const CostWeights usual = TimeCost(Load(text));
  text.numbers["feeler_time_per_move"] = "0.5";
  text.numbers["feeler_time_per_contact"] = "0.25";
  CostWeights cost = TimeCost(Load(text));
  EXPECT_EQ(cost, (CostWeights{usual.per_cell, 0.25, 0.5}));
  // At one speed everywhere a cell takes its length by the speed.
  text.numbers["feeler_transfer_speed"] = "0.1";
  text.numbers["feeler_probe_speed"] = "0.1";
  cost = TimeCost(Load(text));
  EXPECT_NEAR(cost.per_cell, 0.002 / 0.1, 1e-12);
  text.numbers["feeler_probe_speed"] = "0.05";
  const CostWeights slower = TimeCost(Load(text));
  EXPECT_GT(slower.per_cell, cost.per_cell);
  EXPECT_LT(slower.per_cell, 0.002 / 0.05);
}

TEST(TimeCost, ACellAlongASlowAxisCostsMore) {
  Task task = Load(env::TaskText());
  ContactSpeeds speeds;
  speeds.speed_m_s = {1.0, 1.0, 1.0};
  EXPECT_EQ(TimeCost(task, speeds), TimeCost(task)) << "one number keeps every bit";
  speeds.speed_m_s = {0.05, 0.06, 0.0102};
  const CostWeights cost = TimeCost(task, speeds);
  EXPECT_FALSE(cost.one_per_cell());
  EXPECT_NEAR(cost.PerCell(0), TimeCost(task).per_cell, 1e-8);
  EXPECT_NEAR(cost.PerCell(0), cost.PerCell(1), 1e-8);
  Task slow = task;
  slow.times.probe_speed_m_s = 0.94 * 0.0102;
  EXPECT_NEAR(cost.PerCell(2), TimeCost(slow).per_cell, 1e-8);
  EXPECT_EQ(CostPerAxis({cost.PerCell(0), cost.PerCell(1), cost.PerCell(2)}, cost.per_contact, cost.per_action), cost)
      << "what a database keeps gives the same costs, bit by bit";
}

TEST(NominalContactSpeeds, ThePlugIsHardAlongItsInsertion) {
  const env::TaskModel plug = env::LoadTask("plug");
  const auto speeds = NominalContactSpeeds(plug, 25.0);
  ASSERT_TRUE(speeds);
  EXPECT_NEAR(speeds->force_per_speed_n_s_m[2], 2150.0, 300.0);
  EXPECT_GT(speeds->speed_m_s[0], 2.0 * speeds->speed_m_s[2]) << "across it is softer";
  EXPECT_LE(WorstPredictedForce(*speeds, 0.05), 25.0);
  const auto twice = NominalContactSpeeds(plug, 50.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(twice->speed_m_s[axis], 2.0 * speeds->speed_m_s[axis], 2.1e-4) << axis;
  }
}

TEST(TimeCost, WrongTimesNameTheirField) {
  for (const auto& [field, value] : {std::pair{"feeler_transfer_speed", "0"},
                                     {"feeler_probe_speed", "-1"},
                                     {"feeler_time_per_move", "-0.1"},
                                     {"feeler_time_per_contact", "0.1 0.2"}}) {
    env::TaskText text;
    text.numbers[field] = value;
    try {
      Load(text);
      ADD_FAILURE() << field << " = " << value << " accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
    }
  }
}

TEST(CostUnit, ADatabaseKnowsItsOwn) {
  for (const CostKind kind : {CostKind::kDistance, CostKind::kTime}) {
    PlanningSetup setup;
    setup.model = env::LoadTaskFromText(env::TaskText().Mjcf(), "peg.xml");
    setup.cost_kind = kind;
    if (kind == CostKind::kTime) setup.model.task.cost = TimeCost(setup.task());
    const policies::DatabaseIdentity identity = IdentityOf(setup, planner::PreprocessOptions());
    EXPECT_EQ(CostUnit(identity), kind == CostKind::kTime ? "s" : "cells");
    EXPECT_EQ(CostUnit(identity), CostUnit(kind, setup.task().cost));
    const PlanningSetupOptions options = SetupOptionsOf(identity);
    EXPECT_EQ(options.cost_kind, kind);
    EXPECT_EQ(options.cost, setup.task().cost);
    EXPECT_EQ(options.opening, setup.opening);
    EXPECT_EQ(options.goal, setup.task().goal);
  }
  EXPECT_EQ(CostUnit(CostKind::kDistance, {1.0, 5.0, 0.0}), "weighted");
  const env::TaskModel distance = env::LoadTaskFromText(env::TaskText().Mjcf(), "peg.xml");
  env::TaskModel time = distance;
  time.task.cost = TimeCost(time.task);
  EXPECT_NE(env::Fingerprint(distance, env::Opening::kClosed), env::Fingerprint(time, env::Opening::kClosed));
}

}  // namespace
}  // namespace feeler::workflow
