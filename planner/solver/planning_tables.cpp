#include "planner/solver/planning_tables.h"

#include "planner/contact/fill_dead_ends.h"
#include "planner/heuristic/certificate.h"

namespace feeler::planner {
namespace {

Cell SpreadOf(const Problem& problem) {
  return problem.goal == GoalKind::kInsertable ? problem.insertable_spread : Cell(Cell::Zero());
}

}  // namespace

PlanningTables::PlanningTables(const Problem& problem, const SolverOptions& options)
    : map_(problem.map), problem_(problem), options_(options), masks_(*problem.map) {
  options_.cancellation = nullptr;
  options_.on_bounds = nullptr;
  const StepCosts costs = LowerStepCosts(problem.cost, problem.move_lengths.back());
  const StepCosts motions = MotionCosts(problem.cost, problem.move_lengths.back());
  pairs_ = std::make_shared<PairCertificates>(problem.map, motions, SpreadOf(problem));
  switch (options.heuristic) {
    case HeuristicKind::kCertificate:
      if (!problem.generous_workspace && LocalCertificateTable::Fits(problem)) {
        local_certificate_ = std::make_shared<LocalCertificateTable>(problem, motions);
      } else {
        certificate_ = std::make_shared<CertificateTable>(*problem.map, motions, SpreadOf(problem));
      }
      break;
    case HeuristicKind::kLines: lines_ = std::make_shared<LineTable>(*problem.map, costs, SpreadOf(problem)); break;
    case HeuristicKind::kFirstContact: first_contact_ = std::make_shared<FirstContactTable>(*problem.map, costs); break;
  }
  if (options.solver == SolverKind::kCertified && problem.generous_workspace) filled();
}

std::unique_ptr<BeliefHeuristic> PlanningTables::MakeHeuristic(const Problem& problem,
                                                               const HypothesisSets& sets) const {
  if (local_certificate_) return std::make_unique<LocalCertificateHeuristic>(problem, sets, *local_certificate_);
  if (lines_) return std::make_unique<LineHeuristic>(sets, lines_, pairs_);
  if (first_contact_) return std::make_unique<FirstContactHeuristic>(sets, first_contact_);
  return std::make_unique<CertificateHeuristic>(sets, certificate_, pairs_);
}

const PlanningTables::Filled& PlanningTables::filled() const {
  std::call_once(filled_once_, [&] {
    filled_.map = FillDeadEnds(*map_);
    if (!filled_.map) return;
    Problem problem = problem_;
    problem.map = filled_.map;
    SolverOptions options = options_;
    options.heuristic = HeuristicKind::kCertificate;  // the bound is made of them
    filled_.tables = std::make_shared<const PlanningTables>(problem, options);
    if (!filled_.tables->certificate_) return;
    filled_.bound =
        std::make_shared<const OpenBound>(*map_, filled_.map, filled_.tables->masks_, filled_.tables->certificate_,
                                          MotionCosts(problem_.cost, problem_.move_lengths.back()), SpreadOf(problem_));
  });
  return filled_;
}

std::shared_ptr<const PlanningTables> BuildPlanningTables(const Problem& problem, const SolverOptions& options) {
  return std::make_shared<PlanningTables>(problem, options);
}

}  // namespace feeler::planner
