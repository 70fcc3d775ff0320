#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "feeler/cad/align/features.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// A part turned so that one of its directions is z.
struct Turned {
  Eigen::Matrix3d rotation;
  TriangleMesh mesh;
  std::vector<Feature> features;
  std::unique_ptr<MeshTree> tree;  ///< once it is needed
};
Turned TurnedPart(const TriangleMesh& mesh, const Eigen::Matrix3d& rotation);

/// A way in that is worth sliding along.
struct Trial {
  std::size_t tool = 0;  ///< number of the direction
  std::size_t target = 0;
  double roll_rad = 0.0;
  Eigen::Vector2d place;  ///< of the turned tool's origin, in x and y
  bool tool_has_opening = false;
  double high_m = 0.0;  ///< of the feature of the target
  double low_m = 0.0;
  double size_m = 0.0;         ///< of the inner feature
  double fit = 0.0;            ///< area of what goes in, over that of the hole
  int rank = 0;                ///< 0: the line of what goes in lies inside of the other's, along walls; more: less so
  int held = 0;                ///< lines that lie over holes at once, as of several pins
  bool roll_is_about = false;  ///< no sides say what it is exactly
};

/// What is in by less than this is not in.
inline constexpr double kLeastEngaged_m = 4e-4;
/// Slid along, the most promising first.
inline constexpr std::size_t kMostTrials = 120;

/// The nearest of what does not fit, for the message.
struct Miss {
  double too_wide_m = std::numeric_limits<double>::infinity();
  Eigen::Vector2d inner = Eigen::Vector2d::Zero();
  Eigen::Vector2d hole = Eigen::Vector2d::Zero();
};

/// Every line around material of one part with every hole of the other that it may go into, along every direction of
/// both, turned so that edges are parallel, or radii fit, or several lines lie over several holes; the most promising
/// first, kMostTrials at most.
std::vector<Trial> TrialsOf(const std::vector<Turned>& tools, const std::vector<Turned>& targets, Miss& miss);

}  // namespace feeler::cad
