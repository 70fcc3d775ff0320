#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/planner/contact/contact_map.h"
#include "feeler/planner/contact/convex_shape.h"
#include "feeler/planner/contact/travel_model.h"
#include "feeler/policies/storage/database.h"

namespace feeler::policies {

/// What the executor needs of a task beside its policies, so that the next move on a robot needs no simulator: the
/// numbers of the task, its contact map, its convex pieces and its lids.
///
/// It is a file beside the database, not tables in it: the map (2 MB for a plug, hundreds of MB over orientations) is
/// the same for every database of the task, a database stays small to copy and to merge, and its content digest and
/// version do not change with what is carried along.
struct TaskBundle {
  Task task;
  std::string fingerprint;  ///< of the databases it serves
  std::string opening;      ///< "closed" or "open" while localizing: what the map holds
  std::shared_ptr<const planner::ContactMap> map;
  std::vector<planner::ConvexPiece> tool;    ///< in the tool frame
  std::vector<planner::ConvexPiece> target;  ///< in the target frame, with the opening open
  std::vector<planner::ConvexPiece> lids;    ///< what closes the opening while localizing; no part of the real target
};

/// The bundle that lies beside a database: its path with ".bundle" behind.
std::string BundlePathOf(const std::string& database);

/// Replaces the file whole or not at all (layout: docs/file-formats.md). Throws InputError if it cannot be written.
void WriteBundle(const std::string& path, const TaskBundle& bundle);
/// The bytes of one. Throws InputError, too, for a file that exists and is no bundle: it is not overwritten.
void WriteBundleFile(const std::string& path, std::string_view bytes);
/// Throws InputError when the file is missing, of a newer version or damaged.
TaskBundle ReadBundle(const std::string& path);
/// The bundle beside `database`. Throws InputError as well when it was made for another task or opening.
TaskBundle ReadBundleOf(const Database& database);

/// Travel from the pieces of a bundle, the opening as it is: `ExecutorOptions::travel_model`, where the orientation is
/// uncertain.
std::unique_ptr<planner::TravelModel> TravelModelOf(const TaskBundle& bundle);

}  // namespace feeler::policies
