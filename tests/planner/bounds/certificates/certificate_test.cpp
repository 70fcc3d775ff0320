// Law: the certificate of a belief is the weighted sum over its hypotheses of the table's entries, wherever the tool
// is: the sums by rows that a uniform prior takes, inside the grid and far beyond each of its sides, are those that a
// prior takes one by one which differs from it by next to nothing.

#include "feeler/planner/bounds/certificates/certificate.h"

#include <gtest/gtest.h>

#include "feeler/core/random.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

TEST(Certificates, RowsAndSinglesComeToTheSame) {
  const auto map = testing::MakePlugMap(false, Cell(5, 4, 3), 2);
  Problem uniform;
  uniform.map = map;
  uniform.workspace = {Cell(-200, -200, -200), Cell(200, 200, 200)};
  uniform.start = Cell(0, 0, 30);
  uniform.generous_workspace = true;
  for (int x = 0; x < 5; ++x) {
    for (int y = 0; y < 4; ++y) {
      for (int z = 0; z < 3; ++z) uniform.hypotheses.push_back({Cell(x, y, z), 0, 1.0});
    }
  }
  Problem almost = uniform;
  almost.hypotheses.front().weight = 1.0 + 1e-9;
  const PlanningTables tables(uniform, SolverOptions());
  HypothesisSets sets(uniform, false);
  HypothesisSets almost_sets(almost, false);
  ASSERT_TRUE(sets.uniform());
  ASSERT_FALSE(almost_sets.uniform());
  const auto heuristic = tables.MakeHeuristic(uniform, sets);
  const auto one_by_one = tables.MakeHeuristic(almost, almost_sets);
  RandomStream random(1, 0, "certificates");
  int beyond = 0;
  for (int i = 0; i < 3000; ++i) {
    std::vector<Hypothesis> members;
    std::vector<Hypothesis> almost_members;
    const double keep = random.Uniform(0.1, 1.0);
    for (std::size_t h = 0; h < uniform.hypotheses.size(); ++h) {
      if (random.Uniform() > keep) continue;
      members.push_back(uniform.hypotheses[h]);
      almost_members.push_back(almost.hypotheses[h]);
    }
    if (members.empty()) continue;
    const int reach = i % 2 == 0 ? 20 : 90;
    const auto coordinate = [&] {
      return static_cast<int>(random.Index(static_cast<std::uint64_t>(2 * reach + 1))) - reach;
    };
    const Cell robot(coordinate(), coordinate(), coordinate());
    beyond += robot.cwiseAbs().maxCoeff() > 60 ? 1 : 0;
    const double expected = one_by_one->Weighted(*almost_sets.Find(almost_members), robot);
    const double value = heuristic->Weighted(*sets.Find(members), robot);
    if (std::isinf(expected)) {
      EXPECT_TRUE(std::isinf(value));
    } else {
      ASSERT_NEAR(value, expected, 1e-6 * (1.0 + expected)) << robot.transpose();
    }
  }
  EXPECT_GT(beyond, 500);
}

}  // namespace
}  // namespace feeler::planner
