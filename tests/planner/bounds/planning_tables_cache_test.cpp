// Law: tables from the cache give every belief the bound that tables built for a problem covering it give, whatever was
// asked for before: another heuristic, solver, map, cost, move lengths, goal, spread, or another lattice problem.
// Tables that serve are shared, not built again.

#include "feeler/planner/bounds/planning_tables_cache.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/options/solver_options.h"
#include "tests/planner/random_problems.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

double StartBound(const Problem& problem, const PlanningTables& tables) {
  HypothesisSets sets(problem, false);
  const auto set = sets.Find(problem.hypotheses);
  return tables.MakeHeuristic(problem, sets)->Weighted(*set, problem.start);
}

struct Asked {
  Problem problem;
  SolverOptions options;
};

/// Asks for all in turn, twice, and compares with tables of their own.
void ExpectOwnBounds(const std::vector<Asked>& all) {
  PlanningTablesCache cache;
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      SCOPED_TRACE(i);
      const auto own = BuildPlanningTables(all[i].problem, all[i].options);
      const auto cached = cache.TablesFor(all[i].problem, all[i].options);
      EXPECT_DOUBLE_EQ(StartBound(all[i].problem, *cached), StartBound(all[i].problem, *own));
      EXPECT_EQ(cache.TablesFor(all[i].problem, all[i].options), cached);
    }
  }
}

TEST(PlanningTablesCacheTest, ServesWhatWasAskedFor) {
  const Task task = testing::MakePlugTask();
  Asked plain{MakeCuboidProblem(task, testing::MakePlugMap(false, {6, 5, 4}), {4, 3, 3}), SolverOptions()};
  plain.problem.cost.per_action = 0.5;
  std::vector<Asked> all = {plain};
  const auto add = [&](const std::function<void(Asked&)>& change) {
    all.push_back(plain);
    change(all.back());
  };
  add([](Asked& a) { a.options.heuristic = HeuristicKind::kFirstContact; });
  add([](Asked& a) { a.options.heuristic = HeuristicKind::kLines; });
  add([](Asked& a) { a.problem.move_lengths = {1}; });
  add([](Asked& a) { a.problem.cost.per_action = 2.0; });
  add([&](Asked& a) { a.problem.map = testing::MakePlugMap(false, {5, 6, 4}); });
  for (const int spread : {1, 2}) {
    add([&](Asked& a) {
      a.problem.goal = GoalKind::kInsertable;
      a.problem.insertable_spread = Cell(spread, spread, 0);
    });
  }
  ExpectOwnBounds(all);
}

TEST(PlanningTablesCacheTest, CuboidsGrowWithTheProblem) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {6, 5, 4});
  SolverOptions options;
  options.heuristic = HeuristicKind::kCuboids;
  ExpectOwnBounds(
      {{MakeCuboidProblem(task, map, {2, 2, 2}), options}, {MakeCuboidProblem(task, map, {4, 3, 2}), options}});
}

TEST(PlanningTablesCacheTest, LatticeProblemsHaveTheirOwn) {
  std::vector<Asked> all;
  const Problem problem = MakeLatticeProblem(testing::RandomProblem(7, 0, {}));
  all.push_back({problem, SolverOptions()});
  Problem fewer = problem;  // the same map
  fewer.hypotheses.erase(fewer.hypotheses.begin());
  all.push_back({fewer, SolverOptions()});
  ExpectOwnBounds(all);
}

TEST(PlanningTablesCacheTest, SharesTablesThatServe) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {6, 5, 4});
  PlanningTablesCache cache;
  const auto tables = cache.TablesFor(MakeCuboidProblem(task, map, {4, 3, 3}), SolverOptions());
  EXPECT_EQ(cache.TablesFor(MakeCuboidProblem(task, map, {2, 2, 2}), SolverOptions()), tables);
  SolverOptions limited;
  limited.gap = 1.5;
  limited.expansion_limit = 10;
  EXPECT_EQ(cache.TablesFor(MakeCuboidProblem(task, map, {9, 9, 9}), limited), tables);
}

}  // namespace
}  // namespace feeler::planner
