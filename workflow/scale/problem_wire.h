#pragma once

#include <optional>
#include <string>

#include "feeler/planner/family/family_solver.h"
#include "feeler/planner/family/preprocess.h"
#include "feeler/workflow/scale/ranks.h"

namespace feeler::workflow {

/// A problem to be solved elsewhere, with the policy that it is solved with.
struct ProblemRequest {
  planner::Extents extents;
  std::optional<planner::SimilarProblem> similar;
};

/// Laws: what is read is what was written, doubles bit for bit. Reading throws Error for anything else.
std::string ToBytes(const ProblemRequest& request);
ProblemRequest ProblemRequestFrom(const std::string& bytes);
/// All that a database keeps of a result; not the pairs that no probe tells apart.
std::string ToBytes(const planner::SolverResult& result);
planner::SolverResult SolverResultFrom(const std::string& bytes);

/// Solvers on the other ranks, for planner::Preprocess of so many problems; they serve with ServeProblems.
std::vector<planner::DistantSolver> DistantSolvers(Ranks& ranks, std::size_t problems);

/// On another rank: solves what rank 0 asks for, on options.jobs threads, until it is done.
void ServeProblems(Ranks& ranks, const std::string& identity, const Task& task,
                   std::shared_ptr<const planner::ContactMap> map, const planner::ProblemFamily& family,
                   const planner::PreprocessOptions& options);

}  // namespace feeler::workflow
