#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "feeler/env/contact/contact_map_builder.h"

namespace feeler::env {

/// Where contact maps are kept: $FEELER_CACHE_DIR, else $XDG_CACHE_HOME/feeler, else ~/.cache/feeler.
std::filesystem::path CacheFolder();

/// Told why something could not be kept in the cache.
using CacheFailure = std::function<void(const std::string& reason)>;

/// The contact map of a task, from the cache if it is there (mapped: processes share its memory), else built and
/// stored; of several processes of a host that need it at once one builds it. A damaged file of the cache is built
/// anew; a cache that cannot be written costs time, nothing else. Throws what BuildContactMap and `progress` throw.
planner::ContactMap GetContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism = {},
                                  const ProgressCallback& progress = {}, const CacheFailure& on_failure = {});

}  // namespace feeler::env
