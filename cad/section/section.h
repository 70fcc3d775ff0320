#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// A corner of a cross-section in the middle of a slab, and where the edge of the part that it lies on meets the lower
/// and the upper end of the slab. m, in x and y.
struct SlabPoint {
  Eigen::Vector2d middle;
  Eigen::Vector2d low;
  Eigen::Vector2d high;
};

/// A closed line around material (counterclockwise) or around a hole in it (clockwise); material is on its left.
using SlabLoop = std::vector<SlabPoint>;

/// Between two heights, with no corner of the mesh in between: the surface is ruled, every edge runs from end to end.
struct Slab {
  double low_m = 0.0;
  double high_m = 0.0;
  std::vector<SlabLoop> loops;
};

double SignedArea(const SlabLoop& loop);
Eigen::AlignedBox2d BoundsOf(const SlabLoop& loop);
/// Whether a point is inside of what the loop encloses, whichever way round it goes; in the middle of the slab.
bool Encloses(const SlabLoop& loop, const Eigen::Vector2d& point);
/// Whether material is at the point, in the middle of the slab.
bool IsMaterial(const std::vector<SlabLoop>& loops, const Eigen::Vector2d& point);

/// Heights of the corners of a mesh, increasing; those within `tolerance_m` of each other are one.
std::vector<double> LevelsOf(const TriangleMesh& mesh, double tolerance_m);

/// The cross-section between two neighbouring levels. Ends that lie within `gap_m` of each other are joined where a
/// long edge of the mesh meets several short ones.
Slab SlabBetween(const TriangleMesh& mesh, double low_m, double high_m, double gap_m = 2e-5);
/// The cross-section at a height, as a slab of no thickness.
std::vector<SlabLoop> SectionAt(const TriangleMesh& mesh, double height_m);

/// Leaves out corners as long as no left-out one is farther than the tolerance from the line that stays, at either end
/// of the slab and in its middle, and two that stay lie in a plane within it: first those that lie on a line with their
/// neighbours, then the rest by the scheme of Douglas and Peucker (1973). `tolerance_at` gives the tolerance at a
/// point, m.
SlabLoop Simplified(const SlabLoop& loop, const std::function<double(const SlabPoint&)>& tolerance_at);

}  // namespace feeler::cad
