#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/evaluation/harness/experiment_output.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/workflow/scale/shard.h"

namespace feeler::evaluation {

/// How an experiment is to be run.
struct ExperimentRequest {
  std::string out;     ///< folder, created if missing
  bool quick = false;  ///< few problems and short limits
  Parallelism jobs;
  std::string task;                      ///< instead of the experiment's own, where it takes one
  std::string pomdps;                    ///< folder of further models, where it takes them
  std::uint64_t seed = 1;                ///< of samples; solver seeds count up from it
  int solver_seeds = 0;                  ///< repetitions, where the experiment takes them; 0: its own number
  std::optional<workflow::Shard> shard;  ///< measure only this part: never complete
  std::vector<std::string> from;         ///< folders of shards, whose cells and records are taken over
  std::shared_ptr<const planner::ArrayStore> store;  ///< of bound tables for the processes of the host; null: none
  std::string command;                               ///< for the manifest
  const CancellationToken* cancellation = nullptr;   ///< may be null
  ProgressCallback map_progress;                     ///< while a contact map is built
  ProgressCallback database_progress;                ///< while policies for episodes are solved
  ProgressCallback progress;                         ///< cells done, of all
};

/// What an experiment measured. `table`, `details` and `text` only if it is complete.
struct ExperimentResult {
  bool complete = false;
  nlohmann::json settings;  ///< every option that shaped the result
  std::vector<std::uint64_t> seeds;
  ResultTable table;
  nlohmann::json details;
  std::vector<Figure> figures;  ///< line plots for the report
  std::string text;             ///< the table for people, beside the paper's printed values
};

/// One of the paper's tables or figures, or a further one.
struct Experiment {
  std::string name;
  std::string summary;
  std::function<ExperimentResult(const ExperimentRequest&)> run;
  bool takes_task = false;          ///< follows ExperimentRequest::task
  bool takes_solver_seeds = false;  ///< follows ExperimentRequest::solver_seeds
  bool takes_pomdps = false;        ///< follows ExperimentRequest::pomdps
  bool takes_shard = false;         ///< follows ExperimentRequest::shard and from
};

/// Where the finished cells of an experiment are kept: OUT/NAME.partial.jsonl.
std::string PartialFile(const ExperimentRequest& request, const std::string& name);
/// Those of the shards.
std::vector<std::string> PartialFilesOf(const ExperimentRequest& request, const std::string& name);

}  // namespace feeler::evaluation
