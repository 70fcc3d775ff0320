#pragma once

#include <cstdint>
#include <vector>

#include "feeler/planner/family/preprocess.h"
#include "feeler/workflow/scale/job_model.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// What building a database will take, from a sample of its problems that were solved.
struct FamilyEstimate {
  std::int64_t problems = 0;
  std::int64_t sampled = 0;
  double sample_cpu_s = 0.0;
  double cpu_s = 0.0;             ///< of the whole family, tables left out
  double cpu_error = 0.0;         ///< relative: largest of the two halves of the sample about the other
  double tables_s = 0.0;          ///< CPU, per process
  std::int64_t rank_bytes = 0;    ///< memory of a process, at its peak over the sample
  std::int64_t shared_bytes = 0;  ///< of them contact map and tables, which the ranks of a host share
  double commit_s = 0.0;          ///< of a problem into the file
  std::vector<double> piece_s;    ///< of every problem, largest first, as PreprocessOptions gives them out
};

/// Solves `sample` problems of the family, the largest and others evenly spaced in the order of size (fewer if the
/// family is smaller), on options.jobs threads; a problem that was not is taken to cost what the one next to it in that
/// order did. Throws Interrupted after a cancellation.
FamilyEstimate EstimateFamily(const PlanningSetup& setup, const planner::ProblemFamily& family,
                              const planner::PreprocessOptions& options, std::int64_t sample);

/// The same from the times of a database that holds all problems of the family; the largest is solved once more, for
/// its memory. Throws InputError for one that it does not hold.
FamilyEstimate EstimateFromTimes(const PlanningSetup& setup, const planner::ProblemFamily& family,
                                 const planner::PreprocessOptions& options, policies::Database& measured);

/// The estimate as a job.
JobModel ModelOf(const FamilyEstimate& estimate);

}  // namespace feeler::workflow
