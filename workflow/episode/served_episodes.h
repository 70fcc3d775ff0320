#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "feeler/execution/remote/robot_server.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/episode/replay.h"

namespace feeler::workflow {

/// Seeded episodes for an executor at the other end of a wire: the world of a runner as a robot to be served. What the
/// executor is told and what is true later are those of `EpisodeRunner::Run`, number by number. Stays where it is.
class ServedEpisodes {
 public:
  /// The robot stands at home, with the noise of the runner, until the first episode is asked for.
  /// `any_extents`: an executor that asks for extents gets them; else the problems are those of the runner's family.
  /// `replay_json`: how a replay is written into the verdict; empty: none is kept.
  ServedEpisodes(EpisodeRunner runner, std::int64_t episodes, bool any_extents = false,
                 std::function<nlohmann::json(const Replay&)> replay_json = {});
  ServedEpisodes(const ServedEpisodes&) = delete;
  ServedEpisodes& operator=(const ServedEpisodes&) = delete;

  execution::ServedRobot Robot();
  /// Whether the last episode has had its verdict.
  bool done() const { return judged_ && current_ + 1 >= episodes_; }
  /// Of the present episode, as judged last.
  const EpisodeRecord& record() const { return record_; }
  env::InsertionEnv& environment() { return runner_.environment(); }

 private:
  execution::EpisodeReply Begin(const execution::EpisodeRequest& asked);
  execution::VerdictReply Judge();

  EpisodeRunner runner_;
  std::int64_t episodes_;
  bool any_extents_;
  std::function<nlohmann::json(const Replay&)> replay_json_;
  std::unique_ptr<ReplayRecorder> recorder_;
  std::int64_t current_ = -1;
  bool begun_ = false;
  bool arrived_ = false;
  bool judged_ = false;
  EpisodeRecord record_;
  execution::VerdictReply verdict_;
};

}  // namespace feeler::workflow
