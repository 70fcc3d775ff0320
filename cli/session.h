#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "feeler/cli/common/session.h"
#include "feeler/core/parallelism.h"
#include "feeler/env/scene/scene.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/workflow/scale/ranks.h"
#include "feeler/workflow/scale/shard.h"

namespace feeler::cli {

/// --shard I/N or auto: what of a job this process does.
CLI::Option* AddShard(CLI::App& command, std::string& text, const std::string& of);
/// --wrist-stiffness, 0 where it is not given.
CLI::Option* AddWristStiffness(CLI::App& command, double& stiffness_n_m);
/// The world as the command line wants it. Throws InputError naming the option.
env::SceneOptions SceneOptionsOf(double wrist_stiffness_n_m);
/// None without text. Throws InputError.
std::optional<workflow::Shard> ShardOf(const std::string& text);

/// The threads of a command with --jobs: as given, else one where there are several ranks, else `alone`.
Parallelism JobsOf(const CLI::App& command, int jobs, const Session& session);

/// For what is made once a host: the threads of all its ranks, whose others wait for it.
Parallelism TableJobsOf(Parallelism jobs, const Session& session);
/// Where ranks keep bound tables for the others of their host; null without ranks.
std::shared_ptr<const planner::ArrayStore> TablesOfHost(const Session& session);
/// Says once, in one line, that the cache cannot be written.
void TellCacheFailure(const std::string& reason);

/// Accounts of the ranks, [] without: rank, host, pieces of work, CPU seconds. `total`: pieces in all, those of rank 0
/// are the rest.
nlohmann::json RanksJson(const Session& session, std::int64_t total);
/// The same in one line a rank, to standard error; nothing without ranks.
void NoteRanks(const Session& session, std::int64_t total);
/// "problems" or, with ranks, "problems (4 ranks)".
std::string WithRanks(const std::string& label, const Session& session);

}  // namespace feeler::cli
