#pragma once

#include <string>

#include "feeler/cad/measure/mating.h"
#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

struct DrawingOptions {
  int axis = 1;             ///< 0: section across x, 1: across y, 2: across z (in the middle of the depth)
  bool zoom = false;        ///< the gap at one wall, below the mouth, instead of the whole
  double tool_depth_m = 0;  ///< of the tool below the mouth
};

/// A section through the middle of the mouth as SVG: target, tool, what the lids close, and the clearances with their
/// numbers. Parts in the frames of the mating. Same input, same text.
std::string SectionSvg(const Mating& mating, const TriangleMesh& tool, const TriangleMesh& target,
                       const DrawingOptions& options);

}  // namespace feeler::cad
