#include "feeler/perception/nearest_points.h"

#include <nanoflann.hpp>
#include <utility>

namespace feeler::perception {
namespace {

/// The points as nanoflann wants to see them.
struct Adaptor {
  Points points;

  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return points[index][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

/// Counts what lies within a radius, without a list of it.
class Counter {
 public:
  using DistanceType = double;
  explicit Counter(double squared_m2) : squared_m2_(squared_m2) {}
  std::size_t size() const { return count_; }
  bool full() const { return true; }
  bool addPoint(double /*squared*/, std::size_t /*index*/) {
    ++count_;
    return true;
  }
  double worstDist() const { return squared_m2_; }

 private:
  double squared_m2_;
  std::size_t count_ = 0;
};

}  // namespace

class NearestPoints::Tree {
 public:
  explicit Tree(Points points)
      : adaptor{std::move(points)}, index(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {
    index.buildIndex();
  }

  Adaptor adaptor;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3> index;
};

NearestPoints::NearestPoints(Points points) : tree_(std::make_unique<Tree>(std::move(points))) {}
NearestPoints::~NearestPoints() = default;
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;

NearestPoints::Hit NearestPoints::Nearest(const Eigen::Vector3d& point) const {
  Hit hit;
  nanoflann::KNNResultSet<double, std::size_t> result(1);
  result.init(&hit.index, &hit.squared_m2);
  tree_->index.findNeighbors(result, point.data(), nanoflann::SearchParams());
  return hit;
}

std::size_t NearestPoints::CountWithin(const Eigen::Vector3d& point, double radius_m) const {
  Counter counter(radius_m * radius_m);
  tree_->index.findNeighbors(counter, point.data(), nanoflann::SearchParams());
  return counter.size();
}

const Points& NearestPoints::points() const { return tree_->adaptor.points; }

}  // namespace feeler::perception
