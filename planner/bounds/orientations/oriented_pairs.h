#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/arrays/shared_pool.h"
#include "feeler/planner/bounds/orientations/oriented_certificates.h"
#include "feeler/planner/contact/step_flags_grid.h"

namespace feeler::planner {

/// For two hypotheses, (h, o) and (h + offset, other): the least cost of a walk, as the tool fares under the first,
/// that tells them apart; in the bytes of OrientedCertificates. A table per pair, built when first asked for and kept
/// for others until all kept together exceed kMostBytes; who holds one holds it for good. With a pool each is made once
/// a host, as long as the pool has room. Safe to use from many threads.
class OrientedPairs {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{1} << 29;

  struct Plane {
    OrientedBox box;
    SharedArray<std::uint8_t> values;
  };

  /// `pool`: that of the tables with these flags and costs; null: none.
  OrientedPairs(std::shared_ptr<const StepFlagsGrid> flags, const StepCosts& costs,
                std::shared_ptr<SharedPool> pool = nullptr);

  /// Cost in problem units of a unit of the tables.
  double unit() const { return unit_; }
  std::shared_ptr<const Plane> Get(const Cell& offset, int orientation, int other) const;
  /// Of the tables that are kept now.
  std::size_t bytes() const;

 private:
  Plane Make(const Cell& offset, int orientation, int other) const;
  std::vector<std::uint8_t> Build(const OrientedBox& box, const Cell& offset, int orientation, int other) const;

  std::shared_ptr<const StepFlagsGrid> flags_;
  double unit_;
  std::uint8_t contact_units_ = 0;
  std::shared_ptr<SharedPool> pool_;
  mutable std::mutex mutex_;
  mutable std::map<std::array<int, 5>, std::shared_ptr<const Plane>> planes_;
  mutable std::size_t bytes_ = 0;  ///< of planes_
};

}  // namespace feeler::planner
