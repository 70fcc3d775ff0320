#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/core/lattice_grid.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/bounds/certificates/pair_certificates.h"
#include "feeler/planner/bounds/orientations/oriented_heuristic.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// Lower bounds on the cost of localizing a line: `length` hypotheses in consecutive cells along an axis, for every
/// displacement of the tool from the first of them. Tabled times the length. Computed by single steps (see StepCosts);
/// a step that splits the line leads to the runs of the parts. Lines of 2..16.
class LineTable {
 public:
  static constexpr int kLongest = 16;
  static constexpr std::uint16_t kUnreachable = 0xFFFF;

  /// Lines along axis i of up to `longest[i]` hypotheses (longer ones are cut; 1: none), for the orientations listed.
  /// From the store, or made and kept there; its key stands for all of these.
  LineTable(const ContactMap& map, const StepCosts& costs, const Cell& spread, const Cell& longest,
            const std::vector<int>& orientations, const ArrayStore* store = nullptr);

  double unit() const { return unit_; }
  /// In table units, times the length; `displacement` from the first (least) hypothesis of the line.
  std::uint16_t At(const Cell& displacement, int axis, int length, int orientation) const {
    const Grid& grid = grids_[static_cast<std::size_t>(axis)];
    if (length < 2 || place_[static_cast<std::size_t>(orientation)] < 0) return 0;
    return grid
        .values[static_cast<std::size_t>(place_[static_cast<std::size_t>(orientation)] * (grid.longest + 1) + length) *
                    grid.cells +
                grid.Index(displacement)];
  }
  std::size_t bytes() const {
    std::size_t bytes = 0;
    for (const Grid& grid : grids_) bytes += grid.values.bytes();
    return bytes;
  }
  int longest(int axis) const { return grids_[static_cast<std::size_t>(axis)].longest; }

 private:
  struct Grid {
    CellBox domain;
    Cell size = Cell::Zero();
    std::size_t cells = 0;
    int longest = 1;
    SharedArray<std::uint16_t> values;
    std::size_t Index(const Cell& displacement) const {
      return GridIndex(size, domain.Clamp(displacement) - domain.min);
    }
  };
  /// Of one hypothesis' step, in units of the table.
  struct StepUnits {
    std::uint32_t free;
    std::uint32_t contact;
  };
  struct LineBits;
  void Fill(const ContactMap& map, int axis, int orientation, int spread, const StepUnits& units,
            std::vector<std::uint16_t>& values) const;
  static LineBits BitsOf(const ContactMap& map, const Grid& grid, int axis, int orientation);
  /// The sum over the runs of a part of the line (`bits`) that is met at cell `at`.
  static std::uint32_t RunsValue(const Grid& grid, const std::uint16_t* planes, std::int64_t along, std::uint32_t bits,
                                 std::size_t at);
  /// Lowers `cost` where one step splits a line of this length, and lists these places.
  static void SplittingSteps(const Grid& grid, const LineBits& bits, int axis, int length, const StepUnits& units,
                             const std::uint16_t* planes, std::vector<std::uint32_t>& cost,
                             std::vector<std::pair<std::uint32_t, std::uint32_t>>& seeds);

  double unit_ = 1.0;
  std::vector<int> place_;  ///< of an orientation among those tabled; -1: none
  std::array<Grid, 3> grids_;
};

/// The medium heuristic, of the paper setting: a belief is partitioned into maximal runs along an axis, and w(H) V(r,H)
/// >= sum over the parts of w(Hi) V(r,Hi), because a policy that localizes H localizes every part of it. The best of
/// the three axes; hypotheses alone along all of them are bounded by IsolatedHypotheses (with orientations: by the pair
/// with the hypothesis that is nearest in cells and angles). Needs a uniform prior (else zero).
class LineHeuristic final : public BeliefHeuristic {
 public:
  LineHeuristic(const HypothesisSets& sets, std::shared_ptr<const LineTable> table,
                std::shared_ptr<const PairCertificates> pairs);
  /// `oriented_pairs` in place of the pairs of one orientation.
  LineHeuristic(const Problem& problem, const HypothesisSets& sets, std::shared_ptr<const LineTable> table,
                std::shared_ptr<const OrientedPairs> oriented_pairs);
  double Weighted(SetId set, const Cell& robot) override;
  std::size_t bytes() const override {
    return runs_of_.capacity() * sizeof(Runs) + runs_.capacity() * sizeof(Run) +
           (isolated_ ? isolated_->bytes() : oriented_isolated_->bytes());
  }

 private:
  struct Run {
    Cell first = Cell::Zero();
    int length = 1;
    int orientation = 0;
  };
  struct Runs {
    std::array<std::uint32_t, 4> first{};  ///< per axis; [3] is the end
    bool ready = false;
  };
  const Runs& Prepare(SetId set);

  const HypothesisSets& sets_;
  std::shared_ptr<const LineTable> table_;
  std::optional<IsolatedHypotheses> isolated_;
  std::unique_ptr<OrientedHeuristic> oriented_isolated_;
  std::vector<Runs> runs_of_;
  std::vector<Run> runs_;
};

}  // namespace feeler::planner
