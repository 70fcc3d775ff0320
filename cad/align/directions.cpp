#include "feeler/cad/align/directions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace feeler::cad {
namespace {

constexpr double kSameDirection = 0.99996;  // cosine of half a degree
constexpr std::size_t kMostNormals = 8;
constexpr double kLeastShare = 0.02;      ///< of the surface, or of its edges, for a direction to count
constexpr double kExactly = 0.999999875;  ///< cosine of what a file of six digits leaves open, 5e-4
constexpr double kBend = 0.01;            ///< sine of the angle at an edge, from which on it is one

struct Direction {
  Eigen::Vector3d unit;
  double weight;  ///< area or length
};

/// Directions that are one, either way round, gathered: the first of each, which has the largest weight, and the sum.
/// What is fewer than `least` is left out.
std::vector<Direction> Gathered(std::vector<Direction> all, double same, int least) {
  constexpr std::size_t kMostGroups = 2000;
  std::stable_sort(all.begin(), all.end(),
                   [](const Direction& a, const Direction& b) { return a.weight > b.weight * (1 + 1e-9); });
  std::vector<Direction> groups;
  std::vector<int> counts;
  for (const Direction& one : all) {
    const auto known = std::find_if(groups.begin(), groups.end(),
                                    [&](const Direction& group) { return std::abs(group.unit.dot(one.unit)) >= same; });
    if (known != groups.end()) {
      known->weight += one.weight;
      ++counts[static_cast<std::size_t>(known - groups.begin())];
    } else if (groups.size() < kMostGroups) {
      groups.push_back(one);
      counts.push_back(1);
    }
  }
  for (std::size_t i = groups.size(); i-- > 0;) {
    if (counts[i] < least) groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(i));
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Direction& a, const Direction& b) { return a.weight > b.weight * (1 + 1e-9); });
  return groups;
}

/// Those with the largest weights, and a share of the sum.
std::vector<Direction> Largest(std::vector<Direction> groups, double least_share) {
  double total = 0;
  for (const Direction& group : groups) total += group.weight;
  if (groups.size() > kMostNormals) groups.resize(kMostNormals);
  std::erase_if(groups, [&](const Direction& group) { return group.weight < least_share * total; });
  return groups;
}

std::vector<Direction> NormalsOf(const TriangleMesh& mesh) {
  std::vector<Direction> normals;
  for (int t = 0; t < mesh.size(); ++t) {
    const Eigen::Vector3d area = AreaVector(mesh, t);
    const double size = area.norm();
    if (size >= 1e-14) normals.push_back({area / size, size});
  }
  return Gathered(std::move(normals), kSameDirection, 1);
}

/// Edges at which the surface bends: those along a bore, a prism or a slot are parallel to its axis, however it lies.
std::vector<Direction> BentEdgesOf(const TriangleMesh& mesh) {
  struct Use {
    std::array<int, 2> edge;
    int triangle;
  };
  std::vector<Use> uses;
  uses.reserve(3 * mesh.triangles.size());
  for (int t = 0; t < mesh.size(); ++t) {
    const auto& c = mesh.triangles[static_cast<std::size_t>(t)];
    for (std::size_t k = 0; k < 3; ++k) {
      const int i = c[k];
      const int j = c[(k + 1) % 3];
      uses.push_back({{std::min(i, j), std::max(i, j)}, t});
    }
  }
  std::sort(uses.begin(), uses.end(),
            [](const Use& a, const Use& b) { return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle; });
  std::vector<Direction> edges;
  for (std::size_t i = 0; i + 1 < uses.size(); ++i) {
    if (uses[i].edge != uses[i + 1].edge) continue;
    const Eigen::Vector3d a = AreaVector(mesh, uses[i].triangle);
    const Eigen::Vector3d b = AreaVector(mesh, uses[i + 1].triangle);
    if (a.cross(b).norm() <= kBend * a.norm() * b.norm()) continue;
    const Eigen::Vector3d along =
        mesh.points[static_cast<std::size_t>(uses[i].edge[1])] - mesh.points[static_cast<std::size_t>(uses[i].edge[0])];
    const double length = along.norm();
    if (length > 1e-6) edges.push_back({along / length, length});
  }
  return edges;
}

/// The direction to which the faces along a direction are most nearly parallel; itself where they lie all in one.
Eigen::Vector3d AlongFaces(const TriangleMesh& mesh, const Eigen::Vector3d& direction) {
  constexpr double kAlong = 2e-3;  ///< sine of the angle between such a face and the direction
  constexpr double kSpread = 0.01;
  Eigen::Vector3d along = direction;
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (int t = 0; t < mesh.size(); ++t) {
      const Eigen::Vector3d area = AreaVector(mesh, t);
      const double size = area.norm();
      if (size >= 1e-14 && std::abs(area.dot(along)) < kAlong * size) spread += area * area.transpose() / size;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);  // eigenvalues increase
    if (solver.eigenvalues()[1] < kSpread * solver.eigenvalues()[2]) return direction;
    along = solver.eigenvectors().col(0) * (solver.eigenvectors().col(0).dot(along) < 0 ? -1.0 : 1.0);
  }
  return along;
}

/// The directions in which most of the length of bent edges runs. The edges of a bore whose rim slants are not quite
/// parallel, for the rim has corners of its own: the faces between them tell better.
std::vector<Direction> EdgeDirectionsOf(const TriangleMesh& mesh) {
  constexpr int kLeastEdges = 3;  // the lines of a cone, or of what tapers, are not parallel
  constexpr double kParallel = 1e-5;
  const std::vector<Direction> edges = BentEdgesOf(mesh);
  std::vector<Direction> largest = Largest(Gathered(edges, kExactly, kLeastEdges), kLeastShare);
  for (Direction& group : largest) {
    const bool parallel = std::none_of(edges.begin(), edges.end(), [&](const Direction& edge) {
      return std::abs(edge.unit.dot(group.unit)) >= kExactly && edge.unit.cross(group.unit).norm() > kParallel;
    });
    if (!parallel) group.unit = AlongFaces(mesh, group.unit);
  }
  return largest;
}

}  // namespace

std::vector<Eigen::Vector3d> ShapeDirections(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> directions;
  for (const std::vector<Direction>& some : {Largest(NormalsOf(mesh), kLeastShare), EdgeDirectionsOf(mesh)}) {
    for (const Direction& d : some) {
      const bool known = std::any_of(directions.begin(), directions.end(), [&](const Eigen::Vector3d& other) {
        return std::abs(other.dot(d.unit)) > kSameDirection;
      });
      if (!known) directions.push_back(d.unit);
    }
  }
  return directions;
}

std::vector<Eigen::Vector3d> CandidateDirections(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> shape = ShapeDirections(mesh);
  std::vector<Eigen::Vector3d> directions;
  for (const int axis : {2, 0, 1}) {
    Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    // A part that stands a little aslant in its frame has its own axis.
    for (const Eigen::Vector3d& d : shape) {
      const double along = d[axis];
      if (std::abs(along) > kSameDirection && std::abs(along) < kExactly) unit = along > 0 ? d : Eigen::Vector3d(-d);
    }
    directions.push_back(unit);
    directions.push_back(-unit);
  }
  for (const Eigen::Vector3d& d : shape) {
    if (std::any_of(directions.begin(), directions.end(),
                    [&](const auto& known) { return known.dot(d) > kSameDirection; }))
      continue;
    directions.push_back(d);
    directions.push_back(-d);
  }
  return directions;
}

Eigen::Matrix3d RotationToZ(const Eigen::Vector3d& direction) {
  if (direction.z() < -1 + 1e-12) return Eigen::Vector3d(1, -1, -1).asDiagonal();
  Eigen::Matrix3d rotation = Eigen::Quaterniond::FromTwoVectors(direction, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (double& value : rotation.reshaped()) {
    if (std::abs(value - std::round(value)) < 1e-12) value = std::round(value);
  }
  return rotation;
}

}  // namespace feeler::cad
