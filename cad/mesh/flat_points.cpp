#include "feeler/cad/mesh/flat_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <vector>

namespace feeler::cad {
namespace {

/// The rounding of a file of single precision, at the size of a part.
constexpr double kPlane_m = 1e-8;
/// A triangle that is left is not flatter than this, m.
constexpr double kSliver_m = 1e-7;

/// Nearer than any two points of a welded part.
constexpr double kSame_m = 1e-10;

using Triangle = std::array<int, 3>;

class Pruner {
 public:
  explicit Pruner(const TriangleMesh& mesh) : mesh_(mesh), around_(mesh.points.size()) {
    for (int t = 0; t < mesh_.size(); ++t) {
      for (const int p : Of(t)) around_[At(p)].push_back(t);
    }
  }

  TriangleMesh Run() {
    for (bool any = true; any;) {
      any = false;
      for (int point = 0; point < static_cast<int>(mesh_.points.size()); ++point) any = Remove(point) || any;
    }
    std::erase_if(mesh_.triangles, [](const Triangle& corners) { return corners[0] < 0; });
    return Welded(mesh_, kSame_m);  // the points that are left
  }

 private:
  static std::size_t At(int i) { return static_cast<std::size_t>(i); }
  Triangle& Of(int t) { return mesh_.triangles[At(t)]; }
  bool Has(int t, int point) { return std::ranges::find(Of(t), point) != Of(t).end(); }

  /// The points that share an edge with a point, increasing; empty unless its triangles go once around it.
  std::vector<int> Ring(int point) {
    std::vector<int> after;   // of each triangle, seen from outside, the corner after the point
    std::vector<int> before;  // and the one before it
    for (const int t : around_[At(point)]) {
      const Triangle& c = Of(t);
      const std::size_t k = At(static_cast<int>(std::ranges::find(c, point) - c.begin()));
      after.push_back(c[(k + 1) % 3]);
      before.push_back(c[(k + 2) % 3]);
    }
    std::ranges::sort(after);
    std::ranges::sort(before);
    const bool once = after == before && std::ranges::adjacent_find(after) == after.end();
    return once ? after : std::vector<int>();
  }

  bool Remove(int point) {
    for (const int into : Ring(point)) {
      if (!MayGoInto(point, into)) continue;
      for (const int t : around_[At(point)]) {
        if (Has(t, into)) {
          for (const int p : Of(t)) {
            if (p != point) std::erase(around_[At(p)], t);
          }
          Of(t).fill(-1);
        } else {
          std::ranges::replace(Of(t), point, into);
          around_[At(into)].push_back(t);
        }
      }
      around_[At(point)].clear();
      return true;
    }
    return false;
  }

  bool MayGoInto(int point, int into) {
    // The edge between them is all that joins them: nothing else would come to lie on itself.
    std::set<int> shared;
    int joined = 0;
    for (const int t : around_[At(point)]) {
      if (Has(t, into)) ++joined;
    }
    const std::vector<int> ring = Ring(point);
    for (const int t : around_[At(into)]) {
      for (const int p : Of(t)) {
        if (p != into && p != point && std::ranges::binary_search(ring, p)) shared.insert(p);
      }
    }
    if (joined != 2 || shared.size() != 2) return false;
    const Eigen::Vector3d& place = mesh_.points[At(into)];
    for (const int t : around_[At(point)]) {
      if (Has(t, into)) continue;
      const Eigen::Vector3d before = AreaVector(mesh_, t);
      if (std::abs(before.normalized().dot(place - mesh_.points[At(point)])) > kPlane_m) return false;
      Eigen::Matrix3d corner;
      for (int k = 0; k < 3; ++k) corner.col(k) = Of(t)[At(k)] == point ? place : mesh_.Corner(t, k);
      const Eigen::Vector3d after = (corner.col(1) - corner.col(0)).cross(corner.col(2) - corner.col(0));
      const double longest = std::max({(corner.col(1) - corner.col(0)).norm(), (corner.col(2) - corner.col(1)).norm(),
                                       (corner.col(0) - corner.col(2)).norm()});
      if (after.dot(before) <= 0.0 || after.norm() < kSliver_m * longest) return false;
    }
    return true;
  }

  TriangleMesh mesh_;
  std::vector<std::vector<int>> around_;  ///< triangles at each point
};

}  // namespace

TriangleMesh WithoutFlatPoints(const TriangleMesh& mesh) { return Pruner(mesh).Run(); }

}  // namespace feeler::cad
