#include "feeler/policies/storage/merge.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"
#include "feeler/policies/storage/database.h"
#include "feeler/policies/storage/file_checks.h"
#include "feeler/policies/storage/meta.h"
#include "feeler/policies/storage/row.h"
#include "feeler/policies/storage/task_bundle.h"
#include "feeler/policies/storage/writer_lock.h"

namespace feeler::policies {
namespace {

/// Keeps writers off a file that is only read; see WriterLock for the order in which to let go.
class ReaderLock {
 public:
  explicit ReaderLock(const std::string& path) : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (descriptor_ < 0 || flock(descriptor_, LOCK_SH | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
    ::close(descriptor_);
    throw InputError(path, "another process is writing this database", "wait until it is done");
  }
  ~ReaderLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  ReaderLock(const ReaderLock&) = delete;
  ReaderLock& operator=(const ReaderLock&) = delete;

 private:
  int descriptor_;
};

struct Part {
  std::unique_ptr<ReaderLock> lock;  // outlives the connection
  std::unique_ptr<Database> database;
  std::vector<planner::Extents> problems;
};

Part OpenPart(const std::string& path) {
  RequireReadableFile(path);
  Part part;
  part.lock = std::make_unique<ReaderLock>(path);
  part.database = std::make_unique<Database>(Database::OpenReadOnly(path));
  for (const StoredProblem& problem : part.database->List()) part.problems.push_back(problem.extents);
  return part;
}

void RequireOneOrigin(const Database& first, const Database& other) {
  const Meta have = ToMeta(other.identity());
  const Meta want = ToMeta(first.identity());
  // As in RequireSameIdentity, and the version, which stands in every row.
  for (const char* key : {"task", "cost", "opening", "goal", "fingerprint", "settings", "created_by"}) {
    if (have.at(key) == want.at(key)) continue;
    const std::string name = std::string_view(key) == "created_by"    ? "version of feeler"
                             : std::string_view(key) == "fingerprint" ? "geometry (fingerprint)"
                                                                      : key;
    throw InputError(
        other.path(),
        fmt::format("was made with another {} than {} ({}, not {})", name, first.path(), have.at(key), want.at(key)),
        "merge files that were made with one version, task and settings");
  }
}

void RequireAllShards(const std::vector<Part>& parts) {
  const DatabaseShard& first = *parts.front().database->identity().shard;
  std::map<int, std::string> files;  // shard -> file
  for (const Part& part : parts) {
    const DatabaseShard& shard = *part.database->identity().shard;
    const std::string& path = part.database->path();
    if (shard.count != first.count || shard.digest != first.digest) {
      throw InputError(path,
                       shard.count != first.count
                           ? fmt::format("is one of {} shards, {} one of {}", shard.count,
                                         parts.front().database->path(), first.count)
                           : "is a shard of another family than " + parts.front().database->path(),
                       "merge the shards of one family, made with the same --family and --shard I/N");
    }
    const auto [there, is_new] = files.emplace(shard.index, path);
    if (!is_new) {
      throw InputError(path, fmt::format("is shard {} of {}, as {} is", shard.index, shard.count, there->second),
                       "give each shard once");
    }
    const auto present = static_cast<std::int64_t>(part.problems.size());
    if (present != shard.problems) {
      throw InputError(path,
                       fmt::format("is unfinished: {} of the {} problems of shard {} of {}", present, shard.problems,
                                   shard.index, shard.count),
                       "run the command that made it again, it goes on");
    }
  }
  std::string missing;
  for (int index = 1; index <= first.count; ++index) {
    if (!files.contains(index)) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", index);
  }
  if (!missing.empty()) {
    throw InputError("shards", fmt::format("{} of {} missing", missing, first.count),
                     fmt::format("make them with --shard I/{} and give all files", first.count));
  }
}

void RequireDisjoint(const std::vector<Part>& parts) {
  std::map<planner::Extents, std::string> holders;
  for (const Part& part : parts) {
    for (const planner::Extents& extents : part.problems) {
      const auto [there, is_new] = holders.emplace(extents, part.database->path());
      if (is_new) continue;
      throw InputError(part.database->path(),
                       fmt::format("overlaps {}: both hold problem {}", there->second,
                                   planner::ToString(extents, part.database->identity().axes)),
                       "merge files of disjoint families");
    }
  }
}

std::vector<Part> OpenParts(const std::vector<std::string>& paths) {
  if (paths.size() < 2) throw InputError("db merge", "one file is nothing to merge", "give two or more databases");
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (!IsSameFile(paths[i], paths[k])) continue;
      throw InputError(paths[i], "is given twice", "give each file once");
    }
  }
  std::vector<Part> parts;
  for (const std::string& path : paths) {
    parts.push_back(OpenPart(path));
    const Part& part = parts.back();
    const Database& first = *parts.front().database;
    RequireOneOrigin(first, *part.database);
    if (part.database->identity().shard.has_value() != first.identity().shard.has_value()) {
      const bool whole = first.identity().shard.has_value();
      throw InputError(path,
                       whole ? "is no shard, " + first.path() + " is one" : "is a shard, " + first.path() + " is none",
                       "merge shards with shards");
    }
  }
  if (parts.front().database->identity().shard) RequireAllShards(parts);
  RequireDisjoint(parts);
  return parts;
}

void RemoveDatabase(const std::string& path) {
  for (const char* suffix : {"", "-wal", "-shm"}) unlink((path + suffix).c_str());
}

void CopyBundle(const std::vector<std::string>& parts, const std::string& out) {
  for (const std::string& part : parts) {
    std::ifstream in(BundlePathOf(part), std::ios::binary);
    if (!in) continue;
    WriteBundleFile(BundlePathOf(out), std::string(std::istreambuf_iterator<char>(in), {}));
    return;
  }
}

}  // namespace

MergeSummary MergeDatabases(const std::vector<std::string>& paths, const std::string& out,
                            const ProgressCallback& progress, const CancellationToken* cancellation) {
  struct stat status {};
  if (stat(out.c_str(), &status) == 0) {
    throw InputError(out, "exists already: it is not overwritten", "give another name");
  }
  const std::vector<Part> parts = OpenParts(paths);
  std::int64_t total = 0;
  for (const Part& part : parts) total += static_cast<std::int64_t>(part.problems.size());

  const std::string unfinished = out + ".part";
  {
    const WriterLock lock(unfinished, true);  // refuses one that another process writes
    RemoveDatabase(unfinished);               // what a killed one left
  }
  MergeSummary summary;
  summary.files = static_cast<int>(parts.size());
  try {
    {
      DatabaseIdentity identity = parts.front().database->identity();
      identity.shard.reset();
      Database merged = Database::Create(unfinished, identity);
      for (const Part& part : parts) {
        part.database->ForEach([&](const StoredProblem& problem) {
          if (cancellation != nullptr && cancellation->cancelled()) throw Interrupted();
          merged.Put(problem);
          ++summary.problems;
          if (progress) progress(summary.problems, total);
        });
      }
      summary.digest = merged.ContentDigest();
    }
    // Unlike a rename this never replaces what has come there meanwhile.
    if (link(unfinished.c_str(), out.c_str()) != 0) {
      throw InputError(out, "cannot be written: " + std::generic_category().message(errno), "give another name");
    }
  } catch (...) {
    RemoveDatabase(unfinished);
    throw;
  }
  unlink(unfinished.c_str());
  CopyBundle(paths, out);
  return summary;
}

}  // namespace feeler::policies
