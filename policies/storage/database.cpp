#include "feeler/policies/storage/database.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/policies/io/bytes.h"
#include "feeler/policies/storage/file_checks.h"
#include "feeler/policies/storage/hash.h"
#include "feeler/policies/storage/meta.h"
#include "feeler/policies/storage/row.h"
#include "feeler/policies/storage/row_sql.h"
#include "feeler/policies/storage/writer_lock.h"

namespace feeler::policies {

using nlohmann::json;

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
    if (wanted.shard) meta[kMetaShard] = ShardText(*wanted.shard);
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
    throw InputError(path, "exists already", "give another name");
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
    if (state.version < 3) {
      insert.Bind(7, stored.Promise());
    } else if (stored.certified()) {
      insert.BindNull(7).Bind(17, stored.gap);
    } else {
      insert.Bind(7, stored.epsilon).BindNull(17);
    }
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
