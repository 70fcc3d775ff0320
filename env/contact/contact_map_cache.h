#pragma once

#include <filesystem>
#include <string>

#include "feeler/env/contact/contact_map_builder.h"

namespace feeler::env {

/// Where contact maps are kept: $FEELER_CACHE_DIR, else $XDG_CACHE_HOME/feeler, else ~/.cache/feeler.
std::filesystem::path CacheFolder();

/// The contact map of a task, from the cache if it is there, else built and stored. A damaged file of the cache is
/// built anew; a cache that cannot be written costs time, nothing else. Throws what BuildContactMap throws.
planner::ContactMap GetContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism = {},
                                  const ProgressCallback& progress = {});

/// Writes atomically (a temporary file, then a rename): readers see the old file, the new one or none.
/// Returns false when the folder cannot be written.
bool StoreContactMap(const std::filesystem::path& file, const planner::ContactMap& map);
/// Throws InputError when the file is missing, of another version or damaged.
planner::ContactMap ReadContactMap(const std::filesystem::path& file);

}  // namespace feeler::env
