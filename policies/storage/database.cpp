#include "policies/storage/database.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>
#include <utility>

#include "core/error.h"
#include "policies/formats/bytes.h"
#include "policies/storage/hash.h"
#include "policies/storage/row.h"
#include "policies/storage/schema.h"
#include "policies/storage/sqlite.h"
#include "policies/storage/writer_lock.h"

namespace feeler::policies {
namespace {

using nlohmann::json;

constexpr const char* kRestore = "restore it from a copy, or delete it and run feeler preprocess again";
constexpr const char* kMakeOne = "make one with feeler preprocess --out";

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

/// Runs `body`, its SQLite failures turned into InputErrors.
template <typename Body>
auto Guarded(const std::string& path, const Body& body) {
  try {
    return body();
  } catch (const SqliteFailure& failure) {
    throw Translate(failure, path);
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

/// The fields of the SQLite header that make the file ours; then its length. Returns the version. To be called in a
/// transaction.
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

const std::array<TableSchema, 3>& SchemaOf(int version) { return version == 1 ? kSchemaVersion1 : kSchemaVersion2; }

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

// --- meta: key -> value, with a checksum over all of it
// ----------------------------------------------------------------

using Meta = std::map<std::string, std::string>;
constexpr const char* kMetaChecksum = "checksum";
constexpr const char* kMetaAxes = "axes";         // since version 2
constexpr const char* kMetaCount = "problems";    // rows of the table problems
constexpr const char* kMetaSum = "problems_sum";  // of their checksums, modulo 2^64: a lost row shows

std::string MetaChecksum(const Meta& meta) {
  ByteWriter out;
  for (const auto& [key, value] : meta) {
    if (key == kMetaChecksum) continue;
    out.Text(key);
    out.Text(value);
  }
  return fmt::format("{:016x}", Hash64(out.bytes()));
}

Meta ReadMeta(const SqliteConnection& connection, const std::string& path) {
  Meta meta;
  SqliteStatement statement(connection, "SELECT key, value FROM meta");
  while (statement.Step()) meta[statement.Text(0)] = statement.Text(1);
  if (meta[kMetaChecksum] != MetaChecksum(meta)) throw Damaged(path, "table meta is altered");
  return meta;
}

void WriteMeta(const SqliteConnection& connection, const Meta& meta) {
  SqliteStatement statement(connection, "INSERT OR REPLACE INTO meta (key, value) VALUES (?, ?)");
  for (const auto& [key, value] : meta) {
    statement.Bind(1, std::string_view(key)).Bind(2, std::string_view(value)).Step();
    statement.Reset();
  }
}

std::string AxesText(const std::vector<AxisKind>& axes) {
  std::string text;
  for (const AxisKind axis : axes) text += (text.empty() ? "" : ",") + std::string(ToString(axis));
  return text;
}

std::vector<AxisKind> ParseAxes(const std::string& text, const std::string& path) {
  std::vector<AxisKind> axes;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string word = text.substr(at, end - at);
    int kind = 0;
    while (kind < planner::kAxisKinds && ToString(static_cast<AxisKind>(kind)) != word) ++kind;
    if (kind == planner::kAxisKinds) throw Damaged(path, "table meta names an unknown axis");
    axes.push_back(static_cast<AxisKind>(kind));
    at = end + 1;
  }
  return axes;
}

json CostJson(const CostWeights& cost) {
  return {{"per_cell", cost.per_cell}, {"per_contact", cost.per_contact}, {"per_action", cost.per_action}};
}

Meta ToMeta(const DatabaseIdentity& identity) {
  const json settings = json::parse(identity.settings, nullptr, false);
  if (!settings.is_object()) throw std::invalid_argument("DatabaseIdentity: settings is not a JSON object");
  return {{"task", identity.task},
          {"fingerprint", identity.fingerprint},
          {"opening", identity.opening},
          {"goal", identity.goal},
          {"cost", CostJson(identity.cost).dump()},
          {"settings", settings.dump()},
          {"created_by", identity.created_by}};
}

DatabaseIdentity FromMeta(const Meta& meta, const std::string& path) {
  try {
    const json cost = json::parse(meta.at("cost"));
    DatabaseIdentity identity{meta.at("task"),
                              meta.at("fingerprint"),
                              meta.at("opening"),
                              meta.at("goal"),
                              {cost.at("per_cell"), cost.at("per_contact"), cost.at("per_action")},
                              meta.at("settings"),
                              meta.at("created_by")};
    const auto axes = meta.find(kMetaAxes);
    if (axes != meta.end()) identity.axes = ParseAxes(axes->second, path);
    return identity;
  } catch (const std::exception&) {  // a key is missing or is not JSON
    throw Damaged(path, "table meta lacks an entry");
  }
}

void RequireSameIdentity(const Meta& stored, const DatabaseIdentity& identity, const std::string& path) {
  const Meta wanted = ToMeta(identity);
  // The fingerprint covers costs and goal, too: they are named first.
  for (const char* key : {"task", "cost", "opening", "goal", "fingerprint", "settings"}) {
    const std::string& have = stored.at(key);
    const std::string& want = wanted.at(key);
    if (have == want) continue;
    if (std::string_view(key) == "fingerprint") {
      throw InputError(path, "was made for another geometry of task " + identity.task + " (its fingerprint differs)",
                       "write to another file, or delete this one");
    }
    throw InputError(path, fmt::format("was made with another {} ({}, not {})", key, have, want),
                     "use the same settings to continue it, or write to another file");
  }
}

// --- rows ------------------------------------------------------------------------------------------------------------

/// Angle counts are 1 in files of version 1.
std::string Select(int version, const char* tail) {
  return fmt::format(
      "SELECT problems.extents, nx, ny, nz, status, solver, epsilon, expected_cost, lower_bound, expansions, seed, "
      "version, problems.checksum, policy, cpu_s, wall_s, timings.checksum, {} FROM problems LEFT JOIN timings ON "
      "timings.extents = problems.extents {}",
      version == 1 ? "1, 1" : "n_yaw, n_pitch", tail);
}
std::string SelectOne(int version) { return Select(version, "WHERE problems.extents = ?"); }
std::string SelectAll(int version) {
  return Select(version, version == 1 ? "ORDER BY nx, ny, nz" : "ORDER BY nx, ny, nz, n_yaw, n_pitch");
}
/// Parameters 1 to 14 as in version 1, then the angles.
std::string InsertOrUpdate(int version) {
  return fmt::format(
      "INSERT INTO problems (extents, nx, ny, nz, status, solver, epsilon, expected_cost, lower_bound, expansions, "
      "seed, version, checksum, policy{}) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14{}) ON "
      "CONFLICT (extents) DO UPDATE SET status = ?5, solver = ?6, epsilon = ?7, expected_cost = ?8, lower_bound = ?9, "
      "expansions = ?10, seed = ?11, version = ?12, checksum = ?13, policy = ?14",
      version == 1 ? "" : ", n_yaw, n_pitch", version == 1 ? "" : ", ?15, ?16");
}

struct CheckedRow {
  ProblemRow row;
  std::uint64_t checksum = 0;
};

/// Throws InputError if the row differs from what was stored.
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
  problem.epsilon = statement.Real(6);
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

}  // namespace

struct Database::State {
  std::string path;
  std::unique_ptr<WriterLock> lock;  // before the connection: see WriterLock
  std::unique_ptr<SqliteConnection> connection;
  std::unique_ptr<SqliteStatement> select_one;
  int version = kVersion;  // of the file
  Meta meta;               // the writer's, as committed
  DatabaseIdentity identity;
  std::string verified_checksum;  // meta checksum at the last Verify: a miss is a true one while it stands
  std::mutex mutex;

  ~State() {
    select_one.reset();
    if (lock && connection) connection->Settle();
  }

  void RequireWriter() const {
    if (!lock) throw std::logic_error("Database::Put: the database is open for reading");
  }

  void Initialise(const DatabaseIdentity& wanted) {
    SqliteTransaction transaction(*connection, SqliteTransaction::Kind::kWrite);
    connection->Execute(
        fmt::format("PRAGMA application_id={}; PRAGMA user_version={}", kApplicationId, kVersion).c_str());
    for (const TableSchema& table : SchemaOf(version)) connection->Execute(table.sql);
    meta = ToMeta(wanted);
    meta[kMetaAxes] = AxesText(wanted.axes);
    meta[kMetaCount] = "0";
    meta[kMetaSum] = fmt::format("{:016x}", 0);
    meta[kMetaChecksum] = MetaChecksum(meta);
    WriteMeta(*connection, meta);
    transaction.Commit();
    identity = FromMeta(meta, path);
    verified_checksum = meta[kMetaChecksum];
  }

  void Load() {
    SqliteTransaction transaction(*connection, SqliteTransaction::Kind::kRead);
    // The first read undoes what a killed writer left behind; only then are header and tables what was committed.
    const std::int64_t objects = connection->QueryInteger("SELECT count(*) FROM sqlite_schema");
    if (objects == 0 && FileSize(path) == 0) throw InputError(path, "is empty", kMakeOne);
    version = CheckHeader(*connection, path);
    CheckSchema(*connection, version, path);
    meta = ReadMeta(*connection, path);
    identity = FromMeta(meta, path);
  }

  /// Visits every row in order; then compares their number and sum with meta's.
  void ForEachRow(const std::function<void(const ProblemRow&)>& visit) {
    SqliteTransaction transaction(*connection, SqliteTransaction::Kind::kRead);
    const Meta present = ReadMeta(*connection, path);
    SqliteStatement statement(*connection, SelectAll(version).c_str());
    std::uint64_t sum = 0;
    std::int64_t count = 0;
    std::optional<planner::Extents> previous;
    while (statement.Step()) {
      const CheckedRow checked = ReadRow(statement, path);
      const planner::Extents& extents = checked.row.problem.extents;
      if (previous && !(*previous < extents)) throw Damaged(path, "problem " + ExtentsKey(extents) + " stands twice");
      previous = extents;
      sum += checked.checksum;
      ++count;
      visit(checked.row);
    }
    if (present.at(kMetaCount) != fmt::format("{}", count) || present.at(kMetaSum) != fmt::format("{:016x}", sum)) {
      throw Damaged(path, "rows of the table problems are missing");
    }
  }

  void VerifyAll() {
    std::string checksum;
    {
      SqliteTransaction transaction(*connection, SqliteTransaction::Kind::kRead);
      SqliteStatement check(*connection, "PRAGMA integrity_check(1)");
      if (!check.Step() || check.Text(0) != "ok") throw Damaged(path, "its pages contradict each other");
      CheckSchema(*connection, CheckHeader(*connection, path), path);
      checksum = ReadMeta(*connection, path).at(kMetaChecksum);
      if (connection->QueryInteger("SELECT count(*) FROM timings") !=
          connection->QueryInteger("SELECT count(*) FROM problems")) {
        throw Damaged(path, "the tables problems and timings differ in length");
      }
    }
    ForEachRow([this](const ProblemRow& row) { FromRow(row, RowName(path, row)); });
    verified_checksum = checksum;
  }

  std::optional<StoredProblem> Find(const planner::Extents& extents) {
    if (!select_one) select_one = std::make_unique<SqliteStatement>(*connection, SelectOne(version).c_str());
    const std::string key = ExtentsKey(extents);
    {
      const SqliteReset reset(*select_one);
      select_one->Bind(1, std::string_view(key));
      if (select_one->Step()) {
        const CheckedRow checked = ReadRow(*select_one, path);
        if (checked.row.problem.extents != extents) throw Damaged(path, "its index leads to the wrong row");
        return FromRow(checked.row, RowName(path, checked.row));
      }
    }
    // Not there, or lost to damage? The whole file tells.
    if (ReadMeta(*connection, path).at(kMetaChecksum) != verified_checksum) VerifyAll();
    return std::nullopt;
  }
};

Database::Database(std::unique_ptr<State> state) : state_(std::move(state)) {}
Database::Database(Database&&) noexcept = default;
Database& Database::operator=(Database&&) noexcept = default;
Database::~Database() = default;

const std::string& Database::path() const { return state_->path; }
const DatabaseIdentity& Database::identity() const { return state_->identity; }

Database Database::OpenReadOnly(const std::string& path) {
  RequireReadableFile(path);
  auto state = std::make_unique<State>();
  state->path = path;
  Guarded(path, [&] {
    state->connection = std::make_unique<SqliteConnection>(path, false);
    state->Load();
  });
  return Database(std::move(state));
}

Database Database::OpenOrCreate(const std::string& path, const DatabaseIdentity& identity) {
  ToMeta(identity);  // a malformed identity must not leave a file behind
  const bool existed = access(path.c_str(), F_OK) == 0;
  auto state = std::make_unique<State>();
  state->path = path;
  state->lock = std::make_unique<WriterLock>(path, true);
  try {
    Guarded(path, [&] {
      state->connection = std::make_unique<SqliteConnection>(path, true);
      // SQLite takes a file shorter than a page for an empty one; only a truly empty one is ours to fill.
      const bool fresh =
          state->connection->QueryInteger("SELECT count(*) FROM sqlite_schema") == 0 && FileSize(path) == 0;
      if (fresh) {
        state->Initialise(identity);
      } else {
        state->Load();
        RequireSameIdentity(state->meta, identity, path);
        state->VerifyAll();
      }
      state->connection->Execute("PRAGMA journal_mode=WAL");
    });
  } catch (...) {
    state->connection.reset();
    if (!existed) unlink(path.c_str());
    throw;
  }
  return Database(std::move(state));
}

Database Database::Create(const std::string& path, const DatabaseIdentity& identity) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0) {
    throw InputError(path, "exists already", "give another name, or delete it");
  }
  return OpenOrCreate(path, identity);
}

Database Database::OpenForAppend(const std::string& path, const DatabaseIdentity& identity) {
  RequireReadableFile(path);
  return OpenOrCreate(path, identity);
}

void Database::RequireFingerprint(const std::string& task, const std::string& fingerprint) const {
  if (identity().task == task && identity().fingerprint == fingerprint) return;
  const std::string what =
      identity().task != task ? fmt::format("was made for task {}, not {}", identity().task, task)
                              : fmt::format("was made for another geometry of task {} (its fingerprint differs)", task);
  throw InputError(path(), what, "give the database of this task, or make it with feeler preprocess");
}

void Database::Put(const StoredProblem& problem) {
  State& state = *state_;
  state.RequireWriter();
  const ProblemRow row = ToRow(problem);
  if (state.version == 1 && (problem.extents.n_yaw > 1 || problem.extents.n_pitch > 1)) {
    throw std::invalid_argument("Database::Put: a file of version 1 holds no angles");
  }
  const std::string key = ExtentsKey(problem.extents);
  const std::uint64_t checksum = RowChecksum(row);
  const double cpu_s = problem.cpu_s + 0.0;  // SQLite does not keep the sign of zero
  const double wall_s = problem.wall_s + 0.0;
  const std::lock_guard guard(state.mutex);
  Guarded(state.path, [&] {
    SqliteTransaction transaction(*state.connection, SqliteTransaction::Kind::kWrite);
    std::int64_t count = std::stoll(state.meta.at(kMetaCount));
    std::uint64_t sum = std::stoull(state.meta.at(kMetaSum), nullptr, 16) + checksum;
    {
      SqliteStatement old(*state.connection, "SELECT checksum FROM problems WHERE extents = ?");
      old.Bind(1, std::string_view(key));
      if (old.Step()) {
        sum -= static_cast<std::uint64_t>(old.Integer(0));
      } else {
        ++count;
      }
    }
    SqliteStatement insert(*state.connection, InsertOrUpdate(state.version).c_str());
    const StoredProblem& stored = row.problem;
    insert.Bind(1, std::string_view(key));
    insert.Bind(2, std::int64_t{stored.extents.nx});
    insert.Bind(3, std::int64_t{stored.extents.ny});
    insert.Bind(4, std::int64_t{stored.extents.nz});
    if (state.version > 1) {
      insert.Bind(15, std::int64_t{stored.extents.n_yaw}).Bind(16, std::int64_t{stored.extents.n_pitch});
    }
    insert.Bind(5, std::string_view(stored.status)).Bind(6, std::string_view(stored.solver));
    insert.Bind(7, stored.epsilon);
    if (row.blob.empty()) {
      insert.BindNull(8).BindNull(14);
    } else {
      insert.Bind(8, stored.expected_cost).BindBlob(14, row.blob);
    }
    insert.Bind(9, stored.lower_bound).Bind(10, stored.expansions);
    insert.Bind(11, static_cast<std::int64_t>(stored.seed)).Bind(12, std::string_view(stored.version));
    insert.Bind(13, static_cast<std::int64_t>(checksum));
    insert.Step();
    SqliteStatement timing(*state.connection,
                           "INSERT OR REPLACE INTO timings (extents, cpu_s, wall_s, checksum) VALUES (?, ?, ?, ?)");
    timing.Bind(1, std::string_view(key)).Bind(2, cpu_s).Bind(3, wall_s);
    timing.Bind(4, static_cast<std::int64_t>(TimingChecksum(key, cpu_s, wall_s)));
    timing.Step();
    Meta meta = state.meta;
    meta[kMetaCount] = fmt::format("{}", count);
    meta[kMetaSum] = fmt::format("{:016x}", sum);
    meta[kMetaChecksum] = MetaChecksum(meta);
    WriteMeta(*state.connection,
              {{kMetaCount, meta[kMetaCount]}, {kMetaSum, meta[kMetaSum]}, {kMetaChecksum, meta[kMetaChecksum]}});
    transaction.Commit();
    if (state.verified_checksum == state.meta.at(kMetaChecksum)) state.verified_checksum = meta[kMetaChecksum];
    state.meta = std::move(meta);
  });
}

std::optional<StoredProblem> Database::Get(const planner::Extents& extents) {
  const std::lock_guard guard(state_->mutex);
  return Guarded(state_->path, [&] { return state_->Find(extents); });
}

bool Database::Contains(const planner::Extents& extents) { return Get(extents).has_value(); }

void Database::ForEach(const std::function<void(const StoredProblem&)>& visit) {
  const std::lock_guard guard(state_->mutex);
  Guarded(state_->path,
          [&] { state_->ForEachRow([&](const ProblemRow& row) { visit(FromRow(row, RowName(state_->path, row))); }); });
}

std::vector<StoredProblem> Database::List() {
  const std::lock_guard guard(state_->mutex);
  std::vector<StoredProblem> list;
  Guarded(state_->path, [&] { state_->ForEachRow([&](const ProblemRow& row) { list.push_back(row.problem); }); });
  return list;
}

DatabaseInfo Database::Info() {
  DatabaseInfo info;
  for (const double up_to :
       {1.000001, 1.001, 1.01, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0, 5.0, std::numeric_limits<double>::infinity()}) {
    info.ratios.push_back({up_to, 0});
  }
  double ratio_sum = 0.0;
  double cost_sum = 0.0;
  ForEach([&](const StoredProblem& problem) {
    ++info.problems;
    ++info.statuses[problem.status];
    info.cpu_s += problem.cpu_s;
    info.wall_s += problem.wall_s;
    if (!problem.policy) return;
    ++info.solved;
    const double ratio = problem.Ratio();
    ratio_sum += ratio;
    info.ratio_max = std::max(info.ratio_max, ratio);
    cost_sum += problem.expected_cost;
    info.policy_nodes += static_cast<std::int64_t>(problem.policy->nodes.size());
    const auto bin = std::find_if(info.ratios.begin(), info.ratios.end(),
                                  [&](const RatioBin& candidate) { return ratio <= candidate.up_to; });
    ++bin->count;
  });
  if (info.solved > 0) {
    info.ratio_mean = ratio_sum / static_cast<double>(info.solved);
    info.expected_cost_mean = cost_sum / static_cast<double>(info.solved);
  }
  const std::lock_guard guard(state_->mutex);
  info.bytes = FileSize(state_->path);
  return info;
}

std::string Database::ContentDigest() {
  const std::lock_guard guard(state_->mutex);
  return Guarded(state_->path, [&] {
    ByteWriter out;
    for (const auto& [key, value] : ToMeta(state_->identity)) {
      out.Text(key);
      out.Text(value);
    }
    state_->ForEachRow([&](const ProblemRow& row) { out.Text(HashText(RowBytes(row))); });
    return HashText(out.bytes());
  });
}

void Database::Verify() {
  const std::lock_guard guard(state_->mutex);
  Guarded(state_->path, [&] { state_->VerifyAll(); });
}

}  // namespace feeler::policies
