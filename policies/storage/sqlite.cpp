#include "feeler/policies/storage/sqlite.h"

#include <sys/stat.h>

namespace feeler::policies {
namespace {

constexpr int kBusyTimeoutMs = 10'000;
constexpr int kSettleTimeoutMs = 100;
constexpr int kMaxValueBytes = 1 << 27;

/// True if a log stands beside the file that holds what the file lacks.
bool HasLog(const std::string& path) {
  struct stat status {};
  return stat((path + "-wal").c_str(), &status) == 0 && status.st_size > 0;
}

std::string EscapeUri(const std::string& path) {
  std::string escaped;
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '#') {
      constexpr char kDigits[] = "0123456789ABCDEF";
      escaped += {'%', kDigits[static_cast<unsigned char>(c) >> 4], kDigits[c & 15]};
    } else {
      escaped += c;
    }
  }
  return escaped;
}

sqlite3_file* FileOf(sqlite3* handle) {
  sqlite3_file* file = nullptr;
  if (sqlite3_file_control(handle, "main", SQLITE_FCNTL_FILE_POINTER, &file) != SQLITE_OK || file == nullptr ||
      file->pMethods == nullptr) {
    throw SqliteFailure(SQLITE_CANTOPEN, "the file is not open");
  }
  return file;
}

}  // namespace

SqliteConnection::SqliteConnection(const std::string& path, bool writable) {
  // Names such as ":memory:" mean something else to SQLite.
  const std::string name = !path.empty() && path.front() == ':' ? "./" + path : path;
  try {
    Open(name, SQLITE_OPEN_READWRITE);
    Configure(writable);
    try {
      QueryInteger("SELECT count(*) FROM sqlite_schema");
    } catch (const SqliteFailure& failure) {
      const bool blocked = failure.code == SQLITE_CANTOPEN || failure.code == SQLITE_READONLY;
      if (writable || !blocked || HasLog(path)) throw;
      // In write-ahead mode, closed cleanly, on a medium where no log can be made: nothing can change, read it so.
      sqlite3_close(handle_);
      handle_ = nullptr;
      Open("file:" + EscapeUri(name) + "?immutable=1", SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
      Configure(writable);
    }
  } catch (const SqliteFailure&) {
    sqlite3_close(handle_);
    throw;
  }
}

void SqliteConnection::Open(const std::string& name, int flags) {
  const int code = sqlite3_open_v2(name.c_str(), &handle_, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  if (code != SQLITE_OK) throw SqliteFailure(code, handle_ != nullptr ? sqlite3_errmsg(handle_) : "out of memory");
}

void SqliteConnection::Configure(bool writable) {
  sqlite3_busy_timeout(handle_, kBusyTimeoutMs);
  // The file may come from anywhere: no code hidden in its schema runs, and no length in it is believed.
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_limit(handle_, SQLITE_LIMIT_LENGTH, kMaxValueBytes);
  Execute(writable ? "PRAGMA cell_size_check=ON; PRAGMA secure_delete=ON; PRAGMA synchronous=NORMAL"
                   : "PRAGMA cell_size_check=ON; PRAGMA query_only=ON");
}

SqliteConnection::~SqliteConnection() { sqlite3_close(handle_); }

void SqliteConnection::Settle() {
  sqlite3_busy_timeout(handle_, kSettleTimeoutMs);
  sqlite3_exec(handle_, "PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode=DELETE", nullptr, nullptr, nullptr);
}

void SqliteConnection::Execute(const char* sql) {
  const int code = sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) throw SqliteFailure(code, sqlite3_errmsg(handle_));
}

std::int64_t SqliteConnection::QueryInteger(const char* sql) {
  SqliteStatement statement(*this, sql);
  if (!statement.Step()) throw SqliteFailure(SQLITE_CORRUPT, "no answer");
  return statement.Integer(0);
}

std::array<unsigned char, SqliteConnection::kHeaderSize> SqliteConnection::ReadHeader() const {
  std::array<unsigned char, kHeaderSize> header{};
  sqlite3_file* file = FileOf(handle_);
  const int code = file->pMethods->xRead(file, header.data(), static_cast<int>(header.size()), 0);
  if (code != SQLITE_OK && code != SQLITE_IOERR_SHORT_READ) throw SqliteFailure(code, sqlite3_errstr(code));
  return header;
}

SqliteStatement::SqliteStatement(const SqliteConnection& connection, const char* sql)
    : connection_(connection.handle()) {
  Check(sqlite3_prepare_v2(connection_, sql, -1, &statement_, nullptr));
}

void SqliteStatement::Check(int code) const {
  if (code != SQLITE_OK) throw SqliteFailure(code, sqlite3_errmsg(connection_));
}

SqliteStatement& SqliteStatement::Bind(int index, std::int64_t value) {
  Check(sqlite3_bind_int64(statement_, index, value));
  return *this;
}

SqliteStatement& SqliteStatement::Bind(int index, double value) {
  Check(sqlite3_bind_double(statement_, index, value));
  return *this;
}

SqliteStatement& SqliteStatement::Bind(int index, std::string_view text) {
  Check(sqlite3_bind_text64(statement_, index, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

SqliteStatement& SqliteStatement::BindBlob(int index, std::string_view bytes) {
  Check(sqlite3_bind_blob64(statement_, index, bytes.data(), bytes.size(), SQLITE_TRANSIENT));
  return *this;
}

SqliteStatement& SqliteStatement::BindNull(int index) {
  Check(sqlite3_bind_null(statement_, index));
  return *this;
}

bool SqliteStatement::Step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  throw SqliteFailure(code, sqlite3_errmsg(connection_));
}

void SqliteStatement::Reset() { sqlite3_reset(statement_); }

void SqliteStatement::RequireType(int column, int type) const {
  if (sqlite3_column_type(statement_, column) != type) {
    throw SqliteFailure(SQLITE_CORRUPT, "a value has the wrong type");
  }
}

std::int64_t SqliteStatement::Integer(int column) const {
  RequireType(column, SQLITE_INTEGER);
  return sqlite3_column_int64(statement_, column);
}

double SqliteStatement::Real(int column) const {
  RequireType(column, SQLITE_FLOAT);
  return sqlite3_column_double(statement_, column);
}

std::string SqliteStatement::Text(int column) const {
  RequireType(column, SQLITE_TEXT);
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  if (text == nullptr) throw SqliteFailure(SQLITE_NOMEM, "out of memory");
  return {text, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

std::string SqliteStatement::Blob(int column) const {
  RequireType(column, SQLITE_BLOB);
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  return size == 0 ? std::string() : std::string(bytes, size);
}

SqliteTransaction::SqliteTransaction(SqliteConnection& connection, Kind kind) : connection_(connection) {
  connection_.Execute(kind == Kind::kWrite ? "BEGIN IMMEDIATE" : "BEGIN");
}

SqliteTransaction::~SqliteTransaction() {
  if (open_) sqlite3_exec(connection_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void SqliteTransaction::Commit() {
  connection_.Execute("COMMIT");
  open_ = false;
}

}  // namespace feeler::policies
