#include "feeler/cad/mesh/mesh_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace feeler::cad {
namespace {

double SquaredDistance(const Box& box, const Eigen::Vector3d& p) { return box.squaredExteriorDistance(p); }

/// Whether the ray from `p` along `d` meets the box (slabs).
bool RayMeets(const Box& box, const Eigen::Vector3d& p, const Eigen::Vector3d& inverse) {
  double low = 0;
  double high = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double a = (box.min()[k] - p[k]) * inverse[k];
    const double b = (box.max()[k] - p[k]) * inverse[k];
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high;
}

std::vector<Box> BoxesOf(const TriangleMesh& mesh) {
  std::vector<Box> boxes;
  boxes.reserve(mesh.triangles.size());
  for (int t = 0; t < mesh.size(); ++t) boxes.push_back(BoundsOf(mesh, t));
  return boxes;
}

}  // namespace

Eigen::Vector3d ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double sum = va + vb + vc;
  if (sum == 0) return a;
  return a + ab * (vb / sum) + ac * (vc / sum);
}

MeshTree::MeshTree(const TriangleMesh& mesh) : mesh_(mesh), tree_(BoxesOf(mesh)) {}

double MeshTree::Distance(const Eigen::Vector3d& p, double most_m) const {
  const std::vector<BoxTree::Node>& nodes = tree_.nodes();
  double best = most_m * most_m;
  std::array<int, 64> stack{};  // the tree halves: it is less than 32 deep
  std::size_t waiting = 0;
  if (!nodes.empty()) stack[waiting++] = 0;
  while (waiting > 0) {
    const BoxTree::Node& node = nodes[static_cast<std::size_t>(stack[--waiting])];
    if (SquaredDistance(node.box, p) >= best) continue;
    if (node.count > 0) {
      for (int i = node.first; i < node.first + node.count; ++i) {
        const int t = tree_.order()[static_cast<std::size_t>(i)];
        const Eigen::Vector3d q = ClosestOnTriangle(p, mesh_.Corner(t, 0), mesh_.Corner(t, 1), mesh_.Corner(t, 2));
        best = std::min(best, (p - q).squaredNorm());
      }
      continue;
    }
    const double first = SquaredDistance(nodes[static_cast<std::size_t>(node.first)].box, p);
    const double second = SquaredDistance(nodes[static_cast<std::size_t>(node.second)].box, p);
    // The nearer child last, so that it is looked at first.
    stack[waiting++] = first < second ? node.second : node.first;
    stack[waiting++] = first < second ? node.first : node.second;
  }
  return std::sqrt(best);
}

int MeshTree::Crossings(const Eigen::Vector3d& p, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d inverse = direction.cwiseInverse();
  int sum = 0;
  tree_.Descend([&](const Box& box) { return RayMeets(box, p, inverse); },
                [&](int t) {
                  const Eigen::Vector3d a = mesh_.Corner(t, 0) - p;
                  const Eigen::Vector3d b = mesh_.Corner(t, 1) - p;
                  const Eigen::Vector3d c = mesh_.Corner(t, 2) - p;
                  const double u = direction.dot(b.cross(c));
                  const double v = direction.dot(c.cross(a));
                  const double w = direction.dot(a.cross(b));
                  const bool outward = u > 0 && v > 0 && w > 0;
                  const bool inward = u < 0 && v < 0 && w < 0;
                  if (!outward && !inward) return true;
                  if (a.dot((b - a).cross(c - a)) * (outward ? 1 : -1) > 0) sum += outward ? 1 : -1;
                  return true;
                });
  return sum;
}

bool MeshTree::Inside(const Eigen::Vector3d& p) const {
  if (tree_.empty() || tree_.nodes().front().box.squaredExteriorDistance(p) > 0) return false;
  static const std::array<Eigen::Vector3d, 3> kDirections = {Eigen::Vector3d(0.4136718, 0.6370233, 0.6504911),
                                                             Eigen::Vector3d(-0.7213402, 0.3091177, 0.6197771),
                                                             Eigen::Vector3d(0.2271903, -0.8534107, -0.4690123)};
  const auto inside = [&](std::size_t ray) { return Crossings(p, kDirections[ray]) > 0; };
  const bool first = inside(0);
  return first == inside(1) ? first : inside(2);
}

void MeshTree::Visit(const Box& box, const std::function<bool(int)>& visit) const {
  const auto meets = [&](const Box& other) { return other.intersects(box); };
  tree_.Descend(meets, [&](int t) { return !meets(BoundsOf(mesh_, t)) || visit(t); });
}

}  // namespace feeler::cad
