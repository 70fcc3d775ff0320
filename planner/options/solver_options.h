#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string_view>

#include "feeler/core/progress.h"

namespace feeler::planner {

enum class SolverKind { kRtdpBel, kERtdpBel, kCertified };
enum class HeuristicKind {
  kCertificate,   ///< mean cost to tell each hypothesis from its neighbours: tight, the default
  kLines,         ///< exact values of lines of hypotheses: medium, the paper setting
  kFirstContact,  ///< distance to the first possible contact: weak
  kCuboids,       ///< values of all cuboids of hypotheses: tightest; seconds to minutes of tables, up to 1 GB
};
/// Which beliefs of the experience E-RTDP-Bel may jump to (heur(b,b') of equation 5; see JumpHeuristic).
enum class JumpKind {
  kSameHypotheses,  ///< those with the same hypotheses: no policy leads from b to fewer for certain. The default
  kSubsets,         ///< also those with fewer: a jump then counts the hypotheses it drops as dealt with
};
/// "rtdp-bel", "e-rtdp-bel", "certified"; "certificate", "lines", "first-contact", "cuboids"; "same", "subsets".
std::string_view ToString(SolverKind kind);
std::string_view ToString(HeuristicKind kind);
std::string_view ToString(JumpKind kind);

/// One row of the bounds table that a solver reports as it goes.
struct BoundsRow {
  double wall_s = 0.0;
  std::int64_t trials = 0;
  std::int64_t expansions = 0;
  double lower_bound = 0.0;
  double upper_bound = std::numeric_limits<double>::infinity();  ///< exact cost of the best complete policy so far
  double Ratio() const {
    return lower_bound > 0.0            ? upper_bound / lower_bound
           : upper_bound == lower_bound ? 1.0
                                        : std::numeric_limits<double>::infinity();
  }
};

/// Gaps below this are out of reach of certificates.
inline constexpr double kTightGap = 1.1;

struct SolverOptions {
  SolverKind solver = SolverKind::kCertified;
  /// RTDP-Bel and E-RTDP-Bel: inflation of the heuristic; the policy costs at most epsilon times the optimum. >= 1.
  double epsilon = 1.2;
  /// Certified solver: stop when expected cost <= gap * lower bound. >= 1; 1 proves optimality.
  double gap = 1.2;
  double time_limit_s = std::numeric_limits<double>::infinity();            ///< wall time; > 0
  double cpu_limit_s = std::numeric_limits<double>::infinity();             ///< CPU time of the solving thread; > 0
  std::int64_t expansion_limit = std::numeric_limits<std::int64_t>::max();  ///< the deterministic budget; >= 1
  /// Limits and cancellation hold for the first policy of the certified solver too, so that there may be none in the
  /// end. True: it is completed whatever time, CPU time and expansions it takes (not against cancellation and memory);
  /// for who needs some policy at any budget.
  bool first_policy_in_any_case = false;
  /// Stop when the belief store (about 1 kB an expansion), the values that the searches keep, what the heuristic has
  /// cached and the tables together, which all problems of a family share, have grown to this.
  std::size_t memory_limit_bytes = std::size_t{1} << 32;
  std::uint64_t seed = 1;
  HeuristicKind heuristic = HeuristicKind::kCertificate;
  /// Families of problems at a gap below kTightGap take cuboids for certificates: see WithFamilyBudget.
  bool cuboids_where_tight = true;
  /// Beliefs that are translates of each other count as one. Only used where that is exact: uniform weights, a generous
  /// workspace. Off is the paper's setting. E-RTDP-Bel always works without.
  bool canonical_translation = true;
  JumpKind jumps = JumpKind::kSameHypotheses;       ///< of E-RTDP-Bel
  const CancellationToken* cancellation = nullptr;  ///< may be null
  ProgressCallback on_tables;                       ///< while tables over orientations are built; may be empty
  std::function<void(const BoundsRow&)> on_bounds;  ///< the bounds table; may be empty; called from the solving thread
};

/// Throws InputError naming the option if one is out of range or not a number.
void Validate(const SolverOptions& options);

/// The paper's algorithms as printed: no canonical translation, lines of hypotheses.
SolverOptions PaperSetting(SolverKind solver, double epsilon);
/// Canonical translation and the certificate heuristic.
SolverOptions FastSetting(SolverKind solver, double epsilon);

}  // namespace feeler::planner
