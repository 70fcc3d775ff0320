#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/evaluation/cad_import/import_task.h"
#include "feeler/evaluation/records/run_summary.h"

namespace feeler::evaluation {

struct TrialOptions {
  int extent = 5;     ///< hypotheses along each axis, at most
  int episodes = 60;  ///< of each kind
  std::uint64_t seed = 1;
  Parallelism jobs;
  std::function<void(const std::string&)> on_stage;
  ProgressCallback progress;
  const CancellationToken* cancellation = nullptr;
};

/// Episodes under one kind of noise.
struct TrialRun {
  std::string noise;
  std::string policy;
  RunSummary summary;
};

/// What touch can do for an imported task.
struct Trial {
  std::string extents;        ///< "5x5x5"
  double margin_cells = 0.0;  ///< of the contact map
  bool solved = false;
  bool verified = false;
  std::string why_not;  ///< of what is not solved or verified
  double expected_cost_cells = 0.0;
  double ratio = 0.0;  ///< certified
  double solve_cpu_s = 0.0;
  double map_s = 0.0;
  std::vector<std::string> felt;  ///< a line for each axis: what touch can tell
  std::vector<TrialRun> runs;
};

/// Solves one problem of the task, replays its policy under every hypothesis, and runs seeded episodes in physics: as
/// they are, and with the tool made to fall into the opening while it probes; where the problem cannot be solved (a
/// flush part), with the spiral search. Throws what loading throws.
Trial RunTrial(const ImportedTask& task, const TrialOptions& options);

/// Solved, verified, and under no noise all episodes failed.
bool Works(const Trial& trial);

/// One sentence: does it work, and how well; and why not.
std::string Verdict(const ImportedTask& task, const std::optional<Trial>& trial);

}  // namespace feeler::evaluation
