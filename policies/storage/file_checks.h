#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "feeler/core/error.h"
#include "feeler/policies/storage/schema.h"
#include "feeler/policies/storage/sqlite.h"

namespace feeler::policies {

/// What is said of a database file whose content is not what was written.
InputError Damaged(const std::string& path, const std::string& what);
/// What a failure of SQLite means for the one who named the file.
InputError Translate(const SqliteFailure& failure, const std::string& path);

/// Runs `body`, its SQLite failures turned into InputErrors.
template <typename Body>
auto Guarded(const std::string& path, const Body& body) {
  try {
    return body();
  } catch (const SqliteFailure& failure) {
    throw Translate(failure, path);
  }
}

/// What to do about a path without a database.
inline constexpr const char* kMakeOne = "make one with feeler preprocess --out";

/// In bytes; 0 if there is no such file.
std::int64_t FileSize(const std::string& path);
/// Throws InputError unless there is a file of some content at `path`.
void RequireReadableFile(const std::string& path);

/// The fields of the SQLite header that make the file ours; then its length. Returns the version. To be called in a
/// transaction. Throws InputError for a file of another application or version, or one that is cut off.
int CheckHeader(const SqliteConnection& connection, const std::string& path);

/// The tables of a version.
const std::array<TableSchema, 3>& SchemaOf(int version);
/// Throws InputError unless the tables are those of the version, and nothing acts on them.
void CheckSchema(const SqliteConnection& connection, int version, const std::string& path);

}  // namespace feeler::policies
