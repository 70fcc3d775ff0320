// Laws of bounds of graded strength:
// - the less of the certificates is taken, the farther the bound lies below the optimum, in proportion; every bound has
//   every row, and the figures have a curve for each;
// - a second run measures nothing again.
#include "feeler/evaluation/studies/graded_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

TEST(GradedBounds, GradeInProportionAndResume) {
  const std::string folder = testing::TempDir() + "/feeler_graded_bounds";
  fs::remove_all(folder);
  fs::create_directories(folder);
  ExperimentRequest request;
  request.out = folder;
  request.jobs = Parallelism(1);
  GradedBoundsProtocol protocol;
  protocol.family = "2..3x2..3x2..3";
  protocol.strata = 2;
  protocol.per_stratum = 1;
  protocol.shares = {0.5, 1.0};
  protocol.expansion_limit = 2000;
  const ExperimentResult result = RunGradedBoundsOf(protocol, request);
  ASSERT_TRUE(result.complete);
  const auto column = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(result.table.columns, name) - result.table.columns.begin());
  };
  std::map<std::string, double> ratios;
  for (const auto& row : result.table.rows) {
    ratios[row[column("bound")].get<std::string>()] = row[column("optimum_over_bound")].get<double>();
  }
  ASSERT_EQ(ratios.size(), 4U);
  EXPECT_NEAR(ratios.at("certificates 0.5"), 2.0 * ratios.at("certificates 1"), 1e-6);
  EXPECT_GT(ratios.at("first contact"), ratios.at("lines"));
  EXPECT_EQ(result.table.rows.size(), 4U * 9U);
  ASSERT_EQ(result.figures.size(), 3U);
  EXPECT_EQ(result.figures[0].series.size(), 8U) << "four rows and their printed values";
  ExperimentRequest again = request;
  EXPECT_EQ(RunGradedBoundsOf(protocol, again).table.rows, result.table.rows);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace feeler::evaluation
