// Laws of noisy problems of up to 36 hypotheses, against an independent solver (point_based_judge.h), which shares no
// code with the planner:
// - its interval and that of the certified solver overlap, whatever probability a declaration needs less than what the
//   best policy has anyway; a policy that must be surer costs no less than its lower bound;
// - the values of both are equal within 1 %.
// The tests take a few problems; FEELER_NOISE_JUDGE=1 takes all, and prints a line for each.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "feeler/core/clock.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "tests/planner/noise/lattices.h"
#include "tests/planner/noise/point_based_judge.h"

namespace feeler::planner {
namespace {

constexpr double kGap = 1.01;
constexpr double kWrong = 100.0;
constexpr int kTrials = 4000;
const std::vector<Noise> kNoises = {
    {0.02, 0.0, 0.0}, {0.0, 0.02, 0.0}, {0.0, 0.0, 0.02}, {0.02, 0.01, 0.01}, {0.05, 0.05, 0.05}};

LatticeProblemData Weighted() {
  LatticeProblemData data = WallWithSlot(4, 3);
  data.name = "wall, weights";
  data.cost.per_contact = 0.5;
  for (Hypothesis& h : data.hypotheses) h.weight = 1.0 + 4.0 * (h.offset.x() == 2) + 2.0 * (h.offset.y() == 1);
  return data;
}

bool All() { return std::getenv("FEELER_NOISE_JUDGE") != nullptr; }

void ExpectSameValue(const LatticeProblemData& data, const Noise& noise) {
  const double begin_s = ThreadCpuSeconds();
  testing::PointBasedJudge judge(data, noise, kWrong);
  const testing::PointBasedJudge::Interval own = judge.Solve(kGap, kTrials);
  const double judge_s = ThreadCpuSeconds() - begin_s;
  EXPECT_LE(own.upper, kGap * own.lower) << "the judge does not know";
  for (const double confidence : {0.6, 0.99}) {
    const NoisyProblem noisy{MakeLatticeProblem(data), noise, {confidence, kWrong}};
    SolverOptions options;
    options.gap = kGap;
    options.expansion_limit = 100'000;
    const NoisyResult result = SolveNoisy(noisy, options);
    const double cost = result.evaluation.expected_cost;
    if (All()) {
      fmt::print(
          "{}, {} hypotheses, m {:g} f {:g} s {:g}, p {:g}: [{:.3f}, {:.3f}] in {:.1f} s, judge [{:.3f}, {:.3f}] "
          "in {:.1f} s\n",
          data.name, data.hypotheses.size(), noise.missed_contact, noise.false_stop, noise.slip, confidence,
          result.lower_bound, cost, result.cpu_s, own.lower, own.upper, judge_s);
      std::fflush(stdout);
    }
    SCOPED_TRACE(::testing::Message() << data.name << ", confidence " << confidence << ": " << result.lower_bound
                                      << " to " << cost << ", judge " << own.lower << " to " << own.upper);
    EXPECT_LE(result.Ratio(), kGap + 1e-6);
    EXPECT_LE(own.lower, cost + 1e-6);
    EXPECT_LE(cost, kGap * own.upper);
    EXPECT_LE(own.upper, kGap * cost);
    if (confidence < 0.9) {
      EXPECT_LE(result.lower_bound, own.upper + 1e-6);
    }
  }
}

TEST(IndependentValue, NineHypotheses) {
  for (const Noise& noise : kNoises) ExpectSameValue(WallWithSlot(3, 3), noise);
}

TEST(IndependentValue, WeightsAndCostsOfContacts) {
  for (const Noise& noise : kNoises) {
    if (All() || noise.slip > 0.0) ExpectSameValue(Weighted(), noise);
  }
}

TEST(IndependentValue, SixteenHypotheses) {
  for (const Noise& noise : kNoises) ExpectSameValue(WallWithSlot(4, 4), noise);
}

TEST(IndependentValue, TwentySevenHypotheses) {
  for (const Noise& noise : kNoises) {
    if (All() || noise == Noise{0.02, 0.0, 0.0} || noise == Noise{0.0, 0.0, 0.02}) ExpectSameValue(Pocket(), noise);
  }
}

TEST(IndependentValue, ThirtySixHypotheses) {
  for (const Noise& noise : kNoises) {
    if (All() || noise == Noise{0.02, 0.0, 0.0}) ExpectSameValue(PlainBlock(), noise);
  }
}

}  // namespace
}  // namespace feeler::planner
