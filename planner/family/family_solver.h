#pragma once

#include <memory>
#include <optional>

#include "feeler/core/task.h"
#include "feeler/planner/family/preprocess.h"
#include "feeler/planner/solve.h"

namespace feeler::planner {

/// Solves single problems of a family as Preprocess does: the same budget, tables and experience, hence the same
/// results, wherever it stands. Safe from many threads.
class FamilySolver {
 public:
  /// Builds the tables that serve the whole family with options.jobs threads, unless options.tables are given. The
  /// options are copied.
  FamilySolver(const Task& task, std::shared_ptr<const ContactMap> map, const ProblemFamily& family,
               const PreprocessOptions& options);

  /// Law: depends on its arguments and those of the constructor alone (what a time limit stopped is exempt).
  SolverResult Solve(const Extents& extents, const std::optional<SimilarProblem>& similar) const;

  const PlanningTables& tables() const { return *tables_; }
  /// Whether problems are solved with the policies of similar ones.
  bool needs_experience() const { return needs_experience_; }
  Problem ProblemOf(const Extents& extents) const;

 private:
  Task task_;
  std::shared_ptr<const ContactMap> map_;
  FamilyTraits traits_;
  std::vector<double> prior_deviation_;
  SolverOptions solver_;
  ExperienceKind experience_;
  bool needs_experience_ = false;
  std::shared_ptr<const PlanningTables> tables_;
};

}  // namespace feeler::planner
