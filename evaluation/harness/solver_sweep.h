#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/core/task.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/evaluation/harness/comparison.h"
#include "feeler/planner/family/preprocess.h"
#include "feeler/workflow/scale/shard.h"

namespace feeler::evaluation {

/// The task that solvers are compared on.
struct PlanningCase {
  Task task;
  std::shared_ptr<const planner::ContactMap> map;
  std::string fingerprint;
};

/// Problems drawn from a family: the family sorted by number of hypotheses (ties lexicographic) is cut into `strata`
/// parts of equal number, and `per_stratum` distinct problems are drawn from each. In lexicographic order. Depends on
/// family and seed alone. Throws InputError if a stratum has too few problems.
planner::ProblemFamily DrawSample(const planner::ProblemFamily& family, int strata, int per_stratum,
                                  std::uint64_t seed);

/// One solver under one setting, the row of a table.
struct SolverRow {
  std::string label;    ///< distinct within an experiment
  std::string setting;  ///< "paper" or "fast"
  planner::SolverOptions options;
  planner::ProblemOrder order = planner::ProblemOrder::kUncertainty;
  planner::ExperienceKind experience = planner::ExperienceKind::kRollout;
  double heuristic_share = 1.0;  ///< PlanningTables::WeakenHeuristics
};
nlohmann::json ToJson(const SolverRow& row);

/// What the cells of a table share.
struct SweepContext {
  CellStore* cells = nullptr;
  Parallelism jobs;
  const CancellationToken* cancellation = nullptr;  ///< may be null
  ProgressCallback progress;                        ///< cells done, of all
  /// Keep policies that may serve as experience with the cells. Without, a row of E-RTDP-Bel that was interrupted is
  /// run again from its first problem: right for whole families, whose policies would fill gigabytes.
  bool keep_policies = true;
  std::shared_ptr<const planner::ArrayStore> store = nullptr;  ///< as in ExperimentRequest
  std::optional<workflow::Shard> shard = std::nullopt;         ///< run only these problems of each row
};

/// Runs rows over a sample, seed by seed, by Algorithm 3 (planner::Preprocess): E-RTDP-Bel takes the most similar
/// solved problem of the sample as experience. Cells that the store holds are not run again.
class SolverSweep {
 public:
  SolverSweep(PlanningCase planning_case, planner::ProblemFamily sample, std::vector<SolverRow> rows,
              std::vector<std::uint64_t> seeds, SweepContext context);

  /// False if it was cancelled, or did only a shard.
  bool Run();

  const planner::ProblemFamily& sample() const { return sample_; }
  const std::vector<SolverRow>& rows() const { return rows_; }
  /// The attempts of a row, seed by seed, problem by problem in the order of the sample. After Run returned true.
  std::vector<SolveRecord> Records(std::size_t row) const;
  /// heur(b_start) of each problem of the sample under the heuristic of a row.
  std::vector<double> StartHeuristics(std::size_t row);
  /// Every attempt, for the details of a result.
  nlohmann::json RecordsJson() const;

 private:
  class Sink;
  std::string CellOf(const SolverRow& row, std::uint64_t seed, const planner::Extents& extents) const;
  std::shared_ptr<const planner::PlanningTables> TablesFor(const SolverRow& row);

  PlanningCase case_;
  planner::ProblemFamily sample_;
  std::vector<SolverRow> rows_;
  std::vector<std::uint64_t> seeds_;
  SweepContext context_;
  std::map<std::pair<planner::HeuristicKind, double>, std::shared_ptr<const planner::PlanningTables>> tables_;
};

}  // namespace feeler::evaluation
