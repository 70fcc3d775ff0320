#include "feeler/env/contact/contact_map_cache.h"

#include <cstdlib>
#include <optional>
#include <system_error>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/planner/arrays/host_lock.h"
#include "feeler/planner/contact/contact_map_file.h"

namespace feeler::env {

namespace fs = std::filesystem;
using planner::ContactMap;

fs::path CacheFolder() {
  const auto variable = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
  };
  if (const fs::path folder = variable("FEELER_CACHE_DIR"); !folder.empty()) return folder;
  if (const fs::path folder = variable("XDG_CACHE_HOME"); !folder.empty()) return folder / "feeler";
  if (const fs::path folder = variable("HOME"); !folder.empty()) return folder / ".cache" / "feeler";
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  return (error ? fs::path("/tmp") : folder) / "feeler-cache";
}

namespace {

/// None if it is not there, damaged, or of another version: then it is built anew, which replaces it.
std::optional<ContactMap> Cached(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return std::nullopt;
  try {
    return planner::ReadContactMap(file);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

ContactMap GetContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism,
                         const ProgressCallback& progress, const CacheFailure& on_failure) {
  const fs::path file = CacheFolder() / (ContactMapFingerprint(task_model, opening) + ".contact-map");
  if (auto cached = Cached(file)) return *std::move(cached);
  // Another process of this host may be building it: then it is there when the lock is free.
  const auto lock = planner::HostLock::Acquire(fs::path(file).replace_extension(".lock"), [&] {
    if (progress) progress(0, 1);  // may throw, to give up
    return true;
  });
  if (auto cached = Cached(file)) return *std::move(cached);
  ContactMap map = BuildContactMap(task_model, opening, parallelism, progress);
  try {
    planner::WriteContactMap(file, map);
  } catch (const InputError& error) {
    if (on_failure) on_failure(error.what());
    return map;
  }
  auto cached = Cached(file);  // its pages are shared, those of `map` are not
  return cached ? *std::move(cached) : std::move(map);
}

}  // namespace feeler::env
