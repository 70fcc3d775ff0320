#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "feeler/planner/bounds/build_tables.h"

namespace feeler::planner {

/// Planning tables, built when a problem is met that none of those kept serves, and shared by all that they do serve.
/// Thread-safe; what was asked for last is kept, kMost tables at most.
class PlanningTablesCache {
 public:
  static constexpr std::size_t kMost = 4;

  /// `store`: where they are kept for the other processes of the host; null: not.
  explicit PlanningTablesCache(std::shared_ptr<const ArrayStore> store = nullptr) : store_(std::move(store)) {}

  /// Tables that serve the problem under the options. Law: a solver is led to the same bounds by them as by tables that
  /// were built for a problem that covers this one (`Serves`).
  std::shared_ptr<const PlanningTables> TablesFor(const Problem& problem, const SolverOptions& options);

 private:
  struct Entry {
    Problem problem;  ///< that the tables were built for
    SolverKind solver = SolverKind::kCertified;
    HeuristicKind heuristic = HeuristicKind::kCertificate;
    std::shared_ptr<const PlanningTables> tables;
  };
  static bool Serves(const Entry& entry, const Problem& problem, const SolverOptions& options);

  std::shared_ptr<const ArrayStore> store_;
  std::mutex mutex_;            // guards entries_
  std::vector<Entry> entries_;  // the last used comes last
};

}  // namespace feeler::planner
