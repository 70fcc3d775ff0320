#include "feeler/planner/family/family_solver.h"

#include <algorithm>
#include <utility>

#include "feeler/core/orientation_lattice.h"
#include "feeler/planner/bounds/build_tables.h"
#include "feeler/planner/family/prior.h"

namespace feeler::planner {

FamilySolver::FamilySolver(const Task& task, std::shared_ptr<const ContactMap> map, const ProblemFamily& family,
                           const PreprocessOptions& options)
    : task_(task),
      map_(std::move(map)),
      traits_{.orientations = LatticeOrientations(task) > 1, .cells_per_axis = !task.cost.one_per_cell()},
      prior_deviation_(options.prior_deviation),
      solver_(options.solver),
      experience_(options.experience),
      tables_(options.tables) {
  solver_.on_bounds = nullptr;
  solver_.cancellation = options.cancellation;
  Validate(solver_);
  needs_experience_ = solver_.solver == SolverKind::kERtdpBel && options.experience != ExperienceKind::kNone;
  if (!tables_ && !family.problems.empty()) {
    const Parallelism jobs(std::max(options.jobs.threads(), options.table_jobs.threads()));
    tables_ = BuildPlanningTables(ProblemOf(LargestExtents(family)), WithFamilyBudget(solver_, traits_), jobs,
                                  options.store.get());
  }
}

Problem FamilySolver::ProblemOf(const Extents& extents) const {
  Problem problem = MakeCuboidProblem(task_, map_, extents);
  WeighByPrior(task_, prior_deviation_, extents, problem);
  return problem;
}

SolverResult FamilySolver::Solve(const Extents& extents, const std::optional<SimilarProblem>& similar) const {
  const Problem problem = ProblemOf(extents);
  std::optional<Problem> similar_problem;
  Experience experience;
  if (similar) {
    similar_problem = ProblemOf(similar->extents);
    experience = {experience_, &*similar_problem, similar->policy.get()};
  }
  return planner::Solve(problem, WithFamilyBudget(solver_, traits_, problem.hypotheses.size()), tables_, experience);
}

}  // namespace feeler::planner
