#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "feeler/cad/section/section.h"

namespace feeler::cad {

/// The convex hull of the corners of two lines, in the middle of their slabs, counterclockwise.
SlabLoop HullAround(const SlabLoop& a, const SlabLoop& b);

/// Widest outlines and narrowest holes of the slabs that were added.
class Envelope {
 public:
  /// `slack_m`: lines that are off by no more lie in each other. `with_ends`: the ends of the slabs are cross-sections,
  /// too, not their middles alone.
  Envelope(double slack_m, bool with_ends) : slack_m_(slack_m), with_ends_(with_ends) {}

  /// False, and as it was, where material of the slab would stand in a hole, or a hole would be lost.
  bool Add(const Slab& slab);
  /// Widens the outlines to points of the solid that lie beyond all of them by more than `allowed_m` says.
  void Cover(const std::vector<Eigen::Vector3d>& points,
             const std::function<double(const Eigen::Vector3d&)>& allowed_m);
  /// Outlines, then holes.
  std::vector<SlabLoop> loops() const;

 private:
  bool AddSection(const Slab& slab, Eigen::Vector2d SlabPoint::*height);
  bool Widen(const std::vector<SlabLoop>& outlines);
  bool Narrow(const std::vector<SlabLoop>& outlines, const std::vector<SlabLoop>& holes);
  std::optional<SlabLoop> Trimmed(const SlabLoop& hole, const std::vector<SlabLoop>& lines) const;
  bool IsAir(const SlabLoop& hole, const std::vector<SlabLoop>& section) const;

  double slack_m_;
  bool with_ends_;
  std::vector<SlabLoop> outlines_;
  std::vector<SlabLoop> holes_;
};

}  // namespace feeler::cad
