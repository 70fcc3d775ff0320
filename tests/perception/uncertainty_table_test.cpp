// Laws: a cuboid covers a truth iff every axis does (coverage is joint, judged against a count by hand); the rules made
// from samples hold the wanted share of them, take a constant bias out, and cover fresh samples of the same kind;
// taking the bias out never needs more hypotheses here than leaving it in; estimates of one rule have one cuboid, and
// the family is exactly the set of cuboids met; a table survives the way through its file bit for bit; one of another
// version or task is refused.
#include "feeler/perception/uncertainty_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "feeler/core/error.h"
#include "feeler/core/random.h"

namespace feeler::perception {
namespace {

const Eigen::Vector3d kCamera(1.4, -0.5, 1.2);

UncertaintyTable EmptyTable() {
  UncertaintyTable table;
  table.task = "plug";
  table.fingerprint = "abc";
  table.axes = {{AxisKind::kX}, {AxisKind::kY}, {AxisKind::kZ}};
  table.camera_m = kCamera;
  table.averaged_frames = 10;
  table.limits = {0.6, 0.07, 0.02, 0.0005};
  return table;
}

/// Estimates that lie 6 mm too far along the view, and err by a noise that grows with distance.
std::vector<PoseSample> Samples(int count, std::uint64_t seed) {
  std::vector<PoseSample> samples;
  for (int i = 0; i < count; ++i) {
    RandomStream random(seed, static_cast<std::uint64_t>(i), "sample");
    PoseSample sample;
    sample.world_T_true = MakePose({random.Uniform(0.2, 1.0), random.Uniform(-0.5, 0.5), random.Uniform(0.0, 0.6)},
                                   random.Uniform(-0.2, 0.2));
    const Eigen::Vector3d p = sample.world_T_true.translation();
    const double sigma = 0.001 * (p - kCamera).squaredNorm();
    sample.world_T_estimate = sample.world_T_true;
    sample.world_T_estimate.translation() += 0.006 * ViewAxes(kCamera, p).col(0) +
                                             sigma * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
    samples.push_back(sample);
  }
  return samples;
}

UncertaintyTable FittedTable() {
  UncertaintyTable table = EmptyTable();
  FitRules(Samples(800, 1), {}, table);
  return table;
}

TEST(UncertaintyTable, CoverageIsJoint) {
  const std::vector<UncertainAxis> axes = EmptyTable().axes;
  const PoseHypotheses hypotheses{MakePose(Eigen::Vector3d(0.5, 0, 0.2), 0.3), {4, 4, 4}, 0, false};
  RandomStream random(3, 0, "offsets");
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d offset(random.Uniform(-0.006, 0.006), random.Uniform(-0.006, 0.006),
                                 random.Uniform(-0.006, 0.006));
    const bool inside = offset.cwiseAbs().maxCoeff() <= 0.004;  // 4 hypotheses, 2 mm apart, half a cell around
    EXPECT_EQ(Covers(axes, hypotheses, hypotheses.world_T_estimate * Eigen::Translation3d(offset)), inside);
  }
}

TEST(UncertaintyTable, CountsCoverTheHalfExtents) {
  const std::vector<UncertainAxis> axes = {{AxisKind::kX, 0.002, 2, 15}, {AxisKind::kYaw, 0.05, 1, 7}};
  bool clamped = true;
  EXPECT_EQ(CountsFor(axes, Eigen::Vector2d(0.0061, 0.11), &clamped), (std::vector<int>{7, 6}));
  EXPECT_FALSE(clamped);
  EXPECT_EQ(CountsFor(axes, Eigen::Vector2d(0.0, 0.0)), (std::vector<int>{2, 1}));
  EXPECT_EQ(CountsFor(axes, Eigen::Vector2d(0.1, 0.0), &clamped), (std::vector<int>{15, 1}));
  EXPECT_TRUE(clamped);
}

TEST(UncertaintyTable, FreshSamplesAreCovered) {
  const UncertaintyTable table = FittedTable();
  const std::vector<PoseSample> fresh = Samples(1000, 2);
  const TableScore corrected = ScoreTable(table, table.rules, fresh);
  const TableScore plain = ScoreTable(table, table.plain_rules, fresh);
  EXPECT_GE(corrected.covered, 990);
  EXPECT_GE(plain.covered, 985);
  EXPECT_LT(corrected.mean_hypotheses, plain.mean_hypotheses);
  for (const UncertaintyRule& rule : table.rules) {
    EXPECT_NEAR(rule.bias_m.x(), 0.006, 0.0008);
    EXPECT_NEAR(rule.bias_m.y(), 0.0, 0.0008);
  }
  EXPECT_LT(table.rules.front().half.maxCoeff(), table.rules.back().half.maxCoeff());
}

TEST(UncertaintyTable, TheFamilyIsWhatCanBeMet) {
  const UncertaintyTable table = FittedTable();
  std::set<std::vector<int>> met;
  for (const PoseSample& sample : Samples(500, 4)) met.insert(HypothesesFor(table, sample.world_T_estimate).counts);
  const std::vector<std::vector<int>> family = FamilyOf(table);
  EXPECT_EQ(std::set(family.begin(), family.end()), met);
}

TEST(UncertaintyTable, SurvivesItsFile) {
  const UncertaintyTable table = FittedTable();
  const std::string text = ToJson(table, R"({"note": 1})");
  const UncertaintyTable read = ParseTable(text, "table.json");
  EXPECT_EQ(ToJson(read, R"({"note": 1})"), text);
  for (const PoseSample& sample : Samples(50, 5)) {
    EXPECT_EQ(HypothesesFor(read, sample.world_T_estimate).world_T_estimate.matrix(),
              HypothesesFor(table, sample.world_T_estimate).world_T_estimate.matrix());
  }
}

TEST(UncertaintyTable, KnowsItsDeviations) {
  const UncertaintyTable table = FittedTable();
  // Errors grow with the square of the distance; the table's deviation is that of what it was made from.
  double sum = 0.0;
  const std::vector<PoseSample> samples = Samples(800, 1);
  for (const PoseSample& sample : samples) {
    const double distance = (sample.world_T_true.translation() - kCamera).norm();
    sum += std::pow(0.001 * distance * distance, 2);
  }
  const double expected = std::sqrt(sum / static_cast<double>(samples.size()));
  const std::vector<double> deviation = PriorDeviation(table);
  ASSERT_EQ(deviation.size(), 3u);
  for (const double d : deviation) EXPECT_NEAR(d, expected, 0.15 * expected);
  EXPECT_LT(table.rules.front().deviation.maxCoeff(), table.rules.back().deviation.minCoeff());
  EXPECT_EQ(PriorDeviation(ParseTable(ToJson(table), "table.json")), deviation);
  UncertaintyTable old = table;
  old.rules.front().deviation.resize(0);
  EXPECT_TRUE(PriorDeviation(ParseTable(ToJson(old), "table.json")).empty());
}

TEST(UncertaintyTable, OtherVersionsAndTasksAreRefused) {
  UncertaintyTable table = FittedTable();
  std::string text = ToJson(table);
  text.replace(text.find("\"version\": 1"), 12, "\"version\": 9");
  try {
    ParseTable(text, "table.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("version 9"));
  }
  Task task;
  task.name = "pipe";
  EXPECT_THROW(RequireTask(table, task, "def", "table.json"), InputError);
  EXPECT_NO_THROW(RequireTask(table, task, "abc", "table.json"));
  EXPECT_THROW(FitRules(Samples(19, 1), {}, table), InputError);
  FitRules(Samples(45, 1), {}, table);
  EXPECT_EQ(table.rules.size(), 2U);
}

}  // namespace
}  // namespace feeler::perception
