#pragma once

#include <vector>

#include "feeler/cad/align/profile.h"
#include "feeler/cad/mesh/triangle_mesh.h"
#include "feeler/cad/section/section.h"

namespace feeler::cad {

/// A line around material or around a hole, over a range of heights.
struct Feature {
  bool hole = false;
  double low_m = 0.0;
  double high_m = 0.0;
  SlabLoop loop;           ///< half-way
  SlabLoop low_loop;       ///< its lower end, as the `middle` of its points; set if it tapers
  SlabLoop high_loop;      ///< its upper end
  int tapers = 0;          ///< 1: it widens upwards, -1: downwards
  double lean = 0.0;       ///< how far it moves sideways, over its height
  double area = 0.0;       ///< m^2, positive; half-way
  double edge_rad = 0.0;   ///< direction in which most of its length runs, modulo half a turn
  bool has_edges = false;  ///< else no direction stands out
  Profile profile;         ///< half-way
};

/// The loops of a part whose cross-sections across z are looked at at its thicker slabs.
std::vector<Feature> FeaturesOf(const TriangleMesh& mesh);

}  // namespace feeler::cad
