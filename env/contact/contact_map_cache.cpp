#include "feeler/env/contact/contact_map_cache.h"

#include <cstdlib>
#include <system_error>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/env/model/fingerprint.h"
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

ContactMap GetContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism,
                         const ProgressCallback& progress) {
  const fs::path file = CacheFolder() / (ContactMapFingerprint(task_model, opening) + ".contact-map");
  std::error_code error;
  if (fs::exists(file, error)) {
    try {
      return planner::ReadContactMap(file);
    } catch (const InputError&) {
      // Damaged or of another version: built anew below, which replaces it.
    }
  }
  ContactMap map = BuildContactMap(task_model, opening, parallelism, progress);
  try {
    planner::WriteContactMap(file, map);
  } catch (const InputError&) {
    // A cache that cannot be written costs time, nothing else.
  }
  return map;
}

}  // namespace feeler::env
