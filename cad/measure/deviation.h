#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/pieces/convex_piece.h"

namespace feeler::cad {

/// How far a set of convex pieces is from the part they stand for.
struct Deviation {
  double added_m =
      0.0;  ///< the farthest that the surface of the pieces is outside of the part: material that is not there
  Eigen::Vector3d added_at = Eigen::Vector3d::Zero();
  double lost_m =
      0.0;  ///< the farthest that the surface of the part is outside of all pieces: material that is missing
  Eigen::Vector3d lost_at = Eigen::Vector3d::Zero();

  double largest_m() const { return added_m > lost_m ? added_m : lost_m; }
};

/// The deviation, by branch and bound over faces that are cut up as far as is needed: no point is farther than the
/// numbers say plus `accuracy_m`. `zone`: only what lies in it counts. `limit_m`: what exceeds it need not be known
/// better.
Deviation DeviationOf(const MeshTree& part, const std::vector<ConvexPiece>& pieces, const std::optional<Box>& zone = {},
                      double accuracy_m = 1e-6);

/// The same from points drawn evenly on both surfaces, each measured against the other surface: an independent judge,
/// never above the exact deviation.
Deviation SampledDeviation(const MeshTree& part, const std::vector<ConvexPiece>& pieces, int points, std::uint64_t seed,
                           const std::optional<Box>& zone = {});

}  // namespace feeler::cad
