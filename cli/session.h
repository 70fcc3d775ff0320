#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "feeler/cli/common/session.h"
#include "feeler/core/parallelism.h"
#include "feeler/workflow/scale/ranks.h"
#include "feeler/workflow/scale/shard.h"

namespace feeler::cli {

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

}  // namespace feeler::cli
