#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// The value of a plan from each state of a class: take the action, then go on with a vector of the next class.
struct AlphaVector {
  std::uint32_t action = 0;
  std::vector<double> values;       ///< by position in the class
  std::vector<std::uint32_t> next;  ///< by outcome of the action: the vector (in the outcome's class) that goes on
  std::uint32_t born = ~std::uint32_t{0};  ///< visited belief that it was made at; none for blind policies
};

/// Alpha vectors of a class. Numbers stay valid: a vector that is dropped is no longer looked at, and still there for
/// the plans that go on with it.
class AlphaStore {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  /// How far a belief has looked.
  struct Cursor {
    std::uint32_t epoch = 0;
    std::uint32_t seen = 0;
    std::uint32_t best = kNone;
  };

  /// Returns its number. Vectors that the new one dominates everywhere are dropped.
  std::uint32_t Add(AlphaVector vector);
  /// Vectors that are new.
  std::size_t Unseen(const Cursor& cursor) const { return active_.size() - (cursor.epoch == epoch_ ? cursor.seen : 0); }
  /// Looks at what is new; returns the value of the best vector met, -infinity if nothing is new.
  double Advance(std::span<const SparseEntry> belief, Cursor& cursor) const;
  const AlphaVector& operator[](std::uint32_t number) const { return vectors_[number]; }
  /// The vector of the greatest sum: where nothing is known of the belief.
  std::uint32_t fallback() const { return fallback_; }
  const std::vector<std::uint32_t>& active() const { return active_; }
  bool dropped(std::uint32_t number) const { return dropped_[number] != 0; }
  /// True when there are so many more than after the last Keep that pruning pays.
  bool Crowded() const { return active_.size() > 2 * kept_ + 100; }
  /// Drops all but those marked.
  void Keep(const std::vector<std::uint8_t>& marked);
  std::size_t size() const { return vectors_.size(); }
  std::size_t bytes() const { return bytes_; }

 private:
  std::vector<AlphaVector> vectors_;
  std::vector<std::uint8_t> dropped_;
  std::vector<std::uint32_t> active_;
  std::uint32_t epoch_ = 0;
  std::uint32_t fallback_ = kNone;
  double fallback_sum_ = -std::numeric_limits<double>::infinity();
  std::size_t kept_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace feeler::planner
