#include "feeler/policies/storage/row_sql.h"

#include <fmt/format.h>

#include <algorithm>

#include "feeler/policies/storage/file_checks.h"

namespace feeler::policies {
namespace {

std::string Select(int version, const char* tail) {
  return fmt::format(
      "SELECT problems.extents, nx, ny, nz, status, solver, epsilon, expected_cost, lower_bound, expansions, seed, "
      "version, problems.checksum, policy, cpu_s, wall_s, timings.checksum, {}, {} FROM problems LEFT JOIN timings ON "
      "timings.extents = problems.extents {}",
      version == 1 ? "1, 1" : "n_yaw, n_pitch", version < 3 ? "epsilon" : "gap", tail);
}
}  // namespace

std::string SelectOne(int version) { return Select(version, "WHERE problems.extents = ?"); }
std::string SelectAll(int version) {
  return Select(version, version == 1 ? "ORDER BY nx, ny, nz" : "ORDER BY nx, ny, nz, n_yaw, n_pitch");
}
std::string InsertOrUpdate(int version) {
  return fmt::format(
      "INSERT INTO problems (extents, nx, ny, nz, status, solver, epsilon, expected_cost, lower_bound, expansions, "
      "seed, version, checksum, policy{}{}) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14{}{}) "
      "ON "
      "CONFLICT (extents) DO UPDATE SET status = ?5, solver = ?6, epsilon = ?7, expected_cost = ?8, lower_bound = ?9, "
      "expansions = ?10, seed = ?11, version = ?12, checksum = ?13, policy = ?14{}",
      version == 1 ? "" : ", n_yaw, n_pitch", version < 3 ? "" : ", gap", version == 1 ? "" : ", ?15, ?16",
      version < 3 ? "" : ", ?17", version < 3 ? "" : ", gap = ?17");
}

CheckedRow ReadRow(const SqliteStatement& statement, const std::string& path) {
  const std::string key = statement.Text(0);
  CheckedRow checked;
  StoredProblem& problem = checked.row.problem;
  const auto extent = [&](int column) {
    return static_cast<int>(std::clamp<std::int64_t>(statement.Integer(column), 0, 1 << 20));
  };
  problem.extents = {extent(1), extent(2), extent(3), extent(17), extent(18)};
  problem.status = statement.Text(4);
  problem.solver = statement.Text(5);
  // Up to version 2 one column holds either.
  if (problem.certified()) {
    problem.gap = statement.Real(19);
  } else {
    problem.epsilon = statement.Real(6);
  }
  if (!statement.IsNull(7)) problem.expected_cost = statement.Real(7);
  problem.lower_bound = statement.Real(8);
  problem.expansions = statement.Integer(9);
  problem.seed = static_cast<std::uint64_t>(statement.Integer(10));
  problem.version = statement.Text(11);
  if (!statement.IsNull(13)) checked.row.blob = statement.Blob(13);
  checked.checksum = static_cast<std::uint64_t>(statement.Integer(12));
  if (key != ExtentsKey(problem.extents) || checked.checksum != RowChecksum(checked.row)) {
    throw Damaged(path, "the row of problem " + key + " is altered");
  }
  if (statement.IsNull(14)) throw Damaged(path, "the times of problem " + key + " are missing");
  problem.cpu_s = statement.Real(14);
  problem.wall_s = statement.Real(15);
  if (static_cast<std::uint64_t>(statement.Integer(16)) != TimingChecksum(key, problem.cpu_s, problem.wall_s)) {
    throw Damaged(path, "the times of problem " + key + " are altered");
  }
  return checked;
}

std::string RowName(const std::string& path, const ProblemRow& row) {
  return path + ", problem " + ExtentsKey(row.problem.extents);
}

}  // namespace feeler::policies
