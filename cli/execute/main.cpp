// feeler-execute: carries a policy out on whatever speaks the wire protocol. Links no simulator.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "feeler/cli/common/console.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/program.h"
#include "feeler/cli/common/signals.h"
#include "feeler/cli/execute/executing.h"
#include "feeler/cli/execute/flags.h"
#include "feeler/core/file_output.h"
#include "feeler/execution/remote/socket.h"
#include "feeler/version.h"

namespace {

feeler::CancellationToken cancellation;  // reached from the signal handler

using namespace feeler;
using namespace feeler::cli;

/// What a run came to.
struct Tally {
  int episodes = 0;
  int judged = 0;
  int localized = 0;
  int inserted = 0;
  int believed_inserted = 0;
  int links_lost = 0;
  std::vector<double> times_s;
  double peak_force_n = 0.0;
  double robot_time_s = 0.0;  ///< on the robot's clock, transfers to the start poses included
  double robot_wall_s = 0.0;  ///< what passed here meanwhile
  std::map<std::string, int> failures;
};

void Count(const ExecutedEpisode& episode, Tally& tally) {
  ++tally.episodes;
  tally.links_lost += episode.link_lost ? 1 : 0;
  tally.believed_inserted += episode.execution.believed_inserted ? 1 : 0;
  tally.peak_force_n = std::max(tally.peak_force_n, episode.line.peak_force_n);
  tally.robot_time_s += episode.robot_s;
  tally.robot_wall_s += episode.wall_s;
  const bool judged = episode.line.inserted.has_value();
  tally.judged += judged ? 1 : 0;
  tally.localized += episode.line.localized.value_or(false) ? 1 : 0;
  tally.inserted += episode.line.inserted.value_or(false) ? 1 : 0;
  if (judged ? *episode.line.inserted : episode.execution.believed_inserted) {
    tally.times_s.push_back(episode.execution.sim_time_s);
  } else {
    ++tally.failures[episode.line.reason.substr(0, episode.line.reason.find(':'))];
  }
}

nlohmann::json Summary(const Tally& tally, const Executing& executing, double wall_s) {
  std::vector<double> times = tally.times_s;
  std::sort(times.begin(), times.end());
  const nlohmann::json unknown;
  const bool known = tally.judged > 0;  // what is true is known of simulations alone
  return {{"robot", executing.welcome().robot},
          {"simulated", executing.welcome().simulated},
          {"episodes", tally.episodes},
          {"localized", known ? nlohmann::json(tally.localized) : unknown},
          {"inserted", known ? nlohmann::json(tally.inserted) : unknown},
          {"believed_inserted", tally.believed_inserted},
          {"sim_time_median_s", times.empty() ? unknown : nlohmann::json(times[times.size() / 2])},
          {"robot_time_s", tally.robot_time_s},
          {"robot_wall_s", tally.robot_wall_s},
          {"wall_per_robot_time",
           tally.robot_time_s > 0.0 ? nlohmann::json(tally.robot_wall_s / tally.robot_time_s) : unknown},
          {"wall_s", wall_s},
          {"peak_force_max_n", tally.peak_force_n},
          {"links_lost", tally.links_lost},
          {"failures", tally.failures}};
}

void Run(const ExecuteFlags& flags, Session& session) {
  RequireOutputs({{"--out", flags.out, FileKind::kRecords}}, {flags.db, flags.cell, flags.token_file, flags.arm});
  if (!flags.estimate.empty()) ParseEstimate(flags.estimate);  // bad input is told before the robot is called
  if (!flags.box.empty()) ParseBox("--box", flags.box);
  Executing executing(flags, session);
  std::optional<OutputFile> out;
  if (!flags.out.empty()) {
    out.emplace(flags.out, OutputFile::WhenInterrupted::kKeep);
    KeepsWhatIsDone();
  }
  executing.Start();
  Tally tally;
  const double wall_start_s = execution::MonotonicSeconds();
  while (tally.episodes < executing.most() && !session.cancellation->cancelled()) {
    const std::optional<ExecutedEpisode> episode = executing.RunNext();
    if (!episode) break;
    Count(*episode, tally);
    if (out) out->Write(execution::ToJson(episode->line, episode->execution).dump() + "\n");
    if (!flags.json) Print("episode {}: {}\n", episode->line.episode, episode->line.reason);
  }
  executing.Bye();
  if (out && tally.episodes > 0) out->Commit();
  if (flags.json) PrintJson(Summary(tally, executing, execution::MonotonicSeconds() - wall_start_s));
  if (session.cancellation->cancelled()) session.exit_code = 1;
  executing.RequireSound();
  // A simulation counts; on a robot somebody waits for the part to be in.
  if (!executing.welcome().simulated && !flags.dry_run && tally.believed_inserted < tally.episodes)
    session.exit_code = 1;
}

}  // namespace

int main(int argc, char** argv) {
  BeginProgram(cancellation);
  Session session{&cancellation};
  CLI::App app{
      "Carries a policy out on a robot, or its simulation, that speaks the wire protocol (docs/robot-protocol.md).",
      "feeler execute"};
  app.set_version_flag("--version", std::string("feeler-execute ") + FEELER_VERSION);
  ExecuteFlags flags;
  AddExecuteFlags(app, flags);
  app.get_formatter()->column_width(42);
  app.callback([&] { Run(flags, session); });
  return RunProgram(app, session, argc, argv);
}
