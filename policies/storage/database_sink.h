#pragma once

#include <optional>

#include "feeler/planner/family/preprocess.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/policies/storage/database.h"

namespace feeler::policies {

/// Stores what `planner::Preprocess` finishes in a database open for writing, and tells it what is there already. A
/// problem counts as done if its row has a complete policy or is unlocalizable; others are tried again.
class DatabaseSink final : public planner::PolicySink {
 public:
  /// `options` as given to Preprocess: they stand in the rows. The database outlives the sink.
  DatabaseSink(Database& database, const planner::SolverOptions& options) : database_(database), options_(options) {}

  bool Done(const planner::Extents& extents) override;
  std::optional<planner::PolicyGraph> Load(const planner::Extents& extents) override;
  void Store(const planner::Extents& extents, const planner::Problem& problem,
             const planner::SolverResult& result) override;

 private:
  Database& database_;
  planner::SolverOptions options_;
};

/// The row of a result.
StoredProblem ToStoredProblem(const planner::Extents& extents, const planner::SolverOptions& options,
                              const planner::SolverResult& result);

}  // namespace feeler::policies
