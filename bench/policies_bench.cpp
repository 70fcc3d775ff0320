// Latency online: opening a database, looking up the policy of a problem (cold: in a database just opened; warm), the
// next move of a policy. The database holds the cubes of 2..12 hypotheses of a plug-like task.

#include <benchmark/benchmark.h>

#include <filesystem>
#include <memory>
#include <string>

#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"
#include "feeler/policies/storage/database.h"
#include "feeler/policies/touch/touch_based_localization.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::policies {
namespace {

constexpr int kLargest = 12;

struct Stored {
  Stored() : path((std::filesystem::temp_directory_path() / "feeler_policies_bench.db").string()) {
    std::filesystem::remove(path);
    DatabaseIdentity identity;
    identity.task = task.name;
    identity.opening = "closed";
    identity.goal = "singleton";
    Database database = Database::Create(path, identity);
    planner::SolverOptions options;
    const auto tables = planner::BuildPlanningTables(Problem(2), options);
    for (int n = 2; n <= kLargest; ++n) {
      const planner::SolverResult result = planner::Solve(Problem(n), options, tables);
      StoredProblem stored;
      stored.extents = {n, n, n};
      stored.status = ToString(result.status);
      stored.solver = ToString(options.solver);
      stored.epsilon = options.gap;
      stored.expected_cost = result.expected_cost;
      stored.lower_bound = result.lower_bound;
      stored.expansions = result.expansions;
      stored.policy = result.policy;
      database.Put(stored);
    }
  }
  ~Stored() { std::filesystem::remove(path); }
  planner::Problem Problem(int n) const { return planner::MakeCuboidProblem(task, map, {n, n, n}); }

  Task task = planner::testing::MakePlugTask();
  std::shared_ptr<const planner::ContactMap> map = planner::testing::MakePlugMap();
  std::string path;
};

const Stored& TheDatabase() {
  static const Stored stored;
  return stored;
}

void DatabaseOpen(benchmark::State& state) {
  const std::string& path = TheDatabase().path;
  for (auto _ : state) {
    const Database database = Database::OpenReadOnly(path);
    benchmark::DoNotOptimize(database.identity());
  }
}
BENCHMARK(DatabaseOpen)->Unit(benchmark::kMicrosecond);

void ColdLookUp(benchmark::State& state) {
  const std::string& path = TheDatabase().path;
  const int n = static_cast<int>(state.range(0));
  for (auto _ : state) {
    Database database = Database::OpenReadOnly(path);
    benchmark::DoNotOptimize(database.Get({n, n, n}));
  }
}
BENCHMARK(ColdLookUp)->Arg(3)->Arg(kLargest)->Unit(benchmark::kMicrosecond);

void WarmLookUp(benchmark::State& state) {
  Database database = Database::OpenReadOnly(TheDatabase().path);
  const int n = static_cast<int>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(database.Get({n, n, n}));
}
BENCHMARK(WarmLookUp)->Arg(3)->Arg(kLargest)->Unit(benchmark::kMicrosecond);

/// Next and Observe over whole episodes, the truth being each hypothesis in turn.
void NextMove(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  Database database = Database::OpenReadOnly(TheDatabase().path);
  const planner::Problem problem = TheDatabase().Problem(n);
  DatabasePolicy policy(std::make_shared<const planner::PolicyGraph>(*database.Get({n, n, n})->policy));
  std::int64_t moves = 0;
  std::size_t truth = 0;
  for (auto _ : state) {
    policy.Begin(problem);
    Belief belief{problem.start, problem.hypotheses};
    for (Decision decision = policy.Next(belief); std::holds_alternative<GuardedMove>(decision);
         decision = policy.Next(belief)) {
      const GuardedMove move = std::get<GuardedMove>(decision);
      const Outcome outcome = planner::Simulate(problem, belief.robot, move, problem.hypotheses[truth]);
      policy.Observe(outcome);
      belief.robot += outcome.cells * UnitCell(move.direction);
      ++moves;
    }
    truth = (truth + 1) % problem.hypotheses.size();
  }
  state.counters["s/move"] =
      benchmark::Counter(static_cast<double>(moves), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(NextMove)->Arg(3)->Arg(kLargest)->Unit(benchmark::kMicrosecond);

/// One planning step of touch-based localization, 100 sampled actions, from the start belief of n^3 hypotheses.
void TouchPlanningStep(benchmark::State& state) {
  const planner::Problem problem = TheDatabase().Problem(static_cast<int>(state.range(0)));
  TouchOptions options;
  options.region = std::make_shared<const planner::ActiveRegion>(*problem.map);
  TouchBasedLocalization policy(options, nullptr, 1, 0);
  policy.Begin(problem);
  const Belief belief{problem.start, problem.hypotheses};
  for (auto _ : state) benchmark::DoNotOptimize(policy.Choose(belief));
}
BENCHMARK(TouchPlanningStep)->Arg(3)->Arg(kLargest)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace feeler::policies
