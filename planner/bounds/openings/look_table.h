#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/belief/bits256.h"
#include "feeler/planner/belief/contact_masks.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/bounds/cuboids/box_grid.h"
#include "feeler/planner/bounds/openings/openings.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// Lower bounds for maps with dead ends (openings), proven in docs/planner.md, "The open socket": for every rectangle
/// of hypotheses of one height up to a size, every displacement of the tool and every number k, the least that it costs
/// to localize any set that lacks k members of the rectangle, times the number of those that are left. Steps are those
/// of the filled map; to look into an opening takes one hypothesis away, and the tool has to move on before the next
/// look. As a function of k each entry is convex and falls.
///
/// A map that is its own mirror image along x or y needs half of the table. Immutable; safe to read from many threads.
class LookTable {
 public:
  static constexpr int kLongest = 16;
  /// Who has looked into so many openings of a rectangle pays nothing from then on.
  static constexpr int kMostLooks = 64;
  static constexpr std::size_t kMostBytes = std::size_t{1} << 30;

  /// What a table is of. `masks` and `openings` are of `filled`, which is FillDeadEnds of the map; one orientation.
  struct Source {
    const ContactMap& filled;
    const ContactMasks& masks;
    const Openings& openings;
  };

  /// Rectangles of up to `largest` hypotheses along x and y (at most 16 count, and what fits into kMostBytes). A goal
  /// leaves hypotheses at most `spread` apart. The values do not depend on the number of threads; `progress` counts
  /// hundredths. Unusable after a cancellation. From the store, or made and kept there; its key stands for all
  /// of these.
  LookTable(const Source& source, const StepCosts& costs, const Cell& spread, const Cell& largest, Parallelism jobs,
            const ProgressCallback& progress = {}, const CancellationToken* cancellation = nullptr,
            const ArrayStore* store = nullptr);

  const Cell& largest() const { return largest_; }
  /// For a set that lacks `gone` members of a rectangle of this size (at most `largest`), times the members left;
  /// `displacement` from the least hypothesis of the rectangle. The tool must not be inside the (filled) target of a
  /// member that is left.
  double At(const Cell& displacement, const Cell& size, int gone) const;
  /// False where the tool is above the filled target of every member.
  bool MayBeInside(const Cell& displacement) const { return displacement.z() <= highest_; }
  std::size_t bytes() const;

 private:
  struct Plane : BoxGrid::Shape {
    int most = 0;       ///< entries of a cell, by the number gone; with more gone nothing is left to pay
    double unit = 1.0;  ///< cost that a value counts in
    SharedArray<std::uint16_t> values;
  };
  class Filler;

  std::size_t PlaneIndex(const Cell& size) const {
    return static_cast<std::size_t>((size.y() - 1) * largest_.x() + size.x() - 1);
  }
  Plane PlaneOf(const Cell& size) const;
  void FitIntoMemory();
  /// All planes from smaller to larger rectangles; false after a cancellation.
  bool FillAll(const Source& source, Parallelism jobs, const ProgressCallback& progress,
               const CancellationToken* cancellation);

  BoxGrid grid_;
  int highest_ = 0;  ///< greatest z of a displacement inside the filled target
  Cell spread_;
  Cell largest_;
  StepCosts costs_;
  std::vector<Plane> planes_;
};

}  // namespace feeler::planner
