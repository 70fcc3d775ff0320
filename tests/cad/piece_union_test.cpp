// Laws of distances to the union of convex pieces, against DistanceTo of every piece (which has a judge of its own).
// - Distance is the least of them; 0 within a piece.
// - LargestFromOne is the least, over the pieces, of the largest at the points, or what it may be at most; no point of
// the hull of the points is farther from the union.
// - What is lost of a part is no less than at any point of its surface, and no more than there by the accuracy.
#include "feeler/cad/pieces/piece_union.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "feeler/cad/measure/deviation.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/core/random.h"

namespace feeler::cad {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::Vector3d Around(const Eigen::Vector3d& center, double spread_m, RandomStream& random) {
  return center + spread_m * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
}

/// Bodies of few and of many faces that partly overlap.
std::vector<ConvexPiece> Pieces(int count, RandomStream& random) {
  std::vector<ConvexPiece> pieces;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d center = Around(Eigen::Vector3d::Zero(), 0.01, random);
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < (i % 3 == 0 ? 400 : 8); ++k) {
      const Eigen::Vector3d way = Around(Eigen::Vector3d::Zero(), 1.0, random).normalized();
      points.emplace_back(center + 0.004 * way.cwiseProduct(Eigen::Vector3d(1.0, 1.5, 0.4)));
    }
    pieces.push_back(*HullOf(points));
  }
  return pieces;
}

double Nearest(const std::vector<ConvexPiece>& pieces, const Eigen::Vector3d& p) {
  double least_m = kInfinity;
  for (const ConvexPiece& piece : pieces) least_m = std::min(least_m, DistanceTo(piece, p));
  return least_m;
}

TEST(PieceUnion, DistanceIsThatToTheNearestPiece) {
  RandomStream random(3, 0, "points");
  const std::vector<ConvexPiece> pieces = Pieces(12, random);
  const PieceUnion all(pieces);
  int within = 0;
  for (int i = 0; i < 3000; ++i) {
    const ConvexPiece& piece = pieces[static_cast<std::size_t>(random.Index(pieces.size()))];
    // Half of them hardly off a corner, where one plane in hundreds decides.
    const Eigen::Vector3d p =
        i % 2 == 0 ? Around(Eigen::Vector3d::Zero(), 0.012, random)
                   : Around(piece.surface.points[random.Index(piece.surface.points.size())], 1e-6, random);
    const double expected_m = Nearest(pieces, p);
    within += expected_m == 0.0 ? 1 : 0;
    EXPECT_EQ(all.Holds(p), expected_m == 0.0);
    EXPECT_NEAR(all.Distance(p), expected_m, 1e-15);
  }
  EXPECT_GT(within, 100);
  EXPECT_LT(within, 2900);
}

TEST(PieceUnion, OnePieceBoundsTheHullOfPoints) {
  RandomStream random(4, 0, "points");
  const std::vector<ConvexPiece> pieces = Pieces(9, random);
  const PieceUnion all(pieces);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d center = Around(Eigen::Vector3d::Zero(), 0.008, random);
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < 3 + i % 3; ++k) points.push_back(Around(center, 0.002, random));
    double expected_m = kInfinity;
    for (const ConvexPiece& piece : pieces) {
      double largest_m = 0.0;
      for (const Eigen::Vector3d& p : points) largest_m = std::max(largest_m, DistanceTo(piece, p));
      expected_m = std::min(expected_m, largest_m);
    }
    EXPECT_NEAR(all.LargestFromOne(points, kInfinity), expected_m, 1e-15);
    EXPECT_NEAR(all.LargestFromOne(points, 0.002), std::min(expected_m, 0.002), 1e-15);
    const double share = random.Uniform();
    EXPECT_LE(all.Distance(share * points[0] + (1 - share) * points[1]), expected_m + 1e-15);
  }
}

TEST(Deviation, WhatIsLostIsAsFarAsTheFarthestPoint) {
  RandomStream random(6, 0, "points");
  for (int trial = 0; trial < 4; ++trial) {
    const std::vector<ConvexPiece> part = Pieces(1, random);
    const std::vector<ConvexPiece> pieces = Pieces(5, random);
    const MeshTree tree(part.front().surface);
    const double accuracy_m = 1e-5;
    const Deviation deviation = DeviationOf(tree, pieces, std::nullopt, accuracy_m);
    double farthest_m = 0.0;
    const TriangleMesh& mesh = tree.mesh();
    for (int t = 0; t < mesh.size(); ++t) {
      for (int i = 0; i < 40; ++i) {
        const double u = random.Uniform();
        const double v = random.Uniform() * (1 - u);
        const Eigen::Vector3d p = mesh.Corner(t, 0) + u * (mesh.Corner(t, 1) - mesh.Corner(t, 0)) +
                                  v * (mesh.Corner(t, 2) - mesh.Corner(t, 0));
        farthest_m = std::max(farthest_m, Nearest(pieces, p));
      }
    }
    EXPECT_GE(deviation.lost_m, farthest_m - accuracy_m);
    EXPECT_NEAR(Nearest(pieces, deviation.lost_at), deviation.lost_m, accuracy_m);
  }
}

}  // namespace
}  // namespace feeler::cad
