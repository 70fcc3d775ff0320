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

/// The same for a surface; the normal is the mean, made unit; cubes where normals cancel keep their first point.
SurfacePoints Thinned(const SurfacePoints& surface, double cell_m);

}  // namespace feeler::perception
