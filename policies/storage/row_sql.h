#pragma once

#include <cstdint>
#include <string>

#include "feeler/policies/storage/row.h"
#include "feeler/policies/storage/sqlite.h"

namespace feeler::policies {

/// Statements over the tables of problems and their times; angle counts are 1 in files of version 1.
std::string SelectOne(int version);
/// In the order of the extents.
std::string SelectAll(int version);
/// Parameters 1 to 14 as in version 1, then the angles.
std::string InsertOrUpdate(int version);

struct CheckedRow {
  ProblemRow row;
  std::uint64_t checksum = 0;
};

/// The row that a statement of SelectOne or SelectAll stands on. Throws InputError if it differs from what was stored.
CheckedRow ReadRow(const SqliteStatement& statement, const std::string& path);

/// How a row is named in errors.
std::string RowName(const std::string& path, const ProblemRow& row);

}  // namespace feeler::policies
