#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/core/task.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/solve.h"

namespace feeler::planner {

/// Where finished policies go (the database). Calls are serial, from any of the working threads.
class PolicySink {
 public:
  virtual ~PolicySink() = default;
  /// True if this problem is done (an earlier run stored it): it is skipped.
  virtual bool Done(const Extents& extents) = 0;
  /// The stored policy of a problem that is done, as experience for others; empty if it has none.
  virtual std::optional<PolicyGraph> Load(const Extents& extents) = 0;
  /// A problem is finished, complete or not. The sequence of calls depends on the threads, their content does not.
  virtual void Store(const Extents& extents, const Problem& problem, const SolverResult& result) = 0;
};

/// What a family is budgeted by.
struct FamilyTraits {
  bool orientations = false;    ///< the orientation of the target is uncertain
  bool cells_per_axis = false;  ///< a cell does not cost the same along all axes
};

/// Problems of uncertain orientations up to this size are worth more expansions than larger ones.
inline constexpr int kSmallOrientedHypotheses = 600;

/// The options that a problem of so many hypotheses in a family is solved with: the certified solver without any limit
/// is given 20,000 expansions, so that one problem whose gap cannot be closed never holds up the family. With uncertain
/// orientations 200,000 up to kSmallOrientedHypotheses, whose gaps close, and 60,000 above, where many stay open.
/// 3000 where cells cost by their axis: bounds are weaker there, and no policy of the plug's family came
/// of later expansions. At a gap below kTightGap it takes cuboids for certificates, unless told not to.
SolverOptions WithFamilyBudget(SolverOptions solver, const FamilyTraits& family = {},
                               std::size_t hypotheses = std::numeric_limits<std::size_t>::max());

/// The most similar solved problem, whose policy another is solved with.
struct SimilarProblem {
  Extents extents;
  std::shared_ptr<const PolicyGraph> policy;
};

/// Solves a problem of the family somewhere else (on another machine), with the policy of a similar one as experience;
/// called from one thread. Law: the result of FamilySolver::Solve with the same options, or status kCancelled.
using DistantSolver = std::function<SolverResult(const Extents& extents, const std::optional<SimilarProblem>& similar)>;

struct PreprocessOptions {
  /// Cancellation and on_bounds of it are ignored; limits as WithFamilyBudget completes them for each problem.
  SolverOptions solver;
  std::vector<double> prior_deviation;  ///< of the hypotheses (WeighByPrior); empty: equally likely
  ProblemOrder order = ProblemOrder::kUncertainty;
  ExperienceKind experience = ExperienceKind::kRollout;  ///< for E-RTDP-Bel; other solvers use none
  std::uint64_t seed = 1;                                ///< of the random order
  Parallelism jobs;
  /// Tables made by an earlier call of BuildPlanningTables for this task and these solver options; null to build them.
  std::shared_ptr<const PlanningTables> tables;
  /// Where tables that are built here are kept for the other processes of the host; null: not.
  std::shared_ptr<const ArrayStore> store;
  Parallelism table_jobs;  ///< threads that build tables, if more than `jobs`: processes that wait for them leave cores
  /// The problems of the family to solve and hand over, in lexicographic order; null: all. Order, tables and choice of
  /// experience are those of the whole family, so the results are, too: other problems are solved along the way where
  /// their policies are needed, and not handed over.
  std::shared_ptr<const std::vector<Extents>> only;
  /// Further workers beside the `jobs` threads, each with a thread of this process that waits for it.
  std::vector<DistantSolver> distant;
  const CancellationToken* cancellation = nullptr;  ///< problems in flight are dropped
  ProgressCallback progress;                        ///< problems done, of all
};

struct PreprocessSummary {
  std::int64_t problems = 0;  ///< to be handed over
  std::int64_t skipped = 0;   ///< done by an earlier run
  std::int64_t complete = 0;  ///< solved in this run with a complete policy
  std::int64_t failed = 0;    ///< no complete policy within the limits, or unlocalizable
  std::int64_t helpers = 0;   ///< solved for their policies alone
  bool cancelled = false;
  double wall_s = 0.0;
  double cpu_s = 0.0;  ///< summed over problems
};

/// Algorithm 3: solves the problems of a family in order, each with the most similar solved problem as experience, and
/// hands every policy to the sink. Threads and distant solvers work along the real dependencies; the results are the
/// same for any number of either and after a resume (what a time limit stopped is exempt). Without experience several
/// workers begin with the largest problems, so that none is left over at the end.
PreprocessSummary Preprocess(const Task& task, std::shared_ptr<const ContactMap> map, const ProblemFamily& family,
                             const PreprocessOptions& options, PolicySink& sink);

}  // namespace feeler::planner
