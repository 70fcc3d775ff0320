// Laws of the model of a job on ranks: no schedule beats the work over the ranks, the longest piece or the commits of
// rank 0; on one rank all add up; without commits, largest first is within the longest piece of the optimum (Graham
// 1969); equal pieces that divide evenly waste nothing; the same pieces give the same forecast.
#include "feeler/workflow/scale/job_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "feeler/core/random.h"

namespace feeler::workflow {
namespace {

JobModel RandomModel(std::uint64_t seed, std::size_t pieces, double commit_s) {
  RandomStream random(seed, 0, "job model test");
  JobModel model{.piece_s = {}, .start_s = random.Uniform(0.0, 2.0), .commit_s = commit_s, .message_s = 0.0};
  for (std::size_t i = 0; i < pieces; ++i) {
    const double u = random.Uniform(0.0, 1.0);
    model.piece_s.push_back(0.01 + u * u * u * u);
  }
  std::ranges::sort(model.piece_s, std::greater());
  return model;
}

class JobModelLaws : public ::testing::TestWithParam<int> {};

TEST_P(JobModelLaws, HoldForAnyPieces) {
  const int ranks = GetParam();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const double commit_s : {0.0, 0.002, 0.2}) {
      const JobModel model = RandomModel(seed, 20 + 37 * seed, commit_s);
      const JobForecast forecast = Simulate(model, ranks);
      const double work_s = std::accumulate(model.piece_s.begin(), model.piece_s.end(), 0.0);
      const auto pieces = static_cast<double>(model.piece_s.size());
      EXPECT_NEAR(forecast.work_s, work_s, 1e-9);
      EXPECT_GE(forecast.wall_s + 1e-9, model.start_s + work_s / ranks);
      EXPECT_GE(forecast.wall_s + 1e-9, model.start_s + model.piece_s.front() + commit_s);
      EXPECT_GE(forecast.wall_s + 1e-9, model.start_s + commit_s * pieces);
      EXPECT_LE(forecast.efficiency, 1.0 + 1e-9);
      if (ranks == 1) {
        EXPECT_NEAR(forecast.wall_s, model.start_s + work_s + commit_s * pieces, 1e-9);
      }
      if (commit_s == 0.0) {  // two pieces fetched at once may add one more
        EXPECT_LE(forecast.wall_s, model.start_s + work_s / ranks + 2 * model.piece_s.front() + 1e-9);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Ranks, JobModelLaws, ::testing::Values(1, 2, 3, 64));

TEST(JobModel, EqualPiecesThatDivideEvenlyWasteNothing) {
  const JobModel model{.piece_s = std::vector<double>(640, 0.5), .start_s = 0.0, .commit_s = 0.0, .message_s = 0.0};
  EXPECT_NEAR(Simulate(model, 64).efficiency, 1.0, 1e-9);
  EXPECT_NEAR(Simulate(model, 64).wall_s, 5.0, 1e-9);
}

TEST(JobModel, NoPiecesTakeTheStart) {
  EXPECT_EQ(Simulate({.piece_s = {}, .start_s = 3.0, .commit_s = 1.0, .message_s = 0.0}, 8).wall_s, 3.0);
}

}  // namespace
}  // namespace feeler::workflow
