#pragma once

#include <sqlite3.h>

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace feeler::policies {

/// A failed SQLite call: its primary result code and message. The database turns it into an InputError that names the
/// file and the mend; it does not leave this room.
class SqliteFailure : public std::runtime_error {
 public:
  SqliteFailure(int code_in, const std::string& message) : std::runtime_error(message), code(code_in & 0xFF) {}
  int code;
};

/// A connection to one database file. Not thread-safe.
class SqliteConnection {
 public:
  /// Opens an existing file. A writer logs ahead (no wait for the disk at each commit, yet consistent whatever
  /// happens); a reader still lets SQLite finish what a killed writer logged, where the folder permits, and reads a
  /// file without a log where nothing can be written. Throws SqliteFailure.
  SqliteConnection(const std::string& path, bool writable);
  ~SqliteConnection();
  SqliteConnection(const SqliteConnection&) = delete;
  SqliteConnection& operator=(const SqliteConnection&) = delete;

  /// Folds the log back into the file and leaves write-ahead mode, so that the file stands alone. Left to a later
  /// writer if readers are about.
  void Settle();
  /// Runs statements that return nothing of interest. Throws SqliteFailure.
  void Execute(const char* sql);
  /// First column of the first row. Throws SqliteFailure if there is none.
  std::int64_t QueryInteger(const char* sql);

  static constexpr std::size_t kHeaderSize = 100;
  /// The first 100 bytes, read through SQLite's own descriptor (closing another one would drop its locks); fewer bytes
  /// in the file read as zeros.
  std::array<unsigned char, kHeaderSize> ReadHeader() const;
  sqlite3* handle() const { return handle_; }

 private:
  void Open(const std::string& name, int flags);
  void Configure(bool writable);

  sqlite3* handle_ = nullptr;
};

/// A prepared statement. Columns are read with their type checked: the wrong type is a sign of damage, and throws.
class SqliteStatement {
 public:
  SqliteStatement(const SqliteConnection& connection, const char* sql);
  ~SqliteStatement() { sqlite3_finalize(statement_); }
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  SqliteStatement& Bind(int index, std::int64_t value);
  SqliteStatement& Bind(int index, double value);
  SqliteStatement& Bind(int index, std::string_view text);
  SqliteStatement& BindBlob(int index, std::string_view bytes);
  SqliteStatement& BindNull(int index);

  /// True while there is a row. Throws SqliteFailure.
  bool Step();
  /// Makes it ready to run again and lets go of its locks.
  void Reset();

  std::int64_t Integer(int column) const;
  double Real(int column) const;
  std::string Text(int column) const;
  std::string Blob(int column) const;
  bool IsNull(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

 private:
  void Check(int code) const;
  void RequireType(int column, int type) const;

  sqlite3* connection_;
  sqlite3_stmt* statement_ = nullptr;
};

/// Resets a statement when the scope ends, so that no read lock outlives its use.
class SqliteReset {
 public:
  explicit SqliteReset(SqliteStatement& statement) : statement_(statement) {}
  ~SqliteReset() { statement_.Reset(); }
  SqliteReset(const SqliteReset&) = delete;
  SqliteReset& operator=(const SqliteReset&) = delete;

 private:
  SqliteStatement& statement_;
};

/// Rolls back unless committed. Nested use is an error.
class SqliteTransaction {
 public:
  enum class Kind { kRead, kWrite };
  SqliteTransaction(SqliteConnection& connection, Kind kind);
  ~SqliteTransaction();
  void Commit();
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;

 private:
  SqliteConnection& connection_;
  bool open_ = true;
};

}  // namespace feeler::policies
