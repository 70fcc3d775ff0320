#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {

/// Upper bound of V* on the beliefs of a class: the fast informed bound, and the sawtooth interpolation (Hauskrecht
/// 2000) between the corners and the beliefs whose bound is known better.
class Sawtooth {
 public:
  struct Cursor {
    std::uint32_t epoch = ~std::uint32_t{0};
    std::uint32_t seen = 0;
    double at_corners = 0.0;  ///< the bound by interpolation between corners
  };

  /// `rows`: vectors over the states of the class whose maximum is an upper bound.
  explicit Sawtooth(std::vector<std::vector<double>> rows);

  /// Points that are new.
  std::size_t Unseen(const Cursor& cursor) const { return points_.size() - (cursor.epoch == epoch_ ? cursor.seen : 0); }
  /// The least bound met in what is new; infinity if nothing is. `dense` is the belief as a vector over the class. Work
  /// stops as soon as a point cannot beat `known`.
  double Advance(std::span<const SparseEntry> belief, const double* dense, double known, Cursor& cursor) const;
  /// A bound at a belief. `owner` names the belief: a later bound of the same owner replaces the earlier one. A bound
  /// at a corner is kept until the next Rebase, and then holds for interpolation too.
  void Add(std::uint32_t owner, std::span<const SparseEntry> belief, double upper);

  bool Crowded() const { return points_.size() > 2 * kept_ + 100; }
  /// Takes the corners into account, and drops points that the others imply. `dense` is scratch of the size of the
  /// class, zero before and after. Interrupted, the store is of no use any more.
  void Rebase(std::vector<double>& dense, Pulse& pulse);
  std::size_t size() const { return points_.size(); }
  std::size_t bytes() const { return bytes_; }

 private:
  struct Entry {
    std::uint32_t index = 0;
    double inverse = 0.0;  ///< 1 / probability
  };
  struct Point {
    std::vector<Entry> entries;  ///< by descending probability
    double upper = 0.0;
    double gain = 0.0;  ///< below interpolation between the corners; negative
    std::uint32_t owner = 0;
    bool dropped = false;
  };
  double AtCorners(const Point& point) const;

  std::vector<std::vector<double>> rows_;
  std::vector<double> corners_, better_corners_;
  std::vector<Point> points_;
  std::vector<std::uint32_t> point_of_;  ///< by owner, where it has one; grows
  std::uint32_t epoch_ = 0;
  std::size_t kept_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace feeler::planner
