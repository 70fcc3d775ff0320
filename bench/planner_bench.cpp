// Speed of the planner on a plug-like task (tests/planner/synthetic_plug.h): expansions per second, contact-map
// look-ups, the experience heuristic, the tables, the whole family.

#include <benchmark/benchmark.h>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/preprocess.h"
#include "feeler/planner/search/experience.h"
#include "feeler/planner/solve.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

struct Plug {
  Task task = testing::MakePlugTask();
  std::shared_ptr<const ContactMap> map = testing::MakePlugMap();
  std::shared_ptr<const PlanningTables> fast =
      BuildPlanningTables(MakeCuboidProblem(task, map, {2, 2, 2}), FastSetting(SolverKind::kRtdpBel, 1.2));
  std::shared_ptr<const PlanningTables> paper =
      BuildPlanningTables(MakeCuboidProblem(task, map, {2, 2, 2}), PaperSetting(SolverKind::kRtdpBel, 2.0));
};

const Plug& ThePlug() {
  static const Plug plug;
  return plug;
}

Extents Cube(const benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  return {n, n, n};
}

void ContactMapLookUp(benchmark::State& state) {
  const ContactMap& map = *ThePlug().map;
  int i = 0;
  for (auto _ : state) {
    const Cell cell(i % 37 - 18, i % 29 - 14, i % 23);
    benchmark::DoNotOptimize(map.Travel(cell, kDirections[static_cast<std::size_t>(i % kDirectionCount)]));
    ++i;
  }
}
BENCHMARK(ContactMapLookUp);

/// Breadth-first growth of the belief graph from the start: heuristic included, no search on top. The worst case: near
/// the start beliefs hold thousands of hypotheses, and the heuristic looks at each. Searches soon come to small
/// beliefs.
void BreadthFirstExpansions(benchmark::State& state) {
  const Problem problem = MakeCuboidProblem(ThePlug().task, ThePlug().map, Cube(state));
  std::int64_t expansions = 0;
  for (auto _ : state) {
    BeliefGraph graph(problem, ThePlug().fast->masks(), true);
    const auto heuristic = ThePlug().fast->MakeHeuristic(problem, graph.sets());
    graph.SetHeuristic(heuristic.get());
    graph.Start();
    for (BeliefId b = 0; b < std::min<std::size_t>(graph.size(), 20000); ++b) {
      benchmark::DoNotOptimize(graph.Actions(b).size());
      ++expansions;
    }
  }
  state.counters["expansions/s"] = benchmark::Counter(static_cast<double>(expansions), benchmark::Counter::kIsRate);
}
BENCHMARK(BreadthFirstExpansions)->Arg(3)->Arg(7)->Arg(15)->Unit(benchmark::kMillisecond);

void SolveRtdpBel(benchmark::State& state) {
  const Problem problem = MakeCuboidProblem(ThePlug().task, ThePlug().map, Cube(state));
  const SolverOptions options = FastSetting(SolverKind::kRtdpBel, 1.0 + 0.01 * static_cast<double>(state.range(1)));
  std::int64_t expansions = 0;
  for (auto _ : state) expansions += Solve(problem, options, ThePlug().fast).expansions;
  state.counters["expansions/s"] = benchmark::Counter(static_cast<double>(expansions), benchmark::Counter::kIsRate);
}
BENCHMARK(SolveRtdpBel)->Args({7, 20})->Args({7, 5})->Args({15, 20})->Args({15, 15})->Unit(benchmark::kMillisecond);

void ExperienceHeuristicPass(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  const Problem similar = MakeCuboidProblem(ThePlug().task, ThePlug().map, {n, n, n - 1});
  const Problem problem = MakeCuboidProblem(ThePlug().task, ThePlug().map, {n, n, n});
  const SolverResult solved = Solve(similar, FastSetting(SolverKind::kRtdpBel, 1.2), ThePlug().fast);
  for (auto _ : state) {
    BeliefGraph graph(problem, ThePlug().paper->masks(), false);
    const auto heuristic = ThePlug().paper->MakeHeuristic(problem, graph.sets());
    graph.SetHeuristic(heuristic.get());
    const ExperienceHeuristic experience(graph, RollOut(graph, *solved.policy), 2.0, JumpKind::kSameHypotheses);
    state.counters["beliefs"] = static_cast<double>(experience.values().size());
    state.counters["sweeps"] = experience.sweeps();
  }
}
BENCHMARK(ExperienceHeuristicPass)->Arg(5)->Arg(9)->Arg(15)->Unit(benchmark::kMillisecond);

/// The paper setting: E-RTDP-Bel with the policy of a neighbour, experience pass included; 0: RTDP-Bel.
void SolvePaperSetting(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  const bool experienced = state.range(1) != 0;
  const Problem similar = MakeCuboidProblem(ThePlug().task, ThePlug().map, {n, n, n - 1});
  const Problem problem = MakeCuboidProblem(ThePlug().task, ThePlug().map, {n, n, n});
  const SolverOptions options =
      PaperSetting(experienced ? SolverKind::kERtdpBel : SolverKind::kRtdpBel, static_cast<double>(state.range(2)));
  const SolverResult solved = Solve(similar, FastSetting(SolverKind::kRtdpBel, 1.2), ThePlug().fast);
  const Experience experience = {ExperienceKind::kRollout, &similar, &*solved.policy};
  std::int64_t expansions = 0;
  for (auto _ : state) {
    const SolverResult result = Solve(problem, options, ThePlug().paper, experience);
    expansions += result.expansions;
    state.counters["expansions"] = static_cast<double>(result.expansions);
  }
  state.counters["expansions/s"] = benchmark::Counter(static_cast<double>(expansions), benchmark::Counter::kIsRate);
}
BENCHMARK(SolvePaperSetting)
    ->ArgNames({"n", "experience", "epsilon"})
    ->Args({7, 0, 2})
    ->Args({7, 1, 2})
    ->Args({11, 0, 5})
    ->Args({11, 1, 5})
    ->Args({15, 1, 5})
    ->Unit(benchmark::kMillisecond);

void BuildTables(benchmark::State& state) {
  const SolverOptions options =
      state.range(0) == 0 ? FastSetting(SolverKind::kRtdpBel, 1.2) : PaperSetting(SolverKind::kRtdpBel, 2.0);
  const Problem problem = MakeCuboidProblem(ThePlug().task, ThePlug().map, {2, 2, 2});
  for (auto _ : state) benchmark::DoNotOptimize(BuildPlanningTables(problem, options));
}
BENCHMARK(BuildTables)->ArgName("paper")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

class CountingSink : public PolicySink {
 public:
  bool Done(const Extents& /*extents*/) override { return false; }
  std::optional<PolicyGraph> Load(const Extents& /*extents*/) override { return std::nullopt; }
  void Store(const Extents& /*extents*/, const Problem& /*problem*/, const SolverResult& result) override {
    cost += result.expected_cost;
    worst_ratio = std::max(worst_ratio, result.Ratio());
  }
  double cost = 0.0;
  double worst_ratio = 0.0;
};

void WholeFamily(benchmark::State& state) {
  PreprocessOptions options;
  options.solver = FastSetting(SolverKind::kCertified, 1.2);
  options.solver.gap = 1.2;
  options.jobs = Parallelism(static_cast<int>(state.range(0)));
  options.tables = ThePlug().fast;
  for (auto _ : state) {
    CountingSink sink;
    const PreprocessSummary summary =
        Preprocess(ThePlug().task, ThePlug().map, FamilyOf(ThePlug().task), options, sink);
    state.counters["cpu_s"] = summary.cpu_s;
    state.counters["mean_cost"] = sink.cost / static_cast<double>(summary.complete);
    state.counters["worst_ratio"] = sink.worst_ratio;
  }
}
BENCHMARK(WholeFamily)->ArgName("jobs")->Arg(1)->Arg(2)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();

}  // namespace
}  // namespace feeler::planner
