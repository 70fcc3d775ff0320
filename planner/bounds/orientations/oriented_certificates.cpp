#include "feeler/planner/bounds/orientations/oriented_certificates.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "feeler/core/worker_pool.h"
#include "feeler/planner/belief/hull.h"

namespace feeler::planner {
namespace {

constexpr unsigned kBlockedSteps = (1U << kDirectionCount) - 1;

/// Axis neighbours in position and angle, along the axes in which the hypotheses differ.
std::vector<OrientedNeighbour> NeighboursIn(const Problem& problem, const Cell& spread) {
  const Cell across = HullOf(problem.hypotheses).Size() - Cell::Ones();
  int low_yaw = 1 << 20;
  int high_yaw = 0;
  int low_pitch = 1 << 20;
  int high_pitch = 0;
  for (const Hypothesis& h : problem.hypotheses) {
    low_yaw = std::min(low_yaw, h.orientation / problem.pitches);
    high_yaw = std::max(high_yaw, h.orientation / problem.pitches);
    low_pitch = std::min(low_pitch, h.orientation % problem.pitches);
    high_pitch = std::max(high_pitch, h.orientation % problem.pitches);
  }
  std::vector<OrientedNeighbour> neighbours;
  for (const Direction d : kDirections) {
    const int axis = AxisOf(d);
    if (across[axis] > spread[axis]) neighbours.push_back({(spread[axis] + 1) * UnitCell(d), 0, 0});
  }
  for (const int by : {1, -1}) {
    if (high_yaw > low_yaw) neighbours.push_back({Cell::Zero(), by, 0});
  }
  for (const int by : {1, -1}) {
    if (high_pitch > low_pitch) neighbours.push_back({Cell::Zero(), 0, by});
  }
  if (neighbours.size() > OrientedCertificates::kMostNeighbours)
    neighbours.resize(OrientedCertificates::kMostNeighbours);
  return neighbours;
}

/// One orientation in work: a row of `lanes` bytes per cell, the lane of a subset of the neighbours at its bits.
class LaneSweeper {
 public:
  LaneSweeper(const OrientedBox& box, int bits, std::uint8_t contact_units)
      : box_(box), lanes_(std::size_t{1} << bits), contact_units_(contact_units), strides_(box.strides()) {
    flags_.resize(box.cells);
    tells_.resize(box.cells);
    values_.assign(box.cells * lanes_, OrientedCertificates::kNone);
    without_.resize(lanes_ * lanes_);
    for (std::size_t told = 0; told < lanes_; ++told) {
      for (std::size_t m = 0; m < lanes_; ++m) without_[told * lanes_ + m] = static_cast<std::uint8_t>(m & ~told);
    }
    for (std::size_t cell = 0; cell < box.cells; ++cell) values_[cell * lanes_] = 0;
  }

  /// `tells(here, d)`: which neighbours a step from `here` shows to be wrong.
  template <class Flags, class Tells>
  void Prepare(Flags flags, Tells tells) {
    std::size_t cell = 0;
    for (int z = 0; z < box_.size.z(); ++z) {
      for (int y = 0; y < box_.size.y(); ++y) {
        for (int x = 0; x < box_.size.x(); ++x, ++cell) {
          const Cell here = box_.domain.min + Cell(x, y, z);
          flags_[cell] = flags(here);
          if (flags_[cell] == kOutOfReach) continue;
          std::array<std::uint8_t, kDirectionCount> told = tells(here, flags_[cell]);
          if (std::ranges::any_of(told, [](std::uint8_t t) { return t != 0; })) {
            tells_[cell] = static_cast<std::uint32_t>(told_.size() + 1);
            told_.push_back(told);
          }
        }
      }
    }
  }

  /// Bellman updates, row after row and back, until nothing changes. A row is looked at again when a neighbour changed.
  void Run() {
    const auto rows = static_cast<std::size_t>(box_.size.y()) * static_cast<std::size_t>(box_.size.z());
    std::vector<char> pending(rows, 1);
    for (bool backward = false, any = true; any; backward = !backward) {
      any = false;
      for (std::size_t k = 0; k < rows; ++k) {
        const std::size_t row = backward ? rows - 1 - k : k;
        if (pending[row] == 0) continue;
        pending[row] = 0;
        any = true;
        const int y = static_cast<int>(row) % box_.size.y();
        const int z = static_cast<int>(row) / box_.size.y();
        // Along the row both ways at once: what goes against the order would take a visit a cell.
        const bool forward_changed = SweepRow(y, z, false);
        const bool backward_changed = SweepRow(y, z, true);
        if (!forward_changed && !backward_changed) continue;
        if (backward_changed) pending[row] = 1;
        if (y > 0) pending[row - 1] = 1;
        if (y + 1 < box_.size.y()) pending[row + 1] = 1;
        if (z > 0) pending[row - static_cast<std::size_t>(box_.size.y())] = 1;
        if (z + 1 < box_.size.z()) pending[row + static_cast<std::size_t>(box_.size.y())] = 1;
      }
    }
    CutUnreached();
  }

  std::uint8_t At(std::size_t cell, std::size_t lane) const { return values_[cell * lanes_ + lane]; }

 private:
  bool SweepRow(int y, int z, bool backward) {
    const auto first = static_cast<std::size_t>((std::int64_t{z} * box_.size.y() + y) * box_.size.x());
    const int length = box_.size.x();
    bool changed = false;
    for (int k = 0; k < length; ++k) {
      const int x = backward ? length - 1 - k : k;
      changed = Update(first + static_cast<std::size_t>(x), Cell(x, y, z)) || changed;
    }
    return changed;
  }

  bool Update(std::size_t cell, const Cell& at) {
    const unsigned flags = flags_[cell];
    if (flags == kOutOfReach) return false;
    std::uint8_t* const mine = &values_[cell * lanes_];
    alignas(64) std::uint8_t best[256];
    std::memcpy(best, mine, lanes_);
    const std::array<std::uint8_t, kDirectionCount>* const told =
        tells_[cell] == 0 ? nullptr : &told_[tells_[cell] - 1];
    for (const Direction d : kDirections) {
      const auto i = static_cast<std::size_t>(IndexOf(d));
      const std::size_t shows = told == nullptr ? 0 : (*told)[i];
      if ((flags >> i & 1) != 0) {
        if (shows != 0) TakeWithout(best, best, shows, contact_units_);
        continue;
      }
      const int position = at[AxisOf(d)] + SignOf(d);
      const bool stays = position < 0 || position >= box_.size[AxisOf(d)];  // projected
      const std::int64_t by = stays ? 0 : SignOf(d) * strides_[static_cast<std::size_t>(AxisOf(d))];
      const std::uint8_t* const next =
          stays ? best : &values_[static_cast<std::size_t>(static_cast<std::int64_t>(cell) + by) * lanes_];
      if (shows != 0) {
        TakeWithout(best, next, shows, 1);
      } else if (!stays) {
        for (std::size_t m = 0; m < lanes_; ++m) {
          const auto value = static_cast<std::uint8_t>(std::min<std::uint8_t>(next[m], 254) + 1);
          best[m] = std::min(best[m], value);
        }
      }
    }
    if (std::memcmp(best, mine, lanes_) == 0) return false;
    std::memcpy(mine, best, lanes_);
    return true;
  }

  /// best[M] = min(best[M], next[M without those shown] + cost). Lanes without any of those shown go to themselves,
  /// which only helps where the step leads on.
  void TakeWithout(std::uint8_t* best, const std::uint8_t* next, std::size_t shows, std::uint8_t cost) const {
    const std::uint8_t* const without = &without_[shows * lanes_];
    const auto most = static_cast<std::uint8_t>(255 - cost);
    for (std::size_t m = 0; m < lanes_; ++m) {
      const auto value = static_cast<std::uint8_t>(std::min(next[without[m]], most) + cost);
      best[m] = std::min(best[m], value);
    }
  }

  /// Lanes at 255 cost more than a byte holds, or have no walk at all. Moves can be taken back, so there is a walk if
  /// each neighbour is told from some cell of the same component.
  void CutUnreached() {
    std::vector<std::uint32_t> component(box_.cells, 0);
    std::vector<unsigned> told_in = {0};
    std::vector<std::uint32_t> open;
    for (std::size_t start = 0; start < box_.cells; ++start) {
      if (component[start] != 0 || flags_[start] == kOutOfReach) continue;
      const auto id = static_cast<std::uint32_t>(told_in.size());
      told_in.push_back(0);
      component[start] = id;
      open.assign(1, static_cast<std::uint32_t>(start));
      while (!open.empty()) {
        const std::size_t cell = open.back();
        open.pop_back();
        if (tells_[cell] != 0) {
          for (const std::uint8_t t : told_[tells_[cell] - 1]) told_in[id] |= t;
        }
        const auto c = static_cast<int>(cell);
        const Cell at(c % box_.size.x(), c / box_.size.x() % box_.size.y(), c / box_.size.x() / box_.size.y());
        for (const Direction d : kDirections) {
          const int position = at[AxisOf(d)] + SignOf(d);
          if (position < 0 || position >= box_.size[AxisOf(d)]) continue;
          const auto next = static_cast<std::size_t>(static_cast<std::int64_t>(cell) +
                                                     SignOf(d) * strides_[static_cast<std::size_t>(AxisOf(d))]);
          const bool joined = (flags_[cell] >> IndexOf(d) & 1) == 0 || (flags_[next] >> IndexOf(Opposite(d)) & 1) == 0;
          if (!joined || component[next] != 0 || flags_[next] == kOutOfReach) continue;
          component[next] = id;
          open.push_back(static_cast<std::uint32_t>(next));
        }
      }
    }
    for (std::size_t cell = 0; cell < box_.cells; ++cell) {
      if (flags_[cell] == kOutOfReach) continue;
      const unsigned told = told_in[component[cell]];
      for (std::size_t m = 0; m < lanes_; ++m) {
        std::uint8_t& value = values_[cell * lanes_ + m];
        if (value == OrientedCertificates::kNone && (m & ~told) == 0) value = OrientedCertificates::kMost;
      }
    }
  }

  const OrientedBox& box_;
  std::size_t lanes_;
  std::uint8_t contact_units_;
  std::array<std::int64_t, 3> strides_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint32_t> tells_;  ///< index into told_, from 1; 0: nothing
  std::vector<std::array<std::uint8_t, kDirectionCount>> told_;
  std::vector<std::uint8_t> values_;
  std::vector<std::uint8_t> without_;
};

}  // namespace

OrientedBox::OrientedBox(const StepFlagsGrid::Region& region, const Cell& reach)
    : domain{region.box.min - reach - Cell::Ones(), region.box.max + reach + Cell::Ones()},
      size(domain.Size()),
      free_above(region.free_above),
      free_below(region.free_below),
      cells(static_cast<std::size_t>(domain.Count())) {}

std::uint32_t OrientedBox::WayBack(const Cell& displacement) const {
  int cells_back = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (free_above[i]) cells_back += std::max(0, displacement[axis] - domain.max[axis]);
    if (free_below[i]) cells_back += std::max(0, domain.min[axis] - displacement[axis]);
  }
  return static_cast<std::uint32_t>(cells_back);
}

OrientedCertificates::OrientedCertificates(const Problem& problem, const StepFlagsGrid& flags, const StepCosts& costs,
                                           Parallelism jobs, const ProgressCallback& progress,
                                           const CancellationToken* cancellation, const ArrayStore* store)
    : unit_(costs.free), layers_(static_cast<std::size_t>(flags.orientations())) {
  const Cell spread = problem.goal == GoalKind::kInsertable ? problem.insertable_spread : Cell(Cell::Zero());
  neighbours_ = NeighboursIn(problem, spread);
  std::vector<char> used(layers_.size(), 0);
  for (const Hypothesis& h : problem.hypotheses) used[static_cast<std::size_t>(h.orientation)] = 1;
  std::vector<int> orientations;
  std::vector<SharedArray<std::uint8_t>*> values;
  std::vector<SharedArray<std::uint32_t>*> cells;
  const int rows = flags.orientations() / problem.pitches;
  for (int o = 0; o < flags.orientations(); ++o) {
    if (used[static_cast<std::size_t>(o)] == 0) continue;
    orientations.push_back(o);
    Layer& layer = layers_[static_cast<std::size_t>(o)];
    layer.neighbour.fill(-1);
    layer.lane_bit.fill(-1);
    StepFlagsGrid::Region region = flags.region(o);
    int bits = 0;
    Cell reach = Cell::Zero();
    for (std::size_t i = 0; i < neighbours_.size(); ++i) {
      const int yaw = o / problem.pitches + neighbours_[i].yaw;
      const int pitch = o % problem.pitches + neighbours_[i].pitch;
      if (yaw < 0 || yaw >= rows || pitch < 0 || pitch >= problem.pitches) continue;
      const int other = yaw * problem.pitches + pitch;
      if (used[static_cast<std::size_t>(other)] == 0) continue;
      layer.neighbour[i] = other;
      layer.lane_bit[i] = bits++;
      reach = reach.cwiseMax(neighbours_[i].offset.cwiseAbs());
      region = StepFlagsGrid::Union(region, flags.region(other));
    }
    layer.lanes = 1 << bits;
    layer.box = OrientedBox(region, reach);
    values.push_back(layer.values.differences());
    cells.push_back(layer.values.cells());
  }
  if (store != nullptr && store->Take("oriented certificates", values) &&
      store->Take("cells of oriented certificates", cells)) {
    return;
  }
  const int contact_units = static_cast<int>(std::min(60.0, std::floor(costs.contact / costs.free + 1e-9)));
  const bool all = ParallelFor(
      orientations.size(), jobs, [&](std::size_t k) { Fill(flags, orientations[k], contact_units); }, progress,
      cancellation);
  if (!all || store == nullptr) return;
  store->Keep("oriented certificates", values);
  store->Keep("cells of oriented certificates", cells);
}

void OrientedCertificates::Fill(const StepFlagsGrid& flags, int orientation, int contact_units) {
  Layer& layer = layers_[static_cast<std::size_t>(orientation)];
  int bits = 0;
  while (1 << bits < layer.lanes) ++bits;
  LaneSweeper sweeper(layer.box, bits, static_cast<std::uint8_t>(contact_units));
  sweeper.Prepare([&](const Cell& here) { return flags.At(here, orientation); },
                  [&](const Cell& here, std::uint8_t mine) {
                    std::array<std::uint8_t, kDirectionCount> told{};
                    for (std::size_t i = 0; i < neighbours_.size(); ++i) {
                      if (layer.lane_bit[i] < 0) continue;
                      const std::uint8_t theirs = flags.At(here - neighbours_[i].offset, layer.neighbour[i]);
                      // Inside the target every step counts as blocked.
                      const unsigned other = theirs == kOutOfReach ? kBlockedSteps : theirs;
                      const unsigned differ = (other ^ mine) & kBlockedSteps;
                      for (std::size_t d = 0; d < kDirectionCount; ++d) {
                        if ((differ >> d & 1) != 0) told[d] |= static_cast<std::uint8_t>(1U << layer.lane_bit[i]);
                      }
                    }
                    return told;
                  });
  sweeper.Run();
  std::vector<std::uint8_t> times(static_cast<std::size_t>(layer.lanes), 1);
  times[0] = 0;  // no neighbour, no cost
  layer.values =
      DifferenceRows<std::uint8_t>(layer.box.cells, times, [&](std::size_t cell, std::span<std::uint8_t> values) {
        for (std::size_t lane = 0; lane < values.size(); ++lane) values[lane] = sweeper.At(cell, lane);
      });
}

OrientedCertificates::Plane OrientedCertificates::PlaneOf(int orientation, unsigned subset) const {
  const Layer& layer = layers_[static_cast<std::size_t>(orientation)];
  std::size_t lane = 0;
  for (std::size_t i = 0; i < neighbours_.size(); ++i) {
    if ((subset >> i & 1) != 0) lane |= std::size_t{1} << layer.lane_bit[i];
  }
  return layer.values.Of(lane, static_cast<std::size_t>(layer.lanes), lane == 0 ? 0 : 1);
}

std::size_t OrientedCertificates::bytes() const {
  std::size_t sum = 0;
  for (const Layer& layer : layers_) sum += layer.values.bytes();
  return sum;
}

}  // namespace feeler::planner
