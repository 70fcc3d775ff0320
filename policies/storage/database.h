#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::policies {

/// One of `count` files that hold a family together.
struct DatabaseShard {
  int index = 1;  ///< from 1
  int count = 1;
  std::int64_t problems = 0;  ///< of the family that fall to this file
  std::int64_t family = 0;    ///< problems of the family
  std::string digest;         ///< of the list of the family's problems
  bool operator==(const DatabaseShard&) const = default;
};

/// What a database was made for and how. A database continues only under the same identity (`created_by` excepted):
/// policies of two geometries or two settings never mix.
struct DatabaseIdentity {
  std::string task;             ///< name
  std::string fingerprint;      ///< of model geometry, lattice and costs
  std::string opening;          ///< "closed" or "open" while localizing
  std::string goal;             ///< "singleton" or "insertable"
  CostWeights cost;             ///< of a guarded move
  std::string settings = "{}";  ///< of the solver, a JSON object
  std::string created_by;       ///< version of feeler that made the file
  /// The uncertain axes of the task, in its order (files of version 1: x, y, z). For reading and printing extents; what
  /// the database is made for is said by the fingerprint.
  std::vector<AxisKind> axes = {AxisKind::kX, AxisKind::kY, AxisKind::kZ};
  /// What part of a family the file is to hold; no part of the content digest.
  std::optional<DatabaseShard> shard = std::nullopt;
};

/// One problem of the family and what became of it.
struct StoredProblem {
  planner::Extents extents;
  std::string status;  ///< planner::ToString(SolverStatus)
  std::string solver;  ///< planner::ToString(SolverKind)
  /// What it was solved with: the inflation of the heuristic by rtdp-bel and e-rtdp-bel, the gap by the certified
  /// solver; the other one is 1.
  double epsilon = 1.0;
  double gap = 1.0;
  double expected_cost = std::numeric_limits<double>::infinity();  ///< the policy's; infinity without a policy
  double lower_bound = 0.0;                                        ///< proven
  std::int64_t expansions = 0;
  std::uint64_t seed = 0;
  std::string version;                         ///< of feeler that solved it
  std::optional<planner::PolicyGraph> policy;  ///< complete policy, if there is one
  double cpu_s = 0.0;                          ///< measured; stands in a table of its own and is no part of the content
  double wall_s = 0.0;

  bool certified() const;
  /// The one of epsilon and gap that it was solved with.
  double Promise() const { return certified() ? gap : epsilon; }
  /// Expected cost / lower bound; 1 if both are zero; infinity without a policy or a bound.
  double Ratio() const;
};

/// How many policies have a certified ratio above the previous bin's edge and up to this one.
struct RatioBin {
  double up_to = 1.0;
  std::int64_t count = 0;
};

/// Sums over a database; means and maxima over the problems with a complete policy (zero if there are none).
struct DatabaseInfo {
  std::int64_t problems = 0;                     ///< rows
  std::int64_t solved = 0;                       ///< with a complete policy
  std::map<std::string, std::int64_t> statuses;  ///< status -> rows
  double ratio_mean = 0.0;
  double ratio_max = 0.0;
  double expected_cost_mean = 0.0;
  double cpu_s = 0.0;  ///< sum
  double wall_s = 0.0;
  std::int64_t policy_nodes = 0;
  std::int64_t bytes = 0;  ///< size of the file
  std::vector<RatioBin> ratios;
};

/// The policies of a problem family for one task, in one SQLite file (layout: docs/file-formats.md).
///
/// Laws: a process killed at any moment loses only the problem in flight (a power cut: those of the last moments; the
/// file stays whole); Get returns what was Put, doubles bit for bit, or throws: an altered byte never yields another
/// policy; one writer at a time, readers beside it; no side files once closed. All operations throw InputError (file,
/// what, how to mend) for anything wrong with the file.
///
/// A Database may be used from several threads; calls are serialized.
class Database {
 public:
  static constexpr std::uint32_t kApplicationId = 0x4645454C;  ///< "FEEL"
  static constexpr int kVersion = 3;  ///< user_version of files made; older are continued as they are

  /// A new file; an existing one must be empty. Killed half-way it leaves an empty file, which counts as absent.
  static Database Create(const std::string& path, const DatabaseIdentity& identity);
  /// An existing database made under the same identity, to be continued. Its content is verified first.
  static Database OpenForAppend(const std::string& path, const DatabaseIdentity& identity);
  /// OpenForAppend if there is a file that is not empty, else Create.
  static Database OpenOrCreate(const std::string& path, const DatabaseIdentity& identity);
  static Database OpenReadOnly(const std::string& path);

  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  const std::string& path() const;
  const DatabaseIdentity& identity() const;
  /// Throws InputError unless the database was made for the task with this fingerprint.
  void RequireFingerprint(const std::string& task, const std::string& fingerprint) const;

  /// Stores a problem, replacing an earlier row for the same extents; one transaction. The policy must be lawful
  /// (FindPolicyFault), its cost and bound those of the record. Throws std::invalid_argument otherwise, InputError if
  /// the file cannot be written.
  void Put(const StoredProblem& problem);

  /// The problem with these extents, or nothing if there is none.
  std::optional<StoredProblem> Get(const planner::Extents& extents);
  bool Contains(const planner::Extents& extents);
  /// All problems in lexicographic order of extents; the visitor must not call back into the database.
  void ForEach(const std::function<void(const StoredProblem&)>& visit);
  /// All problems without their policies, in lexicographic order.
  std::vector<StoredProblem> List();
  DatabaseInfo Info();

  /// 32 hexadecimal digits over identity and problems; measured times, order of insertion and page layout do not
  /// matter. Equal digests: the same database.
  std::string ContentDigest();

  /// Checks the whole file: SQLite's structure, every row's checksum, the sum over rows, every policy's laws. Throws
  /// InputError at the first fault.
  void Verify();

 private:
  struct State;
  explicit Database(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace feeler::policies
