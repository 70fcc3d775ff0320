#pragma once

#include <cstdint>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/belief/contact_masks.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/bounds/certificates/certificate_table.h"
#include "feeler/planner/bounds/cuboids/box_grid.h"
#include "feeler/planner/bounds/cuboids/box_partition.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// Lower bounds on the cost of localizing every cuboid of hypotheses up to a size, from every displacement of the tool,
/// times the number of hypotheses. Computed by single steps (see StepCosts), smaller cuboids first; a step that splits
/// a cuboid leads to boxes into which the parts are cut, and w(H) V(r,H) >= sum of w(Hi) V(r,Hi) over a partition.
/// Exact for distance as cost where every part is a box again.
///
/// A map that is its own mirror image along an axis needs half of the table. Tables beyond kMostBytes are not built:
/// `largest` is what fits. Immutable; safe to read from many threads.
class CuboidTable {
 public:
  static constexpr std::uint32_t kUnreachable = ~std::uint32_t{0};
  static constexpr std::size_t kMostBytes = std::size_t{1} << 30;
  static constexpr int kLongest = 16;
  /// Boxes of at most so many hypotheses are bounded by their certificates too, which look beyond the box.
  static constexpr int kSmallBox = 8;

  /// Cuboids of up to `largest` hypotheses per axis (at most 16 count). `masks` are of `map`. The values do not depend
  /// on the number of threads. Unusable after a cancellation.
  /// `certificates` are of `map`, the goal and costs at most these; they bound what is left in small boxes. From the
  /// store, or made and kept there; its key stands for all of these.
  CuboidTable(const ContactMap& map, const ContactMasks& masks, const CertificateTable& certificates,
              const StepCosts& costs, const Cell& spread, const Cell& largest, Parallelism jobs,
              const CancellationToken* cancellation = nullptr, const ArrayStore* store = nullptr);

  const Cell& largest() const { return largest_; }
  double unit() const { return unit_; }
  /// A belief of this size is a goal: its value is zero, and no table is kept.
  bool Goal(const Cell& size) const { return ((size - Cell::Ones()).array() <= spread_.array()).all(); }
  /// In table units, times the number of hypotheses; `displacement` from the least hypothesis of the cuboid.
  std::uint32_t At(const Cell& displacement, const Cell& size, int orientation) const;
  std::size_t bytes() const;

 private:
  struct Plane : BoxGrid::Shape {
    SharedArray<std::uint32_t> values;
  };
  struct Scratch;
  struct Source {
    const ContactMasks& masks;
    const CertificateTable& certificates;
  };

  std::size_t PlaneIndex(const Cell& size, int orientation) const {
    const Cell c = size - Cell::Ones();
    return static_cast<std::size_t>(((orientation * largest_.z() + c.z()) * largest_.y() + c.y()) * largest_.x() +
                                    c.x());
  }
  void FitIntoMemory(int orientations);
  void FillFlags(const ContactMap& map);
  void Fill(const Source& source, const Cell& size, int orientation, Scratch& scratch);
  /// All planes from smaller to larger cuboids; false after a cancellation.
  bool FillAll(const ContactMap& map, const Source& source, Parallelism jobs, const CancellationToken* cancellation);
  /// Values where one step splits the cuboid; completes the flags (kBlockedSteps: nothing leads on from here).
  void SplittingSteps(const Source& source, const Cell& size, int orientation, const Plane& plane,
                      std::vector<std::uint32_t>& values, Scratch& scratch) const;
  /// Steps that show nothing, until nothing changes: values are settled by a few sweeps to and fro.
  static void SilentSteps(std::uint32_t step_cost, const Cell& stored, const std::vector<std::uint8_t>& flags,
                          std::vector<std::uint32_t>& values);
  /// The best bound of a set of hypotheses (`layers`, emptied) over the partitions of it.
  std::uint64_t BestPartition(const Source& source, const std::vector<Bits256>& layers, const Cell& displacement,
                              int orientation, Scratch& scratch) const;
  /// Of the members of a box of the set, in table units.
  std::uint64_t Certificates(const Source& source, const std::vector<Bits256>& layers, const HypothesisBox& box,
                             const Cell& displacement, int orientation) const;

  BoxGrid grid_;
  Cell spread_;
  Cell largest_;
  double unit_ = 1.0;
  std::uint32_t free_units_ = 1;
  std::uint32_t contact_units_ = 0;
  std::vector<std::vector<std::uint8_t>> flags_;  ///< per orientation and active displacement, see StepFlags
  std::vector<Plane> planes_;
};

}  // namespace feeler::planner
