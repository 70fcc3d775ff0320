#include "feeler/cad/pieces/piece_union.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace feeler::cad {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// What the sums of a bound may be rounded by: lengths are below 1 m.
constexpr double kRounding_m = 1e-14;

/// The half-spaces of a piece, in a tree by their normals: whether a point is beyond one of many is known without
/// asking all.
class PlaneTree {
 public:
  explicit PlaneTree(const ConvexPiece& piece)
      : planes_(piece.planes), center_(piece.bounds.center()), order_(piece.planes.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    if (!order_.empty()) Build(0, order_.size());
  }

  bool Holds(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = p - center_;
    return nodes_.empty() || !IsBeyondOne(0, p, q);
  }

 private:
  struct Node {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(kInfinity);  ///< of the normals
    Eigen::Vector3d high = Eigen::Vector3d::Constant(-kInfinity);
    double least_m = kInfinity;  ///< offset, seen from the middle of the piece
    std::size_t first = 0;       ///< of its planes in order_, for a leaf; else the number of its first child
    std::size_t count = 0;       ///< 0: an inner node
    std::size_t second = 0;
  };

  std::size_t Build(std::size_t first, std::size_t count) {
    constexpr std::size_t kLeaf = 8;
    const std::size_t number = nodes_.size();
    nodes_.emplace_back();
    Node node;
    for (std::size_t i = first; i < first + count; ++i) {
      const HalfSpace& plane = planes_[order_[i]];
      node.low = node.low.cwiseMin(plane.normal);
      node.high = node.high.cwiseMax(plane.normal);
      node.least_m = std::min(node.least_m, plane.offset_m - plane.normal.dot(center_));
    }
    node.first = first;
    node.count = count;
    if (count > kLeaf) {
      int axis = 0;
      (node.high - node.low).maxCoeff(&axis);
      const std::size_t half = count / 2;
      const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(first);
      std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(half), begin + static_cast<std::ptrdiff_t>(count),
                       [&](std::size_t a, std::size_t b) {
                         const double x = planes_[a].normal[axis];
                         const double y = planes_[b].normal[axis];
                         return x != y ? x < y : a < b;
                       });
      node.count = 0;
      node.first = Build(first, half);
      node.second = Build(first + half, count - half);
    }
    nodes_[number] = node;
    return number;
  }

  /// How far beyond one of its planes a point may be at most.
  static double Bound(const Node& node, const Eigen::Vector3d& q) {
    return node.low.cwiseProduct(q).cwiseMax(node.high.cwiseProduct(q)).sum() - node.least_m;
  }

  bool IsBeyondOne(std::size_t number, const Eigen::Vector3d& p, const Eigen::Vector3d& q) const {
    const Node& node = nodes_[number];
    if (node.count > 0) {
      for (std::size_t i = node.first; i < node.first + node.count; ++i) {
        const HalfSpace& plane = planes_[order_[i]];
        if (plane.normal.dot(p) - plane.offset_m > 0) return true;
      }
      return false;
    }
    const double first = Bound(nodes_[node.first], q);
    const double second = Bound(nodes_[node.second], q);
    // First where it is more likely.
    const std::size_t likely = first >= second ? node.first : node.second;
    const std::size_t other = first >= second ? node.second : node.first;
    if (std::max(first, second) > -kRounding_m && IsBeyondOne(likely, p, q)) return true;
    return std::min(first, second) > -kRounding_m && IsBeyondOne(other, p, q);
  }

  const std::vector<HalfSpace>& planes_;
  Eigen::Vector3d center_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace

struct PieceUnion::Searched {
  explicit Searched(const ConvexPiece& piece) : bounds(piece.bounds), planes(piece), faces(piece.surface) {}

  bool Holds(const Eigen::Vector3d& p) const { return bounds.contains(p) && planes.Holds(p); }
  /// 0 inside, else the distance, or `most_m` where it is no less.
  double Distance(const Eigen::Vector3d& p, double most_m) const {
    if (bounds.squaredExteriorDistance(p) >= most_m * most_m) return most_m;
    return planes.Holds(p) ? 0.0 : faces.Distance(p, most_m);
  }

  Box bounds;
  PlaneTree planes;
  MeshTree faces;
};

PieceUnion::PieceUnion(const std::vector<ConvexPiece>& pieces)
    : boxes_([&] {
        std::vector<Box> boxes;
        for (const ConvexPiece& piece : pieces) boxes.push_back(piece.bounds);
        return boxes;
      }()) {
  pieces_.reserve(pieces.size());
  for (const ConvexPiece& piece : pieces) {
    pieces_.emplace_back(piece);
    Append(piece.surface, faces_);
  }
  nearest_ = std::make_unique<MeshTree>(faces_);
}

PieceUnion::~PieceUnion() = default;

bool PieceUnion::Holds(const Eigen::Vector3d& p) const {
  bool held = false;
  boxes_.Descend([&](const Box& box) { return box.contains(p); },
                 [&](int i) {
                   held = pieces_[static_cast<std::size_t>(i)].Holds(p);
                   return !held;
                 });
  return held;
}

double PieceUnion::Distance(const Eigen::Vector3d& p) const { return Holds(p) ? 0.0 : nearest_->Distance(p); }

double PieceUnion::LargestFromOne(const std::vector<Eigen::Vector3d>& points, double most_m) const {
  double least_m = most_m;
  // A piece is of use only if all points are nearer to its box.
  const auto may_be_less = [&](const Box& box) {
    return std::all_of(points.begin(), points.end(),
                       [&](const Eigen::Vector3d& p) { return box.squaredExteriorDistance(p) < least_m * least_m; });
  };
  boxes_.Descend(may_be_less, [&](int i) {
    const Searched& piece = pieces_[static_cast<std::size_t>(i)];
    if (!may_be_less(piece.bounds)) return true;
    double largest_m = 0.0;
    for (const Eigen::Vector3d& p : points) {
      largest_m = std::max(largest_m, piece.Distance(p, least_m));
      if (largest_m >= least_m) return true;
    }
    least_m = largest_m;
    return least_m > 0.0;
  });
  return least_m;
}

}  // namespace feeler::cad
