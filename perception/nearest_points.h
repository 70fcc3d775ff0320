#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "feeler/perception/point_cloud.h"

namespace feeler::perception {

/// A k-d tree over points (nanoflann). Immutable; many threads may ask at once.
class NearestPoints {
 public:
  explicit NearestPoints(Points points);
  ~NearestPoints();
  NearestPoints(NearestPoints&&) noexcept;
  NearestPoints& operator=(NearestPoints&&) noexcept;

  struct Hit {
    std::size_t index = 0;
    double squared_m2 = 0.0;
  };
  /// The nearest of the points; there must be one.
  Hit Nearest(const Eigen::Vector3d& point) const;
  /// How many points lie closer than `radius_m`.
  std::size_t CountWithin(const Eigen::Vector3d& point, double radius_m) const;

  const Points& points() const;

 private:
  class Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace feeler::perception
