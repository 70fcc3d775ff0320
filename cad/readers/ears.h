#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

namespace feeler::cad {

/// Faces of more corners are refused: the time that their triangles take grows with the square.
constexpr std::size_t kMostCorners = 5000;

/// Triangles of a plane polygon of three corners or more (numbers of points), by cutting off its ears (Meisters 1975);
/// where none is left, as a fan.
std::vector<std::array<int, 3>> CutEars(const std::vector<Eigen::Vector3d>& points, const std::vector<int>& face);

}  // namespace feeler::cad
