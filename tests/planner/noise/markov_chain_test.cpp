// Laws of expected sums along a chain: they satisfy x = at + P x whether states go round or not, in small and in
// large components; what goes round without a way out comes to what is said.
#include "feeler/planner/noise/markov_chain.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace feeler::planner {
namespace {

TEST(MarkovChain, RoundAndOut) {
  MarkovChain chain;  // 0 <-> 1 -> 2 (end), 0 -> 0
  chain.AddState();
  chain.AddStep(0, 0.25);
  chain.AddStep(1, 0.75);
  chain.AddState();
  chain.AddStep(0, 0.5);
  chain.AddStep(2, 0.5);
  chain.AddState();
  const std::vector<double> x = chain.ExpectedSums({1.0, 2.0, 7.0}, 0.0);
  EXPECT_NEAR(x[0], 1.0 + 0.25 * x[0] + 0.75 * x[1], 1e-12);
  EXPECT_NEAR(x[1], 2.0 + 0.5 * x[0] + 0.5 * x[2], 1e-12);
  EXPECT_EQ(x[2], 7.0);
}

TEST(MarkovChain, WithoutAWayOut) {
  MarkovChain chain;  // 0 -> 1 <-> 2, 0 -> 3 -> 3
  chain.AddState();
  chain.AddStep(1, 0.5);
  chain.AddStep(3, 0.5);
  chain.AddState();
  chain.AddStep(2, 1.0);
  chain.AddState();
  chain.AddStep(1, 1.0);
  chain.AddState();
  chain.AddStep(3, 1.0);
  const std::vector<double> x = chain.ExpectedSums({1.0, 0.0, 0.0, 0.0}, 100.0);
  EXPECT_EQ(x, (std::vector<double>{101.0, 100.0, 100.0, 100.0}));
}

/// Forth nine times of ten, else back, to the end behind the last.
TEST(MarkovChain, LargeComponents) {
  for (const std::uint32_t n : {10U, 300U}) {
    MarkovChain chain;
    for (std::uint32_t k = 0; k < n; ++k) {
      chain.AddState();
      chain.AddStep(k + 1, k == 0 ? 1.0 : 0.9);
      if (k > 0) chain.AddStep(k - 1, 0.1);
    }
    chain.AddState();
    std::vector<double> at(n + std::size_t{1}, 1.0);
    at.back() = 0.0;
    const std::vector<double> x = chain.ExpectedSums(at, 0.0);
    EXPECT_NEAR(x[0], 1.0 + x[1], 1e-9);
    for (std::uint32_t k = 1; k < n; ++k) EXPECT_NEAR(x[k], 1.0 + 0.9 * x[k + 1] + 0.1 * x[k - 1], 1e-9) << k;
  }
}

}  // namespace
}  // namespace feeler::planner
