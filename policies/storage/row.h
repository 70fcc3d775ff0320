#pragma once

#include <cstdint>
#include <string>

#include "feeler/policies/storage/database.h"

namespace feeler::policies {

/// A problem as its table row holds it: the policy as blob (empty if there is none).
struct ProblemRow {
  StoredProblem problem;  ///< without policy and times
  std::string blob;
};

/// "7x7x5", "10x10x1x6x6" where there are angles.
std::string ExtentsKey(const planner::Extents& extents);

/// The bytes a row's checksum and the content digest are taken over: every column but the row number.
std::string RowBytes(const ProblemRow& row);
std::uint64_t RowChecksum(const ProblemRow& row);
std::uint64_t TimingChecksum(const std::string& extents_key, double cpu_s, double wall_s);

/// Throws std::invalid_argument if the record contradicts itself or its policy breaks a law.
ProblemRow ToRow(const StoredProblem& problem);
/// Decodes the policy. Throws InputError if the blob is damaged or contradicts the row; `where` names it.
StoredProblem FromRow(const ProblemRow& row, const std::string& where);

}  // namespace feeler::policies
