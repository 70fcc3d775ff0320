#pragma once

#include <Eigen/Core>
#include <vector>

namespace feeler::perception {

/// Points in metres, in the frame that the holder names.
using Points = std::vector<Eigen::Vector3d>;

/// Points of a surface and its unit normals there, pointing out of the body.
struct SurfacePoints {
  Points points;
  Points normals;
};

/// One point for each cube of edge `cell_m` that holds some: their mean. In order of the cubes (x slowest), whatever
/// the order of `points`.
Points Thinned(const Points& points, double cell_m);

/// The same for a surface, faces that look different ways apart; normals are means, made unit, or a first where they
/// cancel.
SurfacePoints Thinned(const SurfacePoints& surface, double cell_m);

}  // namespace feeler::perception
