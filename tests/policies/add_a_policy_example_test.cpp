// The example of docs/add-a-policy.md compiles and does what the page says; the page shows this text.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "feeler/policies/touch/kinematic_walk.h"
#include "tests/policies/block_problem.h"

// clang-format off
// example begins
#include <map>
#include <tuple>
#include <utility>

#include "feeler/policies/policy.h"

namespace feeler::policies {

/// Halves the hypotheses: the guarded move whose most likely outcome is the least likely; among equals the shortest.
class Halving final : public Policy {
 public:
  std::string_view name() const override { return "halving"; }
  void Begin(const planner::Problem& problem) override { problem_ = &problem; }
  Decision Next(const Belief& belief) override {
    if (planner::IsGoal(*problem_, belief.hypotheses)) return Insert{};
    GuardedMove best;
    double least = 2.0;
    for (const Direction direction : kDirections) {
      for (int cells = 1; cells <= 16; ++cells) {
        const GuardedMove move{direction, cells};
        if (!problem_->workspace.Contains(belief.robot + cells * UnitCell(direction))) break;
        const double likeliest = LikeliestOutcome(belief, move) + 1e-6 * cells;
        if (likeliest < least) std::tie(best, least) = std::pair(move, likeliest);
      }
    }
    if (least >= 1.0) return GiveUp{"no single move tells anything"};
    return best;
  }
  bool Observe(const Outcome& /*outcome*/) override { return true; }  // the next belief says it all

 private:
  double LikeliestOutcome(const Belief& belief, const GuardedMove& move) const {
    std::map<std::pair<int, bool>, double> weight;
    double total = 0.0, most = 0.0;
    for (const Hypothesis& h : belief.hypotheses) {
      const Outcome outcome = planner::Simulate(*problem_, belief.robot, move, h);
      most = std::max(most, weight[{outcome.cells, outcome.contact}] += h.weight);
      total += h.weight;
    }
    return most / total;
  }
  const planner::Problem* problem_ = nullptr;
};

}  // namespace feeler::policies
// example ends
// clang-format on

namespace {

std::string Read(const std::string& path) {
  std::ifstream file(std::string(FEELER_SOURCE_DIR) + path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(AddAPolicyPage, ShowsAnExampleThatRuns) {
  using namespace feeler;
  // Along z alone one probe tells everything; across, it takes more than one move to get anywhere: it says so.
  const planner::Problem tall = policies::SmallBlockProblem({1, 1, 5});
  policies::Halving policy;
  for (const planner::Hypothesis& truth : tall.hypotheses) {
    EXPECT_TRUE(policies::Walk(tall, policy, truth).localized);
  }
  const planner::Problem flat = policies::SmallBlockProblem({2, 2, 1});
  const auto walk = policies::Walk(flat, policy, flat.hypotheses[0]);
  EXPECT_EQ(walk.reason, "gave up: no single move tells anything");

  std::string source = Read("/tests/policies/add_a_policy_example_test.cpp");
  source.erase(0, source.find("// example begins\n") + 18);
  source.erase(source.find("// example ends"));
  EXPECT_NE(Read("/docs/add-a-policy.md").find("```cpp\n" + source + "```"), std::string::npos);
}

}  // namespace
