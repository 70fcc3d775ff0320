#pragma once

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
  bool assembled = false;  ///< both stand as assembled
};

/// The kinds that can be drawn.
std::vector<PartKind> PartKinds();

struct PartFiles {
  std::string tool;  ///< as `--tool` takes it
  std::string target;
};
/// Draws a kind and writes its parts into a folder. `format`: "step", "stl" and "ply" (binary), "stl-ascii",
/// "ply-ascii", "obj" or "3mf"; "assembly" writes one STEP file with both solids.
PartFiles WriteParts(const std::string& kind, const std::filesystem::path& folder, const std::string& format);

}  // namespace feeler::cad
