// feeler simulate: the simulated robot behind the wire protocol.
#include <fmt/format.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/core/error.h"
#include "feeler/evaluation/records/replay_json.h"
#include "feeler/execution/remote/robot_server.h"
#include "feeler/execution/remote/token_file.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/episode/episode_faults.h"
#include "feeler/workflow/episode/served_episodes.h"

namespace feeler::cli {
namespace {

struct SimulatorFlags {
  std::string task;
  std::string listen;
  std::string db;
  std::string extents;
  std::string noise = "ideal";
  std::string placement = "nominal";
  std::string faults;
  std::string token_file;
  std::int64_t episodes = 1;
  std::uint64_t seed = 1;
  double link_timeout_s = execution::kLinkTimeout_s;
  double wrist_stiffness_n_m = 0.0;
  bool lockstep = false;
  bool no_replay = false;
  bool json = false;
};

nlohmann::json Summary(const execution::RobotServer& server) {
  const execution::ServerStatistics& s = server.statistics();
  nlohmann::json faults = nlohmann::json::object();
  for (int i = 0; i < execution::kWireFaultCount; ++i) {
    if (s.ordered[i] > 0) faults[std::string(ToString(static_cast<execution::WireFault>(i)))] = s.ordered[i];
  }
  return {{"sessions", s.sessions},
          {"refused_sessions", s.refused_sessions},
          {"motions", s.motions},
          {"refused_motions", s.refused_motions},
          {"lost_links", s.lost_links},
          {"bad_frames", s.bad_frames},
          {"protective_stops", s.protective_stops},
          {"faults", faults},
          {"episodes_judged", server.episodes_judged()}};
}

void Simulate(const SimulatorFlags& flags, Session& session) {
  const execution::Address address = execution::ParseAddress("--listen", flags.listen);
  execution::ServerOptions options;
  options.token = execution::ReadTokenFile(flags.token_file);
  if (!execution::IsLoopback(address) && options.token.empty()) {
    throw InputError("--listen", "others than this machine reach " + address.host + ", and no token is asked for",
                     "listen on 127.0.0.1 or give --token-file");
  }
  options.faults = execution::ParseOrderedFaults(flags.faults);
  options.lockstep = flags.lockstep;
  options.paced = true;
  options.link_timeout_s = flags.link_timeout_s;
  options.seed = flags.seed;

  workflow::EpisodeOptions episodes;
  episodes.seed = flags.seed;
  episodes.noise = flags.noise;
  episodes.placement = workflow::ParsePlacement(flags.placement);
  episodes.force_offset_n = options.faults.bias_n;
  workflow::ParseFaults(flags.noise);  // an unknown name fails before the contact map is built
  const env::SceneOptions scene_options = SceneOptionsOf(flags.wrist_stiffness_n_m);

  std::shared_ptr<policies::Database> database;
  workflow::PolicyFactory policy_factory;
  workflow::PlanningSetupOptions setup_options;
  if (!flags.db.empty()) {
    database = std::make_shared<policies::Database>(policies::Database::OpenReadOnly(flags.db));
    policy_factory = workflow::MakePolicyFactory("database", database);
    setup_options = workflow::SetupOptionsOf(database->identity());
  }
  execution::Listener listener("--listen", address);
  ProgressBar map_bar("contact map");
  setup_options.progress = Interruptible(map_bar, session);
  const auto setup =
      std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup(flags.task, setup_options));
  map_bar.Finish();
  if (database) database->RequireFingerprint(setup->task().name, setup->fingerprint);
  episodes.family = workflow::FamilyToDrawFrom(flags.extents, database.get(), setup->task());

  std::function<nlohmann::json(const workflow::Replay&)> replay_json;
  if (!flags.no_replay) {
    replay_json = [](const workflow::Replay& replay) { return nlohmann::json(evaluation::RobotReplay(replay)); };
  }
  workflow::ServedEpisodes world(
      workflow::EpisodeRunner(setup, workflow::BuildEpisodeScene(*setup, scene_options), policy_factory, episodes),
      flags.episodes, flags.extents.empty() && flags.db.empty(), std::move(replay_json));
  execution::RobotServer server(world.Robot(), options);
  Note("feeler: the simulated robot listens on {}:{}, {}\n", address.host, listener.port(),
       flags.lockstep ? "in lockstep" : "in real time");
  while (!world.done() && !session.cancellation->cancelled()) {
    std::optional<execution::Connection> connection = listener.Accept(0.2);
    if (connection) server.Serve(std::move(*connection), &listener, session.cancellation);
  }
  if (flags.json) {
    PrintJson(Summary(server));
  } else {
    const execution::ServerStatistics& s = server.statistics();
    Note("feeler: {} sessions, {} motions, {} refused, {} links lost\n", s.sessions, s.motions, s.refused_motions,
         s.lost_links);
  }
  if (session.cancellation->cancelled()) session.exit_code = 1;
}

}  // namespace

void AddSimulateCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<SimulatorFlags>();
  CLI::App* command = app.add_subcommand(
      "simulate", "The simulated robot behind the wire protocol (docs/robot-protocol.md), for feeler execute");
  command->add_option("--task", flags->task, "name under models/tasks/, or path of a task file")->required();
  command->add_option("--listen", flags->listen, "HOST:PORT, e.g. 127.0.0.1:7800 (port 0: any free one)")->required();
  AddInteger(*command, "--episodes", flags->episodes, 1, 10'000'000, "how many are offered; it ends after the last");
  AddSeed(*command, flags->seed, "of all draws: episodes are those of feeler run");
  command->add_option("--extents", flags->extents,
                      "always this problem, e.g. 7x7x7 (default: what the executor asks for, else drawn)");
  command->add_option("--db", flags->db, "draw the problems from this database; noise fall-in asks for it");
  command->add_option("--noise", flags->noise, "as of feeler run")->capture_default_str();
  command->add_option("--placement", flags->placement, "nominal or workspace, as of feeler run")->capture_default_str();
  AddWristStiffness(*command, flags->wrist_stiffness_n_m);
  command->add_flag("--lockstep", flags->lockstep,
                    "time passes in motions alone, as fast as it can (default: in real time)");
  command->add_option("--faults", flags->faults,
                      "what goes wrong, e.g. latency=2,jitter=1,drop=0.1,stall=0.2,stall-ms=50,protective=0.1,\n"
                      "malformed=0.1,half=0.1,version=0.1,slowed=0.5,bias=1.5: ms, shares of the episodes, N");
  AddReal(*command, "--link-timeout", flags->link_timeout_s, 0.02, 60.0, "a link silent for so long is lost, s");
  command->add_option("--token-file", flags->token_file, "sessions must know the token in this file");
  command->add_flag("--no-replay", flags->no_replay, "send no replays with the verdicts");
  command->add_flag("--json", flags->json, "print what was seen, at the end, as JSON");
  command->callback([flags, &session] { Simulate(*flags, session); });
}

}  // namespace feeler::cli
