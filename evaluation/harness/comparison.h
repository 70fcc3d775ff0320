#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "feeler/planner/solve.h"

namespace feeler::evaluation {

/// What became of one attempt at one problem.
struct SolveRecord {
  std::string status;  ///< planner::ToString(SolverStatus)
  bool complete = false;
  double expected_cost = 0.0;  ///< meaningless unless complete
  double lower_bound = 0.0;
  std::int64_t expansions = 0;
  double cpu_s = 0.0;
  double wall_s = 0.0;
};
SolveRecord RecordOf(const planner::SolverResult& result);
/// Law: RecordFromJson(ToJson(r)) = r; the cost of an incomplete record is null.
nlohmann::json ToJson(const SolveRecord& record);
SolveRecord RecordFromJson(const nlohmann::json& json);

/// Which way the truth lies from a ratio of efforts when some of them were cut short by a limit. An attempt that a
/// limit stopped is entered with what it had used, which is less than it needs.
enum class BoundKind {
  kExact,
  kLower,    ///< only the base was cut short: the true ratio is at least this
  kUpper,    ///< only the other was cut short: at most this
  kUnknown,  ///< both
};
/// "exact", "lower", "upper", "unknown".
std::string ToString(BoundKind kind);

/// How much less effort `other` takes than `base`, attempt by attempt the same problem and seed.
struct Speedup {
  double cpu = 1.0;                   ///< sum of CPU time of base / of other
  double expansions = 1.0;            ///< the same with expansions
  double cpu_geometric = 1.0;         ///< geometric mean of the ratios of the attempts
  double expansions_geometric = 1.0;  ///< the same with expansions
  BoundKind bound = BoundKind::kExact;
};
/// Equally many records, in the same order. Efforts below 1 us or one expansion count as that.
Speedup SpeedupOf(const std::vector<SolveRecord>& base, const std::vector<SolveRecord>& other);

/// Mean over attempts of expected cost of `other` / of `base`.
struct RelativeCost {
  double mean = 0.0;  ///< 0 if there is no attempt
  int attempts = 0;   ///< attempts that count
};
/// Over the attempts that both solved.
RelativeCost RelativeCostOf(const std::vector<SolveRecord>& base, const std::vector<SolveRecord>& other);
/// Over the attempts that `other` and `reference` solved and `excluded` did not.
RelativeCost RelativeCostOfRest(const std::vector<SolveRecord>& reference, const std::vector<SolveRecord>& excluded,
                                const std::vector<SolveRecord>& other);

}  // namespace feeler::evaluation
