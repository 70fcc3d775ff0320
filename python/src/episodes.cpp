// Seeded episodes in simulation: feeler.run.
#include "episodes.h"

#include <fmt/format.h>

#include <cmath>
#include <mutex>

#include "common.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/evaluation/records/episode_json.h"
#include "feeler/evaluation/records/run_summary.h"
#include "feeler/policies/database_policy.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/perception/perceive_table.h"
#include "feeler/workflow/setup/policy_registry.h"
#include "robot.h"

namespace feeler::python {
workflow::PolicyFactory FactoryFor(const nb::object& policy, const std::shared_ptr<policies::Database>& database,
                                   const std::vector<std::string>& options, const std::shared_ptr<Raised>& raised) {
  std::string name;
  if (nb::try_cast(policy, name)) {
    return workflow::MakePolicyFactory(name, database, workflow::ParsePolicyOptions(options));
  }
  if (nb::isinstance<BoundPolicy>(policy)) {
    return [graph = nb::cast<const BoundPolicy&>(policy).graph](const workflow::PolicyRequest&) {
      return std::make_unique<policies::DatabasePolicy>(graph);
    };
  }
  return [held = Held(policy), raised](const workflow::PolicyRequest& request) -> std::unique_ptr<policies::Policy> {
    const nb::gil_scoped_acquire acquired;
    try {
      nb::object made = (*held).attr("_for_episode")(request.seed, request.episode);
      return PolicyFromPython(std::move(made), raised);
    } catch (...) {
      raised->Keep();
      throw InputError("policy", "raised an exception");
    }
  };
}

namespace {

std::shared_ptr<const workflow::EpisodePerception> PerceptionFor(const std::string& table,
                                                                 const workflow::PlanningSetup& setup) {
  workflow::EpisodePerception perception;
  perception.table = workflow::LoadTable(table, setup.task(), env::Fingerprint(setup.model, env::Opening::kClosed));
  perception.finder =
      std::make_shared<const workflow::TargetFinder>(setup.model, workflow::SettingsOf(perception.table));
  return std::make_shared<const workflow::EpisodePerception>(std::move(perception));
}

nb::tuple Run(PlanningTask& task, const nb::object& policy, const std::shared_ptr<policies::Database>& database,
              const std::vector<std::string>& policy_options, std::int64_t episodes, std::int64_t first,
              std::uint64_t seed, const nb::object& extents, const std::string& noise, const std::string& placement,
              const std::string& table, std::optional<double> force_budget_n, double wrist_stiffness_n_m,
              std::optional<bool> ladder, bool withhold_true_pose, bool replay, const nb::object& robot, int jobs,
              CancellationToken* outer, const nb::object& on_record, const nb::object& progress) {
  if (episodes < 1) throw InputError("episodes", "are " + std::to_string(episodes), "give 1 or more");
  if (first < 0) throw InputError("first", "is " + std::to_string(first), "give 0 or more");
  CancellationToken own;
  CancellationToken& token = outer != nullptr ? *outer : own;
  auto raised = std::make_shared<Raised>();
  std::string name;
  const bool named = nb::try_cast(policy, name);
  const workflow::PolicyFactory factory = FactoryFor(policy, database, policy_options, raised);
  workflow::ParseFaults(noise);
  workflow::EpisodeOptions options;
  options.placement = workflow::ParsePlacement(placement);
  const auto setup = task.Setup(jobs, nb::none());
  if (database) database->RequireFingerprint(setup->task().name, setup->fingerprint);
  options.seed = seed;
  options.family = workflow::FamilyToDrawFrom(ExtentsText(extents), database.get(), setup->task());
  options.noise = noise;
  if (!table.empty()) options.perception = PerceptionFor(table, *setup);
  if (force_budget_n && !(*force_budget_n > 0.0 && std::isfinite(*force_budget_n))) {
    throw InputError("force_budget", fmt::format("is {:g}", *force_budget_n), "give newtons, above 0, or None");
  }
  options.force_budget_n = force_budget_n;
  env::SceneOptions scene_options;
  scene_options.wrist_stiffness_n_m = wrist_stiffness_n_m;
  options.ladder = ladder.value_or(!named || workflow::UsesLadder(name));
  options.replay = replay;
  options.withhold_true_pose = withhold_true_pose;
  if (!robot.is_none()) {
    if (replay)
      throw InputError("replay", "is of the simulated robot, and another one drives", "leave out one of them");
    options.wrap_robot = [held = Held(robot), raised](env::SimulatedRobot& simulated) -> std::unique_ptr<Robot> {
      const nb::gil_scoped_acquire acquired;
      try {
        return RobotFromPython((*held)(nb::cast(&simulated, nb::rv_policy::reference)), raised);
      } catch (...) {
        raised->Keep();
        throw InputError("robot", "raised an exception");
      }
    };
  }
  const ProgressCallback inner = ToProgress(progress, token);
  std::vector<evaluation::EpisodeSummaryRow> rows;
  nb::list records;
  Held callback;
  if (!on_record.is_none()) callback = Held(on_record);
  const auto take = [&](const workflow::EpisodeRecord& record) {
    rows.push_back(evaluation::SummaryRow(record));
    const nlohmann::ordered_json json = evaluation::ToJson(record);
    const nb::gil_scoped_acquire acquired;
    if (raised->error) return;
    try {
      nb::object dict = ToPython(json);
      records.append(dict);
      if (callback && (*callback)(dict).is(nb::handle(Py_False))) token.Cancel();
    } catch (...) {
      raised->Keep();
      token.Cancel();
    }
  };
  const auto report = [&](std::int64_t done, std::int64_t total) {
    if (raised->error || token.cancelled()) return;
    try {
      inner(done, total);
    } catch (...) {
      const nb::gil_scoped_acquire acquired;
      raised->Keep();
      token.Cancel();
    }
  };
  try {
    RunInterruptibly(token, [&] {
      const std::shared_ptr<const env::Scene> scene = workflow::BuildEpisodeScene(*setup, scene_options);
      const auto make_runner = [&] { return workflow::EpisodeRunner(setup, scene, factory, options); };
      return workflow::RunEpisodes(workflow::EpisodeRange(first, first + episodes), Threads(jobs), make_runner, take,
                                   report, &token);
    });
  } catch (const InputError&) {
    raised->Rethrow();
    throw;
  }
  raised->Rethrow();
  nlohmann::json summary = evaluation::ToJson(evaluation::Summarize(rows));
  summary["task"] = setup->task().name;
  summary["noise"] = noise;
  summary["placement"] = workflow::ToString(options.perception ? workflow::Placement::kWorkspace : options.placement);
  summary["ladder"] = options.ladder;
  summary["seed"] = seed;
  return nb::make_tuple(ToPython(summary), records);
}

}  // namespace

void BindEpisodes(nb::module_& m) {
  m.def("policy_names", &workflow::PolicyNames);
  m.def("fault_names", [] {
    nb::dict names;
    for (const workflow::FaultName& fault : workflow::FaultNames()) names[nb::str(fault.name.c_str())] = fault.meaning;
    return names;
  });
  m.def("run", &Run, "task"_a, "policy"_a, "database"_a.none(), "policy_options"_a, "episodes"_a, "first"_a, "seed"_a,
        "extents"_a.none(), "noise"_a, "placement"_a, "table"_a, "force_budget"_a.none(), "wrist_stiffness"_a,
        "ladder"_a.none(), "withhold_true_pose"_a, "replay"_a, "robot"_a.none(), "jobs"_a, "cancellation"_a.none(),
        "on_record"_a.none(), "progress"_a.none());
  m.def(
      "summarize",
      [](const std::string& path) {
        return ToPython(evaluation::ToJson(evaluation::Summarize(evaluation::ReadRecords(path))));
      },
      "path"_a);
}

}  // namespace feeler::python
