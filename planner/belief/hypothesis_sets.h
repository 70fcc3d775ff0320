#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/belief/bits256.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

using SetId = std::uint32_t;

/// The members of a set that lie in one layer: a window of 16 x 16 offsets at one height, tile and orientation.
struct Slab {
  std::uint32_t layer = 0;
  Bits256 bits;
  bool operator==(const Slab&) const = default;
};

/// Hash-consed sets of hypotheses: equal sets have equal ids. A set is a sorted list of non-empty slabs.
///
/// Canonical, and where the hypotheses span at most 16 cells along x and y and weigh the same, a set is stored relative
/// to its own least corner (its frame), so that translates of each other are one set; `shiftable()` tells. Otherwise
/// offsets are the problem's and all frames are zero.
class HypothesisSets {
 public:
  struct Info {
    std::uint32_t first_slab = 0;
    std::uint32_t slab_count = 0;
    std::uint32_t size = 0;  ///< number of hypotheses
    bool goal = false;
    double weight = 0.0;      ///< sum; hypotheses of a uniform prior weigh 1 each, else 1 on average
    Cell low = Cell::Zero();  ///< least and greatest offsets, relative to the frame
    Cell high = Cell::Zero();
  };

  /// `canonical`: store sets relative to their frames where that is possible.
  HypothesisSets(const Problem& problem, bool canonical);

  bool shiftable() const { return shiftable_; }
  /// All layers look at the same window of x and y.
  bool single_window() const { return single_window_; }
  /// All hypotheses weigh the same.
  bool uniform() const { return weights_.empty(); }
  /// The start belief's set, and its frame in problem coordinates.
  SetId start() const { return start_; }
  Cell start_frame() const { return start_frame_; }

  const Info& info(SetId set) const { return infos_[set]; }
  std::span<const Slab> slabs(SetId set) const {
    return {slabs_.data() + infos_[set].first_slab, infos_[set].slab_count};
  }
  std::size_t count() const { return infos_.size(); }

  /// Offset of the corner of a layer's window (relative to the frame), and its orientation.
  const Cell& Corner(std::uint32_t layer) const { return corners_[layer]; }
  int Orientation(std::uint32_t layer) const { return orientations_[layer]; }

  /// The id of a non-empty set given by non-empty slabs in increasing order of layers, and by how much its frame is
  /// shifted from the one the slabs are given in. `slabs` is overwritten.
  SetId Intern(std::vector<Slab>& slabs, Cell& shift);

  /// The set of these hypotheses, in problem coordinates; empty unless all are hypotheses of the problem. Not for
  /// shiftable sets.
  std::optional<SetId> Find(const std::vector<Hypothesis>& hypotheses);

  /// Is `part` shifted by `by` a subset of `whole`? Both relative to their frames.
  bool IsSubset(SetId part, SetId whole, const Cell& by) const;

  /// Calls f(offset relative to the frame, orientation, layer, bit) for each member.
  template <class F>
  void ForEach(SetId set, F f) const {
    for (const Slab& slab : slabs(set)) {
      const Cell corner = Corner(slab.layer);
      const int orientation = Orientation(slab.layer);
      slab.bits.ForEach([&](int bit) { f(Cell(corner + Cell(bit & 15, bit >> 4, 0)), orientation, slab.layer, bit); });
    }
  }
  double Weight(std::uint32_t layer, int bit) const {
    return weights_.empty() ? 1.0 : weights_[static_cast<std::size_t>(layer) * 256 + static_cast<std::size_t>(bit)];
  }
  std::size_t bytes() const;

 private:
  void Shift(std::vector<Slab>& slabs, Cell& shift) const;
  Info Describe(const std::vector<Slab>& slabs) const;
  void Grow();

  bool shiftable_ = false;
  bool single_window_ = true;
  int depth_ = 1;  ///< layers per orientation where sets are shiftable
  GoalKind goal_;
  Cell insertable_spread_;
  std::vector<Cell> corners_;
  std::vector<int> orientations_;
  std::vector<double> weights_;  ///< per layer and bit; empty for a uniform prior
  std::vector<Info> infos_;
  std::vector<std::uint64_t> hashes_;
  std::vector<Slab> slabs_;
  std::vector<SetId> table_;  ///< open addressing
  SetId start_ = 0;
  Cell start_frame_ = Cell::Zero();
};

}  // namespace feeler::planner
