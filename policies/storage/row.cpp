#include "feeler/policies/storage/row.h"

#include <bit>
#include <cmath>
#include <stdexcept>

#include "feeler/core/error.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/policies/io/bytes.h"
#include "feeler/policies/io/policy_blob.h"
#include "feeler/policies/storage/hash.h"

namespace feeler::policies {
namespace {

bool SameBits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

}  // namespace

bool StoredProblem::certified() const { return solver == planner::ToString(planner::SolverKind::kCertified); }

double StoredProblem::Ratio() const {
  if (lower_bound > 0.0) return expected_cost / lower_bound;
  return expected_cost == lower_bound ? 1.0 : std::numeric_limits<double>::infinity();
}

std::string ExtentsKey(const planner::Extents& extents) { return planner::ToString(extents); }

std::string RowBytes(const ProblemRow& row) {
  const StoredProblem& p = row.problem;
  ByteWriter out;
  out.Text(ExtentsKey(p.extents));
  out.Text(p.status);
  out.Text(p.solver);
  out.Double(p.Promise());
  out.Double(p.expected_cost);
  out.Double(p.lower_bound);
  out.Signed(p.expansions);
  out.Fixed64(p.seed);
  out.Text(p.version);
  out.Text(row.blob);
  return out.Take();
}

std::uint64_t RowChecksum(const ProblemRow& row) { return Hash64(RowBytes(row)); }

std::uint64_t TimingChecksum(const std::string& extents_key, double cpu_s, double wall_s) {
  ByteWriter out;
  out.Text(extents_key);
  out.Double(cpu_s);
  out.Double(wall_s);
  return Hash64(out.bytes());
}

ProblemRow ToRow(const StoredProblem& problem) {
  const auto require = [&](bool condition, const char* what) {
    if (!condition) throw std::invalid_argument("problem " + ExtentsKey(problem.extents) + ": " + what);
  };
  for (int axis = 0; axis < planner::kAxisKinds; ++axis) require(problem.extents[axis] >= 1, "extents below 1");
  require(!std::isnan(problem.epsilon), "epsilon is not a number");
  require(!std::isnan(problem.gap), "gap is not a number");
  require((problem.certified() ? problem.epsilon : problem.gap) == 1.0, "has both an inflation and a gap");
  require(problem.lower_bound >= 0.0 && std::isfinite(problem.lower_bound), "lower bound negative or not finite");
  require(std::isfinite(problem.cpu_s) && std::isfinite(problem.wall_s), "times are not finite");
  ProblemRow row{problem, ""};
  row.problem.epsilon += 0.0;  // SQLite does not keep the sign of zero
  row.problem.gap += 0.0;
  row.problem.policy.reset();
  if (problem.policy) {
    require(SameBits(problem.policy->expected_cost, problem.expected_cost), "expected cost is not the policy's");
    require(SameBits(problem.policy->lower_bound, problem.lower_bound), "lower bound is not the policy's");
    row.blob = EncodePolicyBlob(*problem.policy);
  } else {
    require(problem.expected_cost == std::numeric_limits<double>::infinity(), "expected cost without a policy");
  }
  return row;
}

StoredProblem FromRow(const ProblemRow& row, const std::string& where) {
  StoredProblem problem = row.problem;
  if (row.blob.empty()) return problem;
  problem.policy = DecodePolicyBlob(row.blob, where);
  if (!SameBits(problem.policy->expected_cost, problem.expected_cost) ||
      !SameBits(problem.policy->lower_bound, problem.lower_bound)) {
    throw InputError(where, "the row's numbers are not those of its policy",
                     "restore the file from a copy, or move it away and run feeler preprocess again");
  }
  return problem;
}

}  // namespace feeler::policies
