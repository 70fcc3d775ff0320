#include "feeler/cad/align/candidates.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace feeler::cad {
namespace {

constexpr double kSameDirection = 0.99996;  // cosine of half a degree
constexpr std::size_t kMostNormals = 8;
constexpr double kLeastShare = 0.02;      ///< of the surface, or of its edges, for a direction to count
constexpr double kExactly = 0.999999875;  ///< cosine of what a file of six digits leaves open, 5e-4
constexpr double kBend = 0.01;            ///< sine of the angle at an edge, from which on it is one
constexpr std::size_t kMostSlabs = 24;
constexpr std::size_t kMostLevels = 200;

void Dominant(Feature& feature) {
  constexpr int kBins = 360;
  std::array<double, kBins> length{};
  double perimeter = 0;
  const auto bin_of = [](double angle) {
    return static_cast<int>(std::floor(angle / std::numbers::pi * kBins)) % kBins;
  };
  const auto angle_of = [](const Eigen::Vector2d& e) {
    const double angle = std::atan2(e.y(), e.x());
    const double folded = angle < 0 ? angle + std::numbers::pi : angle;
    return folded >= std::numbers::pi - 1e-9 ? 0.0 : folded;
  };
  const std::size_t count = feature.loop.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d e = feature.loop[(i + 1) % count].middle - feature.loop[i].middle;
    length[static_cast<std::size_t>(bin_of(angle_of(e) + 1e-9))] += e.norm();
    perimeter += e.norm();
  }
  const auto best = std::max_element(length.begin(), length.end());
  feature.has_edges = *best > 0.08 * perimeter;
  // The exact direction: that of the longest edge in the bin.
  double longest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d e = feature.loop[(i + 1) % count].middle - feature.loop[i].middle;
    if (bin_of(angle_of(e) + 1e-9) != best - length.begin() || e.norm() <= longest + 1e-9) continue;
    longest = e.norm();
    feature.edge_rad = angle_of(e);
  }
}

}  // namespace

namespace {

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

namespace {

/// The slabs that are looked at: all of them, or, of a free form with very many levels, the thickest.
std::vector<std::size_t> SlabsToLookAt(const std::vector<double>& levels) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i) order.push_back(i);
  if (order.size() <= kMostLevels) return order;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return levels[a + 1] - levels[a] > levels[b + 1] - levels[b] + 1e-9;
  });
  order.resize(kMostSlabs);
  std::sort(order.begin(), order.end());
  return order;
}

SlabLoop LowerEnd(SlabLoop loop) {
  for (SlabPoint& p : loop) p.middle = p.low;
  return loop;
}

SlabLoop UpperEnd(SlabLoop loop) {
  for (SlabPoint& p : loop) p.middle = p.high;
  return loop;
}

/// 1 if the area grows from the lower end to the upper, -1 if it shrinks.
int Tapers(const SlabLoop& low, const SlabLoop& high) {
  const double low_m2 = std::abs(SignedArea(LowerEnd(low)));
  const double high_m2 = std::abs(SignedArea(UpperEnd(high)));
  if (std::abs(high_m2 - low_m2) <= 1e-4 * std::max(low_m2, high_m2)) return 0;
  return high_m2 > low_m2 ? 1 : -1;
}

double Around(const SlabLoop& loop) {
  double length = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    length += (loop[i].middle - loop[(i + 1) % loop.size()].middle).norm();
  }
  return length;
}

/// A line that goes on into the next slab, as of a prism or a taper. Where the slabs meet it is the same; what steps
/// there, as at the end of a key, is another, however little that is of the whole.
bool GoesOn(const Feature& below, const Feature& above) {
  constexpr double kSame_m = 4e-6;  // lines are simplified by 1e-6
  if (below.hole != above.hole || std::abs(below.high_m - above.low_m) > 1e-9) return false;
  if (std::abs(below.area - above.area) > 0.03 * std::max(below.area, above.area)) return false;
  if (Tapers(below.loop, below.loop) != Tapers(above.loop, above.loop)) return false;
  const SlabLoop end = UpperEnd(below.loop);
  const SlabLoop begin = LowerEnd(above.loop);
  if (std::abs(std::abs(SignedArea(end)) - std::abs(SignedArea(begin))) > kSame_m * Around(end)) return false;
  const Eigen::AlignedBox2d a = BoundsOf(below.loop);
  const Eigen::AlignedBox2d b = BoundsOf(above.loop);
  return (a.center() - b.center()).norm() < 0.02 * a.sizes().maxCoeff();
}

}  // namespace

std::vector<Feature> FeaturesOf(const TriangleMesh& mesh) {
  const std::vector<double> levels = LevelsOf(mesh, 2e-6);
  // Chains of lines that go on from slab to slab; each is one feature, with the line in its middle.
  std::vector<std::vector<Feature>> chains;
  for (const std::size_t i : SlabsToLookAt(levels)) {
    for (const SlabLoop& raw : SlabBetween(mesh, levels[i], levels[i + 1]).loops) {
      Feature feature;
      feature.loop = Simplified(raw, [](const SlabPoint&) { return 1e-6; });
      const double area = SignedArea(feature.loop);
      feature.hole = area < 0;
      feature.area = std::abs(area);
      feature.low_m = levels[i];
      feature.high_m = levels[i + 1];
      if (feature.area < 1e-8) continue;  // a tenth of a millimetre across
      const auto chain =
          std::find_if(chains.begin(), chains.end(), [&](const auto& known) { return GoesOn(known.back(), feature); });
      if (chain == chains.end()) {
        chains.push_back({std::move(feature)});
      } else {
        chain->push_back(std::move(feature));
      }
    }
  }
  std::vector<Feature> features;
  for (const std::vector<Feature>& chain : chains) {
    const double middle = 0.5 * (chain.front().low_m + chain.back().high_m);
    const auto at =
        std::find_if(chain.begin(), chain.end(), [&](const Feature& f) { return f.high_m >= middle - 1e-12; });
    Feature feature = *at;
    feature.low_m = chain.front().low_m;
    feature.high_m = chain.back().high_m;
    feature.tapers = Tapers(chain.front().loop, chain.back().loop);
    const Eigen::Vector2d low = BoundsOf(LowerEnd(chain.front().loop)).center();
    const Eigen::Vector2d high = BoundsOf(UpperEnd(chain.back().loop)).center();
    feature.lean = (high - low).norm() / (feature.high_m - feature.low_m);
    if (feature.tapers != 0) {
      feature.low_loop = LowerEnd(chain.front().loop);
      feature.high_loop = UpperEnd(chain.back().loop);
    }
    Dominant(feature);
    feature.profile = ProfileOf(feature.loop);
    features.push_back(std::move(feature));
  }
  return features;
}

}  // namespace feeler::cad
