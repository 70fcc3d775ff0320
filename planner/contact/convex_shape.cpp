#include "feeler/planner/contact/convex_shape.h"

#include <cmath>

namespace feeler::planner {
namespace {

/// From so many corners on a table is faster than a walk over all.
constexpr std::size_t kMany = 24;

}  // namespace

ConvexShape::ConvexShape(const ConvexPiece& piece)
    : kind_(piece.kind), size_m_(piece.size_m), pose_(piece.frame_T_piece) {
  if (kind_ == ShapeKind::kPolytope) {
    hull_m_.reserve(piece.vertices_m.size());
    for (const Eigen::Vector3d& vertex : piece.vertices_m) hull_m_.emplace_back(pose_ * vertex);
  }
  if (kind_ == ShapeKind::kBox) {
    const Eigen::Matrix3d magnitude = pose_.linear().cwiseAbs();
    is_aligned_box_ = (magnitude.rowwise().maxCoeff().array() > 1 - 1e-14).all();
  }
}

void ConvexShape::PrepareForMany() {
  if (!table_ && hull_m_.size() >= kMany) table_ = std::make_shared<const SupportTable>(hull_m_);
}

Eigen::Vector3d ConvexShape::LocalSupport(const Eigen::Vector3d& d) const {
  const double radial = std::hypot(d.x(), d.y());
  const double side = d.z() < 0 ? -1.0 : 1.0;
  switch (kind_) {
    case ShapeKind::kSphere: return d.normalized() * size_m_[0];
    case ShapeKind::kCapsule: return d.normalized() * size_m_[0] + Eigen::Vector3d(0, 0, side * size_m_[1]);
    case ShapeKind::kCylinder: {
      Eigen::Vector3d point(0, 0, side * size_m_[1]);
      if (radial > 0) point.head<2>() = d.head<2>() * (size_m_[0] / radial);
      return point;
    }
    case ShapeKind::kEllipsoid: {
      const Eigen::Vector3d scaled = d.cwiseProduct(size_m_);
      return scaled.cwiseProduct(size_m_) / scaled.norm();
    }
    default: return {d.x() < 0 ? -size_m_[0] : size_m_[0], d.y() < 0 ? -size_m_[1] : size_m_[1], side * size_m_[2]};
  }
}

Eigen::Vector3d ConvexShape::Support(const Eigen::Vector3d& direction) const {
  if (kind_ != ShapeKind::kPolytope) return pose_ * LocalSupport(pose_.linear().transpose() * direction);
  if (table_) return table_->Farthest(direction);
  const Eigen::Vector3d* best = &hull_m_.front();
  double farthest = direction.dot(*best);
  for (const Eigen::Vector3d& vertex : hull_m_) {
    const double distance = direction.dot(vertex);
    if (distance > farthest) {
      farthest = distance;
      best = &vertex;
    }
  }
  return *best;
}

}  // namespace feeler::planner
