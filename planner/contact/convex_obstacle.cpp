#include "feeler/planner/contact/convex_obstacle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace feeler::planner {
namespace {

using Triangle = std::array<Eigen::Vector3d, 3>;
constexpr int kMaxSteps = 200;
constexpr double kConverged_m = 1e-9;

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
double Cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return Cross(Eigen::Vector2d(a.head<2>()), b.head<2>());
}

/// Coordinates in which the line is the third axis, through the origin.
template <class SupportFunction>
class LineView {
 public:
  LineView(int axis, const Eigen::Vector3d& point_m, const SupportFunction& support)
      : axis_(axis), point_m_(point_m), support_(support) {
    // A line exactly in an edge or face makes degenerate triangles; a tenth of a nanometre is no length.
    point_m_[(axis + 1) % 3] += 1.37e-10;
    point_m_[(axis + 2) % 3] += 0.71e-10;
    point_m_[axis] = 0;
  }
  Eigen::Vector3d ToView(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = p - point_m_;
    return {q[(axis_ + 1) % 3], q[(axis_ + 2) % 3], q[axis_]};
  }
  Eigen::Vector3d Support(const Eigen::Vector3d& d) const {
    Eigen::Vector3d direction;
    direction[(axis_ + 1) % 3] = d.x();
    direction[(axis_ + 2) % 3] = d.y();
    direction[axis_] = d.z();
    return ToView(support_(direction));
  }
  Eigen::Vector3d Support(const Eigen::Vector2d& d) const { return Support(Eigen::Vector3d(d.x(), d.y(), 0)); }

 private:
  int axis_;
  Eigen::Vector3d point_m_;
  const SupportFunction& support_;
};

/// A triangle of obstacle points whose projection along the line holds the line; empty when the line misses.
/// `inside` is a point of the obstacle. Works in the projection: a ray from `inside` to the line is enclosed between
/// two support points, which are moved outward until their chord passes the line or proves that it cannot.
template <class View>
std::optional<Triangle> Enclose(const View& view, const Eigen::Vector3d& inside) {
  const Eigen::Vector2d center = inside.head<2>();
  const Eigen::Vector2d ray = center.norm() > 1e-9 ? Eigen::Vector2d(-center) : Eigen::Vector2d(1, 0);
  Eigen::Vector3d first = view.Support(ray);
  if (first.head<2>().dot(ray) <= 0 && center.norm() > 1e-9) return std::nullopt;

  Eigen::Vector3d second;
  double side = 0;  // of the ray, seen from the first point: +1 counterclockwise
  for (int step = 0;; ++step) {
    if (step == kMaxSteps) return std::nullopt;
    const Eigen::Vector2d arm = first.head<2>() - center;
    side = Cross(arm, ray) >= 0 ? 1.0 : -1.0;
    const Eigen::Vector2d normal = side * Eigen::Vector2d(-arm.y(), arm.x());
    second = view.Support(normal);
    if (second.head<2>().dot(normal) <= 0) return std::nullopt;
    if (side * Cross(Eigen::Vector2d(second.head<2>() - center), ray) <= 0) break;
    first = second;
  }

  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::Vector2d chord = second.head<2>() - first.head<2>();
    const Eigen::Vector2d normal = side * Eigen::Vector2d(chord.y(), -chord.x());
    if (normal.dot(first.head<2>()) >= 0) return Triangle{inside, first, second};
    const Eigen::Vector3d next = view.Support(normal);
    const double reach = normal.dot(next.head<2>());
    if (reach <= 0 || reach - normal.dot(first.head<2>()) <= 1e-12 * normal.norm()) return std::nullopt;
    (side * Cross(Eigen::Vector2d(next.head<2>() - center), ray) >= 0 ? first : second) = next;
  }
  return std::nullopt;
}

/// Smallest barycentric coordinate of the line in the triangle's projection; most negative for a degenerate triangle.
double Depth(const Triangle& t) {
  const double area = Cross(Eigen::Vector3d(t[1] - t[0]), Eigen::Vector3d(t[2] - t[0]));
  if (std::abs(area) < 1e-24) return -std::numeric_limits<double>::infinity();
  return std::min({Cross(t[1], t[2]) / area, Cross(t[2], t[0]) / area, Cross(t[0], t[1]) / area});
}

/// Farthest point of the obstacle along the line towards `sign`, and the slope of the surface there.
template <class View>
std::pair<double, double> Extreme(const View& view, Triangle triangle, double sign) {
  double highest = std::numeric_limits<double>::infinity();
  double lowest = -std::numeric_limits<double>::infinity();
  double slope = 1;
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    const double length = normal.norm();
    if (std::abs(normal.z()) < 1e-24 || length == 0) break;
    normal *= (sign * normal.z() > 0 ? 1.0 : -1.0) / length;
    const double rise = sign * normal.z();
    lowest = std::max(lowest, normal.dot(triangle[0]) / rise);
    const Eigen::Vector3d next = view.Support(normal);
    const double bound = normal.dot(next) / rise;
    if (bound < highest) {
      highest = bound;
      slope = rise;
    }
    if (highest - lowest <= kConverged_m) break;
    Triangle best = triangle;
    double deepest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
      Triangle candidate = triangle;
      candidate[k] = next;
      if (const double depth = Depth(candidate); depth > deepest) {
        deepest = depth;
        best = candidate;
      }
    }
    if (!std::isfinite(deepest)) break;
    triangle = best;
  }
  const double t = std::isfinite(lowest) ? lowest : highest;
  return {sign * t, slope};
}

}  // namespace

ConvexObstacle::ConvexObstacle(ConvexShape tool, ConvexShape target)
    : tool_(std::move(tool)), target_(std::move(target)), center_m_(target_.center() - tool_.center()) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    max_m_[axis] = Support(unit)[axis];
    min_m_[axis] = Support(-unit)[axis];
  }
  is_aligned_box_ = tool_.is_aligned_box() && target_.is_aligned_box();
}

std::optional<Cut> ConvexObstacle::CutBy(int axis, const Eigen::Vector3d& point_m) const {
  for (const int across : {(axis + 1) % 3, (axis + 2) % 3}) {
    if (point_m[across] <= min_m_[across] || point_m[across] >= max_m_[across]) return std::nullopt;
  }
  if (is_aligned_box_) return Cut{min_m_[axis], max_m_[axis]};
  const auto support = [this](const Eigen::Vector3d& d) { return Support(d); };
  const LineView view(axis, point_m, support);
  const auto triangle = Enclose(view, view.ToView(center_m_));
  if (!triangle) return std::nullopt;
  const auto [high, high_slope] = Extreme(view, *triangle, 1);
  const auto [low, low_slope] = Extreme(view, *triangle, -1);
  if (!(low < high)) return std::nullopt;
  return Cut{low, high, low_slope, high_slope};
}

}  // namespace feeler::planner
