#include "feeler/planner/bounds/cuboids/cuboid_table.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "feeler/core/lattice_grid.h"
#include "feeler/core/worker_pool.h"
#include "feeler/planner/bounds/cuboids/box_partition.h"

namespace feeler::planner {
namespace {

/// Flags of a cell that no step leads out of.
constexpr std::uint8_t kBlockedSteps = (1U << kDirectionCount) - 1;

/// out(x) = OR over i < count of in(x - i) along an axis; cells before the first are like the first, beyond the last
/// like the last.
void OrAlong(int axis, int count, const Cell& in_size, const std::vector<std::uint8_t>& in, const Cell& out_size,
             std::vector<std::uint8_t>& out) {
  out.assign(static_cast<std::size_t>(out_size.prod()), 0);
  const int inner = axis == 0 ? 1 : axis == 1 ? out_size.x() : out_size.x() * out_size.y();
  const int outer = axis == 0 ? out_size.y() * out_size.z() : axis == 1 ? out_size.z() : 1;
  for (int o = 0; o < outer; ++o) {
    for (int p = 0; p < out_size[axis]; ++p) {
      std::uint8_t* const to =
          &out[(static_cast<std::size_t>(o) * static_cast<std::size_t>(out_size[axis]) + static_cast<std::size_t>(p)) *
               static_cast<std::size_t>(inner)];
      const int first = std::clamp(p - count + 1, 0, in_size[axis] - 1);
      const int last = std::min(p, in_size[axis] - 1);
      for (int q = first; q <= last; ++q) {
        const std::uint8_t* const from =
            &in[(static_cast<std::size_t>(o) * static_cast<std::size_t>(in_size[axis]) + static_cast<std::size_t>(q)) *
                static_cast<std::size_t>(inner)];
        for (int i = 0; i < inner; ++i) to[i] |= from[i];
      }
    }
  }
}

}  // namespace

struct CuboidTable::Scratch {
  std::vector<std::uint8_t> flags, buffer;
  std::vector<Bits256> hit, missed, layers;
  std::vector<HypothesisBox> boxes;
};

CuboidTable::CuboidTable(const ContactMap& map, const ContactMasks& masks, const CertificateTable& certificates,
                         const StepCosts& costs, const Cell& spread, const Cell& largest, Parallelism jobs,
                         const CancellationToken* cancellation, const ArrayStore* store)
    : grid_(ActiveRegion(map)), spread_(spread), largest_(largest.cwiseMin(kLongest)) {
  const TableUnits units(costs);
  unit_ = units.unit;
  free_units_ = units.free_units;
  contact_units_ = units.contact_units;
  FitIntoMemory(map.orientations());
  planes_.resize(static_cast<std::size_t>(largest_.prod() * map.orientations()));
  std::vector<SharedArray<std::uint32_t>*> all;
  ForEachCell({Cell::Ones(), largest_}, [&](const Cell& size) {
    for (int o = 0; o < map.orientations() && !Goal(size); ++o) {
      Plane& plane = planes_[PlaneIndex(size, o)];
      plane = {grid_.ShapeOf(size), {}};
      all.push_back(&plane.values);
    }
  });
  if (store != nullptr && store->Take("cuboids", all)) return;
  FillFlags(map);
  if (FillAll(map, {masks, certificates}, jobs, cancellation) && store != nullptr) store->Keep("cuboids", all);
}

bool CuboidTable::FillAll(const ContactMap& map, const Source& source, Parallelism jobs,
                          const CancellationToken* cancellation) {
  // A cuboid is cut into smaller ones: their extents have a smaller sum. Those of equal sum are independent.
  std::vector<Scratch> scratch(static_cast<std::size_t>(jobs.threads()));
  for (int sum = 4; sum <= largest_.sum(); ++sum) {
    std::vector<std::pair<Cell, int>> level;
    ForEachCell({Cell::Ones(), largest_}, [&](const Cell& size) {
      if (size.sum() != sum || Goal(size)) return;
      for (int o = 0; o < map.orientations(); ++o) level.emplace_back(size, o);
    });
    std::atomic<std::size_t> next = 0;
    RunWorkers(
        level.size(), jobs,
        [&] {
          return [&, &mine = scratch[next++]](std::size_t i) { Fill(source, level[i].first, level[i].second, mine); };
        },
        cancellation);
    if (cancellation != nullptr && cancellation->cancelled()) return false;
  }
  return true;
}

void CuboidTable::FillFlags(const ContactMap& map) {
  for (int o = 0; o < map.orientations(); ++o) {
    std::vector<std::uint8_t>& flags = flags_.emplace_back();
    ForEachCell(grid_.active, [&](const Cell& here) { flags.push_back(StepFlags(map, here, o)); });
  }
}

void CuboidTable::FitIntoMemory(int orientations) {
  while (true) {
    std::size_t bytes = 0;
    ForEachCell({Cell::Ones(), largest_}, [&](const Cell& size) {
      if (Goal(size)) return;
      bytes += grid_.ShapeOf(size).Cells() * sizeof(std::uint32_t) * static_cast<std::size_t>(orientations);
    });
    if (bytes <= kMostBytes || largest_.maxCoeff() <= 1) return;
    largest_ = largest_.cwiseMin(largest_.maxCoeff() - 1);
  }
}

std::uint32_t CuboidTable::At(const Cell& displacement, const Cell& size, int orientation) const {
  if (Goal(size)) return 0;
  const Plane& plane = planes_[PlaneIndex(size, orientation)];
  const BoxGrid::Place place = grid_.PlaceOf(plane, displacement);
  const std::uint32_t value = plane.values[place.index];
  if (value == kUnreachable) return value;
  return value + static_cast<std::uint32_t>(place.beyond * size.prod()) * free_units_;
}

std::uint64_t CuboidTable::Certificates(const Source& source, const std::vector<Bits256>& layers,
                                        const HypothesisBox& box, const Cell& displacement, int orientation) const {
  const auto holds = [&](const Cell& h) {
    return (h.array() >= 0).all() && h.x() < kLongest && h.y() < kLongest && h.z() < static_cast<int>(layers.size()) &&
           layers[static_cast<std::size_t>(h.z())].Test(h.x() + kLongest * h.y());
  };
  double sum = 0.0;
  bool apart = true;
  ForEachCell({box.low, box.low + box.size - Cell::Ones()}, [&](const Cell& h) {
    int mask = 0;
    for (std::size_t i = 0; i < source.certificates.neighbours().size(); ++i) {
      if (holds(h + source.certificates.neighbours()[i])) mask |= 1 << i;
    }
    const std::uint16_t value = source.certificates.At(displacement - h, mask, orientation);
    apart = apart && value != kNoCertificate;
    sum += value;
  });
  if (!apart) return kUnreachable;
  return static_cast<std::uint64_t>(sum * (source.certificates.grid().unit / unit_));
}

std::uint64_t CuboidTable::BestPartition(const Source& source, const std::vector<Bits256>& layers,
                                         const Cell& displacement, int orientation, Scratch& scratch) const {
  std::uint64_t best = 0;
  for (const AxisOrder& order : kAxisOrders) {
    scratch.layers = layers;
    PartitionIntoBoxes(scratch.layers, order, largest_, scratch.boxes);
    std::uint64_t sum = 0;
    for (const HypothesisBox& box : scratch.boxes) {
      std::uint64_t value = At(displacement - box.low, box.size, orientation);
      if (value != kUnreachable && box.size.prod() <= kSmallBox) {
        value = std::max(value, Certificates(source, layers, box, displacement, orientation));
      }
      if (value == kUnreachable) return kUnreachable;
      sum += value;
    }
    best = std::max(best, sum);
    if (scratch.boxes.size() == 1) break;
  }
  return std::min<std::uint64_t>(best, kUnreachable - 1);
}

void CuboidTable::Fill(const Source& source, const Cell& size, int orientation, Scratch& scratch) {
  Plane& plane = planes_[PlaneIndex(size, orientation)];
  const Cell& stored = plane.stored;
  // The OR over the cuboid of the flags of its hypotheses.
  Cell shape = grid_.active.Size();
  scratch.flags = flags_[static_cast<std::size_t>(orientation)];
  for (int axis = 0; axis < 3; ++axis) {
    const Cell before = shape;
    shape[axis] = stored[axis];
    OrAlong(axis, size[axis], before, scratch.flags, shape, scratch.buffer);
    scratch.flags.swap(scratch.buffer);
  }
  std::vector<std::uint32_t> values(plane.Cells(), kUnreachable);
  SplittingSteps(source, size, orientation, plane, values, scratch);
  SilentSteps(static_cast<std::uint32_t>(size.prod()) * free_units_, stored, scratch.flags, values);
  plane.values = std::move(values);
}

void CuboidTable::SplittingSteps(const Source& source, const Cell& size, int orientation, const Plane& plane,
                                 std::vector<std::uint32_t>& values, Scratch& scratch) const {
  const ContactMasks& masks = source.masks;
  const Cell& stored = plane.stored;
  const auto whole = static_cast<std::uint32_t>(size.prod());
  const Bits256 window = Rectangle(0, 0, size.x(), size.y());
  const auto depth = static_cast<std::size_t>(size.z());
  scratch.hit.resize(depth);
  scratch.missed.resize(depth);
  std::size_t at = 0;
  ForEachCell({Cell::Zero(), stored - Cell::Ones()}, [&](const Cell& cell) {
    const std::size_t here = at++;
    std::uint8_t& flags = scratch.flags[here];
    if ((flags & kOutOfReach) != 0) {
      flags = kBlockedSteps;
      return;
    }
    const Cell displacement = grid_.active.min + cell;
    std::uint32_t& best = values[here];
    for (const Direction d : kDirections) {
      const unsigned bit = 1U << IndexOf(d);
      const int next = cell[AxisOf(d)] + SignOf(d);
      if ((flags & bit) == 0) {
        // A step out of what is stored changes nothing: outside all repeats, or is the mirror image of the inside.
        if (next < 0 || next >= stored[AxisOf(d)]) flags |= static_cast<std::uint8_t>(bit);
        continue;
      }
      std::uint32_t hits = 0;
      for (std::size_t z = 0; z < depth; ++z) {
        scratch.hit[z] =
            masks.Mask(masks.Index(displacement - Cell(0, 0, static_cast<int>(z)), d, orientation)) & window;
        hits += static_cast<std::uint32_t>(scratch.hit[z].Count());
        scratch.missed[z] = window.Without(scratch.hit[z]);
      }
      if (hits == 0 || hits == whole) continue;
      const bool stays = next < 0 || next >= plane.whole[AxisOf(d)];
      const std::uint64_t after_hit = BestPartition(source, scratch.hit, displacement, orientation, scratch);
      if (after_hit == kUnreachable) continue;
      const std::uint64_t after_miss = BestPartition(
          source, scratch.missed, stays ? displacement : Cell(displacement + UnitCell(d)), orientation, scratch);
      if (after_miss == kUnreachable) continue;
      const std::uint64_t value =
          after_hit + after_miss + std::uint64_t{hits} * contact_units_ + std::uint64_t{whole - hits} * free_units_;
      best = static_cast<std::uint32_t>(std::min<std::uint64_t>(best, value));
    }
  });
}

void CuboidTable::SilentSteps(std::uint32_t step_cost, const Cell& stored, const std::vector<std::uint8_t>& flags,
                              std::vector<std::uint32_t>& values) {
  const auto strides = GridStrides(stored);
  const auto relax = [&](std::size_t here) {
    if (flags[here] == kBlockedSteps) return false;
    const std::uint32_t before = values[here];
    std::uint32_t best = before;
    for (const Direction d : kDirections) {
      if ((flags[here] >> IndexOf(d) & 1) != 0) continue;
      const std::uint32_t there = values[static_cast<std::size_t>(
          static_cast<std::int64_t>(here) + SignOf(d) * strides[static_cast<std::size_t>(AxisOf(d))])];
      if (there < kUnreachable - step_cost) best = std::min(best, there + step_cost);
    }
    values[here] = best;
    return best < before;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < values.size(); ++i) changed = relax(i) || changed;
    if (!changed) break;
    changed = false;
    for (std::size_t i = values.size(); i-- > 0;) changed = relax(i) || changed;
  }
}

std::size_t CuboidTable::bytes() const {
  std::size_t bytes = 0;
  for (const Plane& plane : planes_) bytes += plane.values.bytes();
  return bytes;
}

}  // namespace feeler::planner
