#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "feeler/cad/measure/mating.h"
#include "feeler/cad/mesh/triangle_mesh.h"
#include "feeler/cad/numbers/numbers.h"
#include "feeler/cad/pieces/convex_piece.h"

namespace feeler::cad {

/// All that a task folder is written from; meshes and pieces in the frames of tool and target.
struct TaskContent {
  std::string name;
  std::string source;  ///< a line about where it comes from
  std::vector<ConvexPiece> tool;
  std::vector<ConvexPiece> target;
  std::vector<ConvexPiece> lids;  ///< of the part that has the opening
  bool lids_on_tool = false;
  TriangleMesh tool_surface;  ///< as read; for the eye
  TriangleMesh target_surface;
  double tool_volume = 0.0;  ///< m^3
  Material material;
  DerivedNumbers numbers;
};

/// Lids that close the openings of a mating, from their floor to the rim.
std::vector<ConvexPiece> MakeLids(const Mating& mating);

/// The task file as text: opens in any MuJoCo viewer; every number with its reason. Meshes are named as WriteTaskFolder
/// writes them.
std::string TaskXml(const TaskContent& content);

/// Writes task.xml and its meshes (binary STL) into a folder, which is made; meshes of an earlier import are removed.
/// Throws InputError when it cannot be written.
void WriteTaskFolder(const TaskContent& content, const std::filesystem::path& folder);

/// Binary STL of a surface.
std::string StlBytes(const TriangleMesh& mesh);

/// Throws InputError if an import into `folder` would replace or remove a file of `inputs` (by device and inode), or
/// files that no earlier import wrote (its import.json says so).
void RequireImportFolder(const std::filesystem::path& folder, const std::vector<std::string>& inputs);

}  // namespace feeler::cad
