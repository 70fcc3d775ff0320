#include "feeler/cad/measure/sliding.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace feeler::cad {
namespace {

using Triangle = std::array<Eigen::Vector3d, 3>;
/// Motions that graze a face at less than this sine do not meet it.
constexpr double kGraze = 1e-7;
/// A start that is in the face by no more than this touches it.
constexpr double kTouch_m = 1e-7;

Triangle CornersOf(const TriangleMesh& mesh, int t, const Eigen::Vector3d& offset) {
  return {mesh.Corner(t, 0) + offset, mesh.Corner(t, 1) + offset, mesh.Corner(t, 2) + offset};
}

/// Distance along `direction` from `p` to the triangle; infinite when it is missed.
double RayToTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& direction, const Triangle& t) {
  const Eigen::Vector3d a = t[0] - p;
  const Eigen::Vector3d b = t[1] - p;
  const Eigen::Vector3d c = t[2] - p;
  const double u = direction.dot(b.cross(c));
  const double v = direction.dot(c.cross(a));
  const double w = direction.dot(a.cross(b));
  if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0))) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double along = normal.dot(direction);
  if (std::abs(along) <= kGraze * normal.norm()) return std::numeric_limits<double>::infinity();
  const double distance = a.dot(normal) / along;
  return distance >= -kTouch_m ? std::max(distance, 0.0) : std::numeric_limits<double>::infinity();
}

/// Distance that the segment p0 p1 travels along `direction` to meet the segment q0 q1.
double EdgeToEdge(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1, const Eigen::Vector3d& direction,
                  const Eigen::Vector3d& q0, const Eigen::Vector3d& q1) {
  const Eigen::Vector3d p = p1 - p0;
  const Eigen::Vector3d q = q1 - q0;
  const Eigen::Vector3d normal = p.cross(q);
  const double along = normal.dot(direction);
  if (std::abs(along) <= kGraze * normal.norm() || normal.squaredNorm() < 1e-12 * p.squaredNorm() * q.squaredNorm()) {
    return std::numeric_limits<double>::infinity();
  }
  // p0 + s p + t direction = q0 + r q
  const Eigen::Vector3d gap = q0 - p0;
  const double t = gap.dot(normal) / along;
  if (t < -kTouch_m) return std::numeric_limits<double>::infinity();
  const double s = gap.dot(q.cross(direction)) / p.dot(q.cross(direction));
  const double r = -gap.dot(p.cross(direction)) / q.dot(p.cross(direction));
  if (!(s >= 0 && s <= 1 && r >= 0 && r <= 1)) return std::numeric_limits<double>::infinity();
  return std::max(t, 0.0);
}

double PairTravel(const Triangle& a, const Triangle& b, const Eigen::Vector3d& direction) {
  double travel = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    travel = std::min(travel, RayToTriangle(a[i], direction, b));
    travel = std::min(travel, RayToTriangle(b[i], -direction, a));
    for (std::size_t j = 0; j < 3; ++j) {
      travel = std::min(travel, EdgeToEdge(a[i], a[(i + 1) % 3], direction, b[j], b[(j + 1) % 3]));
    }
  }
  return travel;
}

/// Of the cosine between a face's outward normal and the way: 1 it faces forwards, -1 backwards, 0 it slides along.
int Facing(const Triangle& t, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double along = normal.dot(direction);
  if (std::abs(along) <= kGraze * normal.norm()) return 0;
  return along > 0 ? 1 : -1;
}

bool Pierces(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Triangle& t) {
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double hp = normal.dot(p - t[0]);
  const double hq = normal.dot(q - t[0]);
  if (!((hp > 0 && hq < 0) || (hp < 0 && hq > 0))) return false;
  const Eigen::Vector3d x = p + (q - p) * (hp / (hp - hq));
  for (std::size_t k = 0; k < 3; ++k) {
    if (normal.dot((t[(k + 1) % 3] - t[k]).cross(x - t[k])) < 0) return false;
  }
  return true;
}

}  // namespace

bool TrianglesCut(const Triangle& a, const Triangle& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (Pierces(a[k], a[(k + 1) % 3], b) || Pierces(b[k], b[(k + 1) % 3], a)) return true;
  }
  return false;
}

double MeshSlide::TravelUpTo(const Eigen::Vector3d& offset_m, const Eigen::Vector3d& direction, double most_m) const {
  double travel = most_m;
  const Box reach = BoundsOf(target_.mesh());
  for (int s = 0; s < tool_.size(); ++s) {
    const Triangle corners = CornersOf(tool_, s, offset_m);
    // Faces that look forwards meet faces that look against them; corners and edges that can touch belong to such.
    if (Facing(corners, direction) <= 0) continue;
    Box box(corners[0]);
    box.extend(corners[1]);
    box.extend(corners[2]);
    box.extend(Box(box.min() + travel * direction, box.max() + travel * direction));
    box.min().array() -= kTouch_m;
    box.max().array() += kTouch_m;
    if (!reach.intersects(box)) continue;
    target_.Visit(box, [&](int t) {
      const TriangleMesh& mesh = target_.mesh();
      const Triangle other{mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)};
      if (Facing(other, direction) < 0) travel = std::min(travel, PairTravel(corners, other, direction));
      return travel > 0;
    });
    if (travel <= 0) return 0;
  }
  return travel;
}

double MeshSlide::Travel(const Eigen::Vector3d& offset_m, const Eigen::Vector3d& direction, double most_m) const {
  // Short sweeps are cheap, and most are short.
  for (double reach = std::min(most_m, 1e-3);; reach = std::min(4 * reach, most_m)) {
    const double travel = TravelUpTo(offset_m, direction, reach);
    if (travel < reach || reach >= most_m) return travel;
  }
}

bool MeshSlide::Overlap(const Eigen::Vector3d& offset_m) const {
  const TriangleMesh& mesh = target_.mesh();
  for (int s = 0; s < tool_.size(); ++s) {
    const Triangle corners = CornersOf(tool_, s, offset_m);
    Box box(corners[0]);
    box.extend(corners[1]);
    box.extend(corners[2]);
    bool cut = false;
    target_.Visit(box, [&](int t) {
      cut = TrianglesCut(corners, {mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)});
      return !cut;
    });
    if (cut) return true;
  }
  return target_.Inside(tool_.points.front() + offset_m);
}

}  // namespace feeler::cad
