// Transfers among obstacles: checks of one configuration per second, and planning between poses on both sides of them.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <string>
#include <vector>

#include "feeler/core/clock.h"
#include "feeler/core/random.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/robot/transfer_checker.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {
namespace {

constexpr const char* kScenes[] = {"table", "fixtures", "pillar", "wall"};

const Scene& SceneOf(std::size_t index) {
  static const std::vector<Scene> scenes = [] {
    std::vector<Scene> all;
    for (const char* name : kScenes) {
      all.push_back(BuildScene(LoadTask((ModelsFolder() / "scenes" / (std::string(name) + ".xml")).string())));
    }
    return all;
  }();
  return scenes[index];
}

Pose RandomPose(RandomStream& random) {
  return MakePose(Eigen::Vector3d(random.Uniform(0.4, 0.85), random.Uniform(-0.45, 0.45), random.Uniform(0.05, 0.5)),
                  random.Uniform(-3.0, 3.0));
}

/// Random configurations: items per second are checks per second.
void BM_ValidityCheck(benchmark::State& state) {
  const Scene& scene = SceneOf(static_cast<std::size_t>(state.range(0)));
  TransferChecker checker(scene);
  RandomStream random(1, 0, "bench");
  std::vector<JointVector> samples(1000);
  for (JointVector& q : samples) {
    for (double& angle : q) angle = random.Uniform(-3.14, 3.14);
  }
  std::size_t next = 0;
  int free = 0;
  for (auto _ : state) {
    free += checker.Free(samples[next]) ? 1 : 0;
    next = (next + 1) % samples.size();
  }
  state.SetItemsProcessed(state.iterations());
  state.counters["free"] = static_cast<double>(free) / static_cast<double>(state.iterations());
  state.SetLabel(kScenes[state.range(0)]);
}

/// A chain of plans to random poses, each from where the last one ended. Times are spread over three decades: see the
/// median.
void BM_PlanTransfer(benchmark::State& state) {
  const Scene& scene = SceneOf(static_cast<std::size_t>(state.range(0)));
  TransferChecker checker(scene);
  RandomStream random(2, 0, "bench");
  JointVector start = scene.home_q_rad;
  double checks = 0.0;
  int planned = 0;
  std::vector<double> times_ms;
  for (auto _ : state) {
    TransferSettings settings;
    settings.seed = random.Next();
    const double begun_ms = 1e3 * ThreadCpuSeconds();
    const planner::TransferPlan plan = PlanTransfer(checker, scene, start, RandomPose(random), settings);
    times_ms.push_back(1e3 * ThreadCpuSeconds() - begun_ms);
    checks += plan.checks;
    if (!plan.planned()) continue;
    ++planned;
    start = plan.way_points.back();
  }
  std::nth_element(times_ms.begin(), times_ms.begin() + static_cast<std::ptrdiff_t>(times_ms.size() / 2),
                   times_ms.end());
  state.counters["median_ms"] = times_ms[times_ms.size() / 2];
  state.counters["checks"] = checks / static_cast<double>(state.iterations());
  state.counters["planned"] = static_cast<double>(planned) / static_cast<double>(state.iterations());
  state.SetLabel(kScenes[state.range(0)]);
}

BENCHMARK(BM_ValidityCheck)->DenseRange(0, 3)->Unit(benchmark::kMicrosecond);
BENCHMARK(BM_PlanTransfer)->DenseRange(0, 3)->Iterations(60)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace feeler::env
