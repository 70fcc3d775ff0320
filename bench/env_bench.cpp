// Speed of the simulated world on the plug scene: environment steps against raw mj_step, vectors of environments on one
// and two threads, resets, memory, a scripted episode, contact queries and planned transfers.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <memory>
#include <vector>

#include "feeler/core/clock.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/gym/vector_env.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/robot/transfer_checker.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {
namespace {

std::shared_ptr<const Scene> PlugScene() {
  static const auto scene = std::make_shared<const Scene>(BuildScene(LoadTask("plug")));
  return scene;
}

ResetOptions Known(double aside_m = 0.0) {
  ResetOptions options;
  options.world_T_target = PlugScene()->task.world_T_target;
  options.world_T_target->translation().x() += aside_m;
  return options;
}

GuardedMoveAction Along(const Eigen::Vector3d& direction, double distance_m) {
  GuardedMoveAction action;
  action.motion.direction = direction;
  action.motion.distance_m = distance_m;
  action.motion.contact_force_n = 10.0;
  return action;
}

// Free over the target, or resting on its housing.
void Bring(InsertionEnv& env, bool contact) {
  env.Reset(1, Known(contact ? 0.02 : 0.0));
  LowLevelAction press;
  press.steps = 200;
  if (contact) {
    env.Step(Along(-Eigen::Vector3d::UnitZ(), 0.04));
    press.delta.z() = -0.002;
  }
  env.Step(press);
}

constexpr int kTurn = 200;  ///< steps

void RawStep(benchmark::State& state) {
  InsertionEnv env(PlugScene());
  Bring(env, state.range(0) != 0);
  const mjModel* model = PlugScene()->model.get();
  const DataHandle data = MakeData(*model);
  int steps = 0;
  for (auto _ : state) {
    // The torques that hold it are those of one moment: before it drifts off, back to the start.
    if (steps++ % kTurn == 0) mj_copyData(data.get(), model, &env.robot().world().data());
    mj_step(model, data.get());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(RawStep)->ArgName("contact")->Arg(0)->Arg(1);

/// One physics step an action: control, sensing, observation, verdict and all.
void ControlStep(benchmark::State& state) {
  EnvOptions options;
  options.limits = LimitsOf(PlugScene()->task);
  options.limits->time_s = 1e9;
  InsertionEnv env(PlugScene(), options);
  Bring(env, state.range(0) != 0);
  const LowLevelAction still;
  for (auto _ : state) benchmark::DoNotOptimize(env.Step(still));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(ControlStep)->ArgName("contact")->Arg(0)->Arg(1);

/// The rate of wrapped physics steps over the rate of mj_step from the same state with the same torques, measured in
/// turns, the fastest of many turns each. `steps` an action.
void WrappedOverRaw(benchmark::State& state) {
  EnvOptions options;
  options.limits = LimitsOf(PlugScene()->task);
  options.limits->time_s = 1e9;
  InsertionEnv env(PlugScene(), options);
  Bring(env, state.range(0) != 0);
  LowLevelAction still;
  still.steps = static_cast<int>(state.range(1));
  const mjModel* model = PlugScene()->model.get();
  const DataHandle data = MakeData(*model);
  const DataHandle start = MakeData(*model);
  mj_copyData(start.get(), model, &env.robot().world().data());
  double raw_s = 1e9;
  double wrapped_s = 1e9;
  for (auto _ : state) {
    mj_copyData(data.get(), model, start.get());
    double begin_s = ThreadCpuSeconds();
    for (int i = 0; i < kTurn; ++i) mj_step(model, data.get());
    raw_s = std::min(raw_s, (ThreadCpuSeconds() - begin_s) / kTurn);
    const int actions = std::max(1, kTurn / still.steps);
    begin_s = ThreadCpuSeconds();
    for (int i = 0; i < actions; ++i) benchmark::DoNotOptimize(env.Step(still));
    wrapped_s = std::min(wrapped_s, (ThreadCpuSeconds() - begin_s) / (actions * still.steps));
  }
  state.counters["raw_us"] = 1e6 * raw_s;
  state.counters["wrapped_us"] = 1e6 * wrapped_s;
  state.counters["ratio"] = raw_s / wrapped_s;
}
BENCHMARK(WrappedOverRaw)
    ->ArgNames({"contact", "steps"})
    ->ArgsProduct({{0, 1}, {1, 20}})
    ->Unit(benchmark::kMillisecond);

void VectorStep(benchmark::State& state) {
  VectorEnvOptions options;
  options.environments = 32;
  options.threads = Parallelism(static_cast<int>(state.range(0)));
  options.env.limits = LimitsOf(PlugScene()->task);
  options.env.limits->time_s = 1e9;
  VectorEnv envs(PlugScene(), options);
  envs.Reset(1);
  LowLevelAction still;
  still.steps = static_cast<int>(state.range(1));
  const std::vector<Action> actions(static_cast<std::size_t>(envs.size()), still);
  for (auto _ : state) envs.Step(actions);
  state.SetItemsProcessed(state.iterations() * envs.size() * still.steps);
}
BENCHMARK(VectorStep)->ArgNames({"threads", "steps"})->ArgsProduct({{1, 2}, {1, 20}})->UseRealTime();

void Reset(benchmark::State& state) {
  InsertionEnv env(PlugScene());
  ResetOptions options;
  for (auto _ : state) {
    ++options.episode;
    benchmark::DoNotOptimize(env.Reset(1, options));
  }
}
BENCHMARK(Reset)->Unit(benchmark::kMicrosecond);

void SaveAndRestore(benchmark::State& state) {
  InsertionEnv env(PlugScene());
  Bring(env, true);
  for (auto _ : state) env.Restore(env.Save());
}
BENCHMARK(SaveAndRestore)->Unit(benchmark::kMicrosecond);

/// What an environment adds to the shared scene.
void Memory(benchmark::State& state) {
  const mjModel& model = *PlugScene()->model;
  for (auto _ : state) {
    const DataHandle data = MakeData(model);
    state.counters["data_MB"] = 1e-6 * static_cast<double>(data->nbuffer + data->nstack * sizeof(mjtNum));
    state.counters["model_MB"] = 1e-6 * static_cast<double>(model.nbuffer);  // once; again only where physics varies
    // World and transfer checker.
    state.counters["environment_MB"] =
        1e-6 * (2.0 * (static_cast<double>(data->nbuffer) + static_cast<double>(data->nstack * sizeof(mjtNum))) +
                2.0 * static_cast<double>(model.nbuffer));
  }
}
BENCHMARK(Memory)->Iterations(1);

/// Reset, down onto the housing, aside, insertion from over the mouth: what an episode costs without its policy.
void ScriptedEpisode(benchmark::State& state) {
  InsertionEnv env(PlugScene());
  double simulated_s = 0.0;
  for (auto _ : state) {
    env.Reset(1, Known());
    env.Step(Along(Eigen::Vector3d::UnitX(), 0.02));
    env.Step(Along(-Eigen::Vector3d::UnitZ(), 0.04));
    env.Step(Along(Eigen::Vector3d::UnitZ(), 0.005));
    TransferAction above;
    above.world_T_tool = PlugScene()->task.world_T_target;
    above.world_T_tool.translation().z() += 0.003;
    above.straight = true;
    env.Step(above);
    simulated_s += env.Step(InsertAction{}).info.sim_time_s;
  }
  state.counters["simulated_s"] = benchmark::Counter(simulated_s, benchmark::Counter::kAvgIterations);
}
BENCHMARK(ScriptedEpisode)->Unit(benchmark::kMillisecond);

void ValidityCheck(benchmark::State& state) {
  TransferChecker checker(*PlugScene());
  RandomStream random(1, 0, "bench");
  std::vector<JointVector> places;
  for (int i = 0; i < 256; ++i) {
    JointVector q = PlugScene()->home_q_rad;
    for (double& angle : q) angle += random.Uniform(-0.5, 0.5);
    places.push_back(q);
  }
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(checker.Free(places[i++ % places.size()]));
  state.counters["checks/s"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(ValidityCheck);

/// OMPL between random places over the table, away from the straight way.
void PlannedTransfer(benchmark::State& state) {
  TransferChecker checker(*PlugScene());
  RandomStream random(1, 0, "bench");
  std::int64_t planned = 0;
  std::int64_t checks = 0;
  JointVector start = PlugScene()->home_q_rad;
  for (auto _ : state) {
    const Pose goal = MakePose({random.Uniform(0.45, 0.85), random.Uniform(-0.3, 0.3), random.Uniform(0.28, 0.45)},
                               Eigen::Quaterniond(PlugScene()->task.world_T_target.linear()));
    const planner::TransferPlan plan = PlanTransfer(checker, *PlugScene(), start, goal);
    checks += plan.checks;
    if (!plan.planned()) continue;
    ++planned;
    start = plan.way_points.back();
  }
  const auto n = static_cast<double>(state.iterations());
  state.counters["planned"] = static_cast<double>(planned) / n;
  state.counters["checks/s"] = benchmark::Counter(static_cast<double>(checks), benchmark::Counter::kIsRate);
}
BENCHMARK(PlannedTransfer)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace feeler::env
