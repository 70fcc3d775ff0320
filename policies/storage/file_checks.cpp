#include "feeler/policies/storage/file_checks.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <thread>

#include "feeler/policies/storage/database.h"

namespace feeler::policies {
namespace {

constexpr const char* kRestore = "restore it from a copy, or move it away and run feeler preprocess again";

std::uint32_t BigEndian(const std::array<unsigned char, SqliteConnection::kHeaderSize>& header, std::size_t at, int n) {
  std::uint32_t value = 0;
  for (int i = 0; i < n; ++i) value = value << 8 | header[at + static_cast<std::size_t>(i)];
  return value;
}

/// The pages that the header counts must be there, unless a log beside the file is being folded into it just now.
void CheckLength(const SqliteConnection& connection, const std::string& path) {
  for (int attempt = 0;; ++attempt) {
    const auto header = connection.ReadHeader();
    const std::uint32_t page_size = BigEndian(header, 16, 2);
    const std::int64_t expected = std::int64_t{page_size == 1 ? 65536 : page_size} * BigEndian(header, 28, 4);
    const std::int64_t size = FileSize(path);
    if (size >= expected || FileSize(path + "-wal") > 0) return;
    if (attempt == 3) throw Damaged(path, fmt::format("it is cut off ({} of {} bytes)", size, expected));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

}  // namespace

InputError Damaged(const std::string& path, const std::string& what) {
  return {path, "the database is damaged: " + what, kRestore};
}

InputError Translate(const SqliteFailure& failure, const std::string& path) {
  switch (failure.code) {
    case SQLITE_NOTADB: return {path, "is not a Feeler database", kMakeOne};
    case SQLITE_BUSY:
    case SQLITE_LOCKED: return {path, "another process holds the database", "wait until it is done"};
    case SQLITE_READONLY:
      return {path, "cannot be written (" + std::string(failure.what()) + ")",
              "check the permissions of the file and its folder; if a write was cut off, open it where it is writable"};
    case SQLITE_PERM:
    case SQLITE_AUTH:
    case SQLITE_CANTOPEN:
      return {path, "cannot be opened (" + std::string(failure.what()) + ")",
              "check that file and folder exist and that you may write there"};
    case SQLITE_FULL: return {path, "the disk is full", "free some space; the problems stored so far are kept"};
    case SQLITE_IOERR:
      return {path, "cannot be read or written (" + std::string(failure.what()) + ")", "check the disk"};
    case SQLITE_NOMEM: return {path, "not enough memory", "close other programs"};
    default: return Damaged(path, failure.what());
  }
}

std::int64_t FileSize(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 ? std::int64_t{status.st_size} : 0;
}

void RequireReadableFile(const std::string& path) {
  struct stat status {};
  if (path.empty() || stat(path.c_str(), &status) != 0) throw InputError(path, "no such file", kMakeOne);
  if (S_ISDIR(status.st_mode)) throw InputError(path, "is a directory", "give the name of a database file");
  if (!S_ISREG(status.st_mode)) throw InputError(path, "is not a regular file", "give the name of a database file");
  if (status.st_size == 0) throw InputError(path, "is empty", kMakeOne);
}

int CheckHeader(const SqliteConnection& connection, const std::string& path) {
  const auto header = connection.ReadHeader();
  if (BigEndian(header, 68, 4) != Database::kApplicationId) {
    throw InputError(path, "is an SQLite database of another application", kMakeOne);
  }
  const std::uint32_t version = BigEndian(header, 60, 4);
  if (version < 1 || version > Database::kVersion) {
    throw InputError(
        path,
        fmt::format("is a database of version {}, this feeler reads versions 1 to {}", version, Database::kVersion),
        "use the version of feeler that wrote it");
  }
  CheckLength(connection, path);
  return static_cast<int>(version);
}

const std::array<TableSchema, 3>& SchemaOf(int version) {
  switch (version) {
    case 1: return kSchemaVersion1;
    case 2: return kSchemaVersion2;
    default: return kSchemaVersion3;
  }
}

void CheckSchema(const SqliteConnection& connection, int version, const std::string& path) {
  std::map<std::string, std::string> tables;
  SqliteStatement statement(connection, "SELECT type, name, sql FROM sqlite_schema");
  while (statement.Step()) {
    const std::string type = statement.Text(0);
    if (type == "trigger") throw Damaged(path, "it contains a trigger");
    if (type == "table") tables[statement.Text(1)] = statement.Text(2);
  }
  for (const TableSchema& table : SchemaOf(version)) {
    const auto found = tables.find(table.name);
    if (found == tables.end() || found->second != table.sql) {
      throw Damaged(path, fmt::format("table {} is missing or altered", table.name));
    }
  }
}

}  // namespace feeler::policies
