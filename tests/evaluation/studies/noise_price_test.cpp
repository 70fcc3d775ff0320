// Laws of the price of noise: without noise both policies cost the same; the policy that knows of the noise costs no
// more than the one that does not by more than its gap, and no less than the bound; a second run measures nothing
// again.
#include "feeler/evaluation/studies/noise_price.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "feeler/planner/belief/lattice_problem.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

TEST(NoisePrice, KnowingOfItPays) {
  const std::string folder = testing::TempDir() + "/feeler_noise_price";
  fs::remove_all(folder);
  fs::create_directories(folder);
  planner::LatticeProblemData data;
  data.name = "corner";
  data.size = Cell(6, 6, 1);
  data.start = Cell(0, 5, 0);
  data.tool = {Cell::Zero()};
  data.target = {Cell(1, 1, 0), Cell(2, 1, 0), Cell(1, 2, 0)};
  data.hypotheses = {{Cell(0, 0, 0), 0, 1.0}, {Cell(1, 0, 0), 0, 1.0}, {Cell(1, 1, 0), 0, 1.0}};
  ExperimentRequest request;
  request.out = folder;
  request.jobs = Parallelism(1);
  NoisePriceProtocol protocol;
  protocol.levels = {0.0, 0.05};
  protocol.expansion_limit = 300;
  const auto run = [&] { return RunNoisePriceOn({{"corner", planner::MakeLatticeProblem(data)}}, protocol, request); };
  const ExperimentResult result = run();
  ASSERT_TRUE(result.complete);
  const auto column = [&](std::size_t row, const std::string& name) {
    const auto at = std::ranges::find(result.table.columns, name);
    return result.table.rows.at(row).at(static_cast<std::size_t>(at - result.table.columns.begin())).get<double>();
  };
  ASSERT_EQ(result.table.rows.size(), 6U);
  for (std::size_t row = 0; row < 6; ++row) {
    const bool noisy = column(row, "level") > 0.0;
    EXPECT_LE(column(row, "lower"), column(row, "cost") + 1e-9);
    EXPECT_LE(column(row, "cost"), column(row, "unaware_cost") * protocol.gap + 1e-9);
    if (!noisy) {
      EXPECT_NEAR(column(row, "unaware_right"), 1.0, 1e-9);
    }
  }
  ASSERT_EQ(result.figures.size(), 2U);
  EXPECT_EQ(result.figures[0].series.size(), 6U);
  EXPECT_EQ(run().table.rows, result.table.rows);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace feeler::evaluation
