#include "feeler/cad/readers/ears.h"

namespace feeler::cad {
namespace {

class Ears {
 public:
  Ears(const std::vector<Eigen::Vector3d>& points, const std::vector<int>& face) : points_(points), left_(face) {
    // Newell's normal: that of a polygon that is not convex, too.
    for (std::size_t i = 0; i < face.size(); ++i) normal_ += At(i).cross(At((i + 1) % face.size()));
  }

  std::vector<std::array<int, 3>> Run() {
    std::vector<std::array<int, 3>> triangles;
    while (left_.size() > 3) {
      std::size_t ear = 1;
      while (ear <= left_.size() && !IsEar(ear % left_.size())) ++ear;
      if (ear > left_.size()) ear = 1;
      ear %= left_.size();
      triangles.push_back({left_[Before(ear)], left_[ear], left_[After(ear)]});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back({left_[0], left_[1], left_[2]});
    return triangles;
  }

 private:
  const Eigen::Vector3d& At(std::size_t i) const { return points_[static_cast<std::size_t>(left_[i])]; }
  std::size_t Before(std::size_t i) const { return (i + left_.size() - 1) % left_.size(); }
  std::size_t After(std::size_t i) const { return (i + 1) % left_.size(); }
  double Side(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& p) const {
    return normal_.dot((b - a).cross(p - a));
  }

  bool IsEar(std::size_t i) const {
    const Eigen::Vector3d& a = At(Before(i));
    const Eigen::Vector3d& b = At(i);
    const Eigen::Vector3d& c = At(After(i));
    if (Side(a, b, c) <= 0) return false;
    for (std::size_t k = 0; k < left_.size(); ++k) {
      if (k == i || k == Before(i) || k == After(i)) continue;
      const Eigen::Vector3d& p = At(k);
      if (Side(a, b, p) >= 0 && Side(b, c, p) >= 0 && Side(c, a, p) >= 0) return false;
    }
    return true;
  }

  const std::vector<Eigen::Vector3d>& points_;
  std::vector<int> left_;
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
};

}  // namespace

std::vector<std::array<int, 3>> CutEars(const std::vector<Eigen::Vector3d>& points, const std::vector<int>& face) {
  return Ears(points, face).Run();
}

}  // namespace feeler::cad
