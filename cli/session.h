#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "feeler/cli/common/progress_bar.h"
#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/workflow/scale/ranks.h"
#include "feeler/workflow/scale/shard.h"

namespace feeler::cli {

/// What every subcommand shares: the Ctrl-C token and the exit code it leaves (0 done, 1 the answer is no).
struct Session {
  CancellationToken* cancellation = nullptr;
  int exit_code = 0;
  workflow::Ranks* ranks = nullptr;  ///< the processes of this job; null if it is alone

  /// True on ranks that work for rank 0, which alone holds the files.
  bool serves() const { return ranks != nullptr && ranks->rank() > 0; }
  /// Does it once a host before all others there, where there are ranks.
  void OncePerHost(const std::function<void()>& load) const {
    if (ranks == nullptr) return load();
    ranks->OncePerHost(load);
  }
};

/// --shard I/N or auto: what of a job this process does.
CLI::Option* AddShard(CLI::App& command, std::string& text, const std::string& of);
/// None without text. Throws InputError.
std::optional<workflow::Shard> ShardOf(const std::string& text);

/// The threads of a command with --jobs: as given, else one where there are several ranks, else `alone`.
Parallelism JobsOf(const CLI::App& command, int jobs, const Session& session);

/// Accounts of the ranks, [] without: rank, host, pieces of work, CPU seconds. `total`: pieces in all, those of rank 0
/// are the rest.
nlohmann::json RanksJson(const Session& session, std::int64_t total);
/// The same in one line a rank, to standard error; nothing without ranks.
void NoteRanks(const Session& session, std::int64_t total);
/// "problems" or, with ranks, "problems (4 ranks)".
std::string WithRanks(const std::string& label, const Session& session);

/// Prints a result for machines: one JSON document on stdout.
void PrintJson(const nlohmann::json& value);

/// Updates the bar, and ends the work with Interrupted where a signal has come: for work that leaves nothing to keep
/// when it is given up. The bar must outlive the callback.
ProgressCallback Interruptible(ProgressBar& bar, const Session& session);

}  // namespace feeler::cli
