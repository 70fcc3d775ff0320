// Laws of Tag: in a dead end the opponent is cornered and caught for what the way costs; the opponent flees along both
// axes with the probabilities of the description; plans that are none are refused.
#include "feeler/planner/pomdp/model/tag.h"

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"

namespace feeler::planner {
namespace {

double Probability(const Pomdp& pomdp, std::size_t action, std::size_t from, std::size_t to) {
  double sum = 0.0;
  for (const SparseEntry& e : pomdp.transitions.Row(pomdp.At(action, from))) sum += e.index == to ? e.value : 0.0;
  return sum;
}

TEST(Tag, InADeadEndTheOpponentIsCaught) {
  const Pomdp pomdp = MakeTag({{"R.."}, 0.95});
  EXPECT_EQ(pomdp.state_count(), 10U);
  EXPECT_EQ(pomdp.observation_count(), 7U);
  PomdpSolverOptions options;
  options.precision = 1e-4;
  options.time_limit_s = 20.0;
  const PomdpResult result = SolvePomdp(pomdp, options);
  // Two steps east and a tag, whatever it does; halfway the robot may see it and tag at once: between these two.
  const double g = 0.95;
  EXPECT_GT(result.value_lower, -1.0 - g + g * g * 10.0 - 1e-3);
  EXPECT_LT(result.value_upper, -1.0 + g * 10.0);
}

TEST(Tag, TheOpponentFlees) {
  const Pomdp pomdp = MakeTag({{"...", ".R.", "..."}, 0.95});
  constexpr std::size_t kTagging = 4;
  const std::size_t here = 4;    // row by row
  const std::size_t beside = 5;  // to the east
  // East of the robot: away along x is a wall, along y it may be either side.
  EXPECT_NEAR(Probability(pomdp, kTagging, here * 9 + beside, here * 9 + beside), 0.6, 1e-12);
  EXPECT_NEAR(Probability(pomdp, kTagging, here * 9 + beside, here * 9 + 2), 0.2, 1e-12);
  EXPECT_NEAR(Probability(pomdp, kTagging, here * 9 + beside, here * 9 + 8), 0.2, 1e-12);
  EXPECT_NEAR(Probability(pomdp, kTagging, here * 9 + here, 81), 1.0, 1e-12);
  // A move north from the middle, the opponent below it: away is down, into the wall.
  EXPECT_NEAR(Probability(pomdp, 0, here * 9 + 7, 1 * 9 + 7), 0.6, 1e-12);
}

TEST(Tag, PlansThatAreNoneAreRefused) {
  for (const std::vector<std::string>& plan :
       {std::vector<std::string>{"R", ".."}, {"..."}, {"R.R"}, {"R"}, {"R?"}, std::vector<std::string>{}}) {
    EXPECT_THROW(MakeTag({plan, 0.95}), InputError);
  }
}

}  // namespace
}  // namespace feeler::planner
