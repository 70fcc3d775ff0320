#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "feeler/cad/mesh/box_tree.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/pieces/convex_piece.h"

namespace feeler::cad {

/// Distances to the union of convex pieces, which must outlive it, in time that grows with the logarithm of their
/// faces: trees over the pieces, over the planes of each and over all faces. Immutable; shared by threads.
class PieceUnion {
 public:
  explicit PieceUnion(const std::vector<ConvexPiece>& pieces);
  ~PieceUnion();
  PieceUnion(const PieceUnion&) = delete;
  PieceUnion& operator=(const PieceUnion&) = delete;

  /// Whether the point is within some piece.
  bool Holds(const Eigen::Vector3d& p) const;
  /// 0 within some piece, else the distance to the nearest: the least that DistanceTo says of one, m.
  double Distance(const Eigen::Vector3d& p) const;
  /// The least, over the pieces, of the largest distance of the points from one, m; `most_m` where that is no less. No
  /// point of their convex hull is farther from the union: the distance to a convex piece is a convex function.
  double LargestFromOne(const std::vector<Eigen::Vector3d>& points, double most_m) const;

 private:
  struct Searched;

  std::vector<Searched> pieces_;
  BoxTree boxes_;
  TriangleMesh faces_;
  std::unique_ptr<MeshTree> nearest_;  ///< over faces_
};

}  // namespace feeler::cad
