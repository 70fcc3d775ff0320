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

}  // namespace feeler::env
