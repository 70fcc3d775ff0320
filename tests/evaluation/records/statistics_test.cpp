// Laws: Wilson's interval contains the rate, lies in [0, 1], solves its defining equation |p - q| = z sqrt(q (1-q) / n)
// at both ends, and shrinks with n; quantiles interpolate order statistics; CSV survives quoting.
#include "feeler/evaluation/records/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/evaluation/harness/experiment_output.h"

namespace feeler::evaluation {
namespace {

TEST(WilsonRate, EndsSolveTheScoreEquation) {
  constexpr double kZ = 1.959963984540054;
  for (const int trials : {1, 7, 50, 1000}) {
    for (int successes = 0; successes <= trials; successes += std::max(1, trials / 7)) {
      const Rate rate = WilsonRate(successes, trials);
      EXPECT_LE(rate.low, rate.value);
      EXPECT_GE(rate.high, rate.value);
      for (const double q : {rate.low, rate.high}) {
        EXPECT_NEAR(std::abs(rate.value - q), kZ * std::sqrt(q * (1 - q) / trials), 1e-9);
      }
    }
  }
  EXPECT_THROW(WilsonRate(3, 2), InputError);
  EXPECT_THROW(WilsonRate(-1, 2), InputError);
}

TEST(Quantile, InterpolatesOrderStatistics) {
  EXPECT_DOUBLE_EQ(Median({3, 1, 2}), 2);
  EXPECT_DOUBLE_EQ(Median({4, 1, 2, 3}), 2.5);
  EXPECT_DOUBLE_EQ(Quantile({10, 20, 30, 40, 50}, 0.95), 48);
  EXPECT_DOUBLE_EQ(Quantile({}, 0.5), 0);
}

TEST(Bootstrap, CoversTheTruthAboutAsOftenAsItSays) {
  int covered = 0;
  constexpr int kSamples = 200;
  for (std::uint64_t k = 0; k < kSamples; ++k) {
    RandomStream random(1, k, "bootstrap test");
    std::vector<double> values;
    for (int i = 0; i < 60; ++i) values.push_back(random.Uniform());
    const Estimate median = BootstrapMedian(values);
    EXPECT_DOUBLE_EQ(median.value, Median(values));
    EXPECT_LE(median.low, median.value);
    EXPECT_GE(median.high, median.value);
    covered += median.low <= 0.5 && 0.5 <= median.high ? 1 : 0;
  }
  EXPECT_GT(covered, kSamples * 0.90);
  EXPECT_LT(covered, kSamples);
}

TEST(Bootstrap, IsAFunctionOfTheValuesAndKeepsPairs) {
  const std::vector<double> values = {4, 1, 3, 9, 2};
  EXPECT_EQ(BootstrapMean(values).low, BootstrapMean(values).low);
  EXPECT_DOUBLE_EQ(BootstrapMean(values).value, 3.8);
  // Pairs in a fixed ratio have that ratio in every resample.
  const Estimate ratio = BootstrapRatio({8, 2, 6, 18, 4}, values);
  EXPECT_DOUBLE_EQ(ratio.low, 2.0);
  EXPECT_DOUBLE_EQ(ratio.high, 2.0);
  EXPECT_EQ(BootstrapMedian({}).high, 0.0);
  EXPECT_THROW(BootstrapRatio({1}, {1, 2}), InputError);
}

TEST(WriteExperiment, WritesTableDetailsAndManifest) {
  const std::string folder = testing::TempDir() + "/feeler_experiment_test";
  std::filesystem::remove_all(folder);
  WriteExperiment(folder, "table", {{"solver", "cost"}, {{"a,b", 1.5}, {"say \"x\"", nullptr}}}, {{"note", "n"}},
                  {"feeler experiment table", {{"epsilon", 2}}, {1, 2}});
  std::ifstream csv(folder + "/table.csv");
  const std::string text((std::istreambuf_iterator<char>(csv)), {});
  EXPECT_EQ(text, "solver,cost\n\"a,b\",1.5\n\"say \"\"x\"\"\",\n");
  std::ifstream manifest_file(folder + "/manifest.json");
  const auto manifest = nlohmann::json::parse(manifest_file);
  for (const char* key : {"version", "command", "settings", "seeds", "machine"})
    EXPECT_TRUE(manifest.contains(key)) << key;
  Figure figure{"f", "x", "y", true, false, {{"a", {{1, 2, 1.5, 2.5}}}}};
  WriteExperiment(folder, "plot", {{"x"}, {}}, {}, {}, {figure});
  std::ifstream plot_file(folder + "/plot.json");
  const auto plot = nlohmann::json::parse(plot_file);
  EXPECT_EQ(plot["figures"][0]["series"][0]["points"][0],
            (nlohmann::json{{"x", 1.0}, {"y", 2.0}, {"low", 1.5}, {"high", 2.5}}));
  EXPECT_EQ(plot["figures"][0]["x_log"], true);
  EXPECT_THROW(WriteExperiment(folder, "bad", {{"one"}, {{1, 2}}}, {}, {}), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder + "/bad.csv"));
}

}  // namespace
}  // namespace feeler::evaluation
