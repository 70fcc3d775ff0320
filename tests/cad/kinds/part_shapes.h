#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace feeler::cad {

/// A pair of parts as a CAD program would give them: drawn as solids, written as a file when a test asks.
/// Millimetres; each part in a CAD frame of its own, unless `assembled`.
struct PartKind {
  std::string name;
  double clearance_x_mm = 0.0;  ///< a side, as drawn
  double clearance_y_mm = 0.0;
  double depth_mm = 0.0;  ///< from mouth to fully in; 0: not asserted
  bool tool_has_opening = false;
  bool assembled = false;           ///< both stand as assembled
  bool fine = false;                ///< of thousands of triangles
  bool scalable_clearance = false;  ///< PartPlacement::looser holds
};

/// The kinds that can be drawn.
std::vector<PartKind> PartKinds();

struct PartFiles {
  std::string tool;  ///< as `--tool` takes it
  std::string target;
};
/// Where the CAD frames of the parts lie, how large they are, and how finely their triangles are made.
struct PartPlacement {
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();  ///< of the part as drawn, in its frame; millimetres
  Eigen::Isometry3d target = Eigen::Isometry3d::Identity();
  double facet_mm = 0.002;  ///< how far triangles may be off the surface
  double facet_rad = 0.1;
  double scale = 1.0;   ///< of all sizes, clearances too
  double looser = 1.0;  ///< a factor of the clearances alone, of the kinds that are `scalable_clearance`
};
/// The tool turned about its axis against the target's frame.
PartPlacement RolledBy(double degrees);
/// Both in frames that lie anyhow, by a seed: turned in all directions and moved by up to 50 mm.
PartPlacement Anyhow(std::uint64_t seed);

/// Draws a kind and writes its parts into a folder. `format`: "step", "stl" and "ply" (binary), "stl-ascii",
/// "ply-ascii", "obj" or "3mf"; "assembly" writes one STEP file with both solids.
PartFiles WriteParts(const std::string& kind, const std::filesystem::path& folder, const std::string& format,
                     const PartPlacement& placement = {});

}  // namespace feeler::cad
