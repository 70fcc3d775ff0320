#include "feeler/planner/bounds/certificates/guarded_certificates.h"

#include <algorithm>
#include <bit>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/bounds/certificates/certificate_walks.h"

namespace feeler::planner {
namespace {

constexpr std::uint32_t kInfinite = ~std::uint32_t{0} / 2;

class Filler {
 public:
  Filler(const GuardedWalks& walks, int bits, std::uint16_t* planes)
      : walks_(walks), bits_(bits), planes_(planes), cells_(static_cast<std::size_t>(walks.size.prod())) {
    strides_ = GridStrides(walks.size);
    // Where moves tell nothing, whatever the mask: contact with a wall that is the same under all is a move too.
    for (std::size_t d = 0; d < kDirectionCount; ++d) {
      silent_[d].resize(cells_);
      for (std::size_t i = 0; i < cells_; ++i) {
        silent_[d][i] = std::min(walks.travel[d][i], walks.longest[d][i]);
      }
      bumps_[d].resize(cells_);
      for (std::size_t i = 0; i < cells_; ++i) bumps_[d][i] = walks.travel[d][i] < walks.longest[d][i] ? 1 : 0;
    }
    values_.resize(cells_);
  }

  void Fill(std::uint32_t mask) {
    std::uint16_t* const plane = planes_ + mask * cells_;
    std::ranges::fill(values_, kInfinite);
    for (const GuardedWalks::Telling& telling : walks_.telling) Seed(telling, mask);
    for (bool changed = true; changed;) {
      changed = Sweep(false);
      changed = changed && Sweep(true);
    }
    for (std::size_t i = 0; i < cells_; ++i) {
      plane[i] = values_[i] >= kInfinite
                     ? kNoCertificate
                     : static_cast<std::uint16_t>(std::min<std::uint32_t>(values_[i], kNoCertificate - 1));
    }
  }

 private:
  Cell At(std::size_t cell) const { return GridCell(walks_.size, cell); }
  /// Where a motion of `steps` ends; at the border if beyond.
  std::size_t End(std::size_t cell, int position, Direction d, int steps) const {
    const int axis = AxisOf(d);
    const int end = std::clamp(position + SignOf(d) * steps, 0, walks_.size[axis] - 1);
    return static_cast<std::size_t>(static_cast<std::int64_t>(cell) +
                                    (end - position) * strides_[static_cast<std::size_t>(axis)]);
  }
  std::uint32_t Cost(int steps, bool contact, Direction d) const {
    const std::uint32_t step = walks_.step_cost + walks_.beyond_step[static_cast<std::size_t>(AxisOf(d))];
    return walks_.action_cost + static_cast<std::uint32_t>(steps) * step + (contact ? walks_.contact_cost : 0);
  }
  bool Inward(int position, Direction d) const {
    return walks_.projected && position == (SignOf(d) > 0 ? 0 : walks_.size[AxisOf(d)] - 1);
  }

  /// Bounds how far moves from a cell tell nothing under this mask, and seeds the value of the cell with those that do.
  void Seed(const GuardedWalks::Telling& telling, std::uint32_t mask) {
    const auto d = static_cast<std::size_t>(IndexOf(telling.direction));
    const std::size_t cell = telling.cell;
    const int travel = walks_.travel[d][cell];
    const int longest = walks_.longest[d][cell];
    int silent = std::min(travel, longest);
    bool bump = travel < longest;
    for (int i = 0; i < bits_; ++i) {
      if ((mask >> i & 1) == 0) continue;
      silent = std::min<int>(silent, telling.travel[static_cast<std::size_t>(i)]);
      bump = bump && telling.travel[static_cast<std::size_t>(i)] == travel;
    }
    silent_[d][cell] = static_cast<std::uint8_t>(silent);
    bumps_[d][cell] = bump ? 1 : 0;
    const int position = At(cell)[AxisOf(telling.direction)];
    const auto try_move = [&](int length) {
      const int steps = std::min(length, travel);
      std::uint32_t shows = 0;
      for (int i = 0; i < bits_; ++i) {
        if (std::min<int>(telling.travel[static_cast<std::size_t>(i)], length) != steps) shows |= 1U << i;
      }
      if ((shows & mask) == 0) return;
      const std::uint16_t rest = planes_[(mask & ~shows) * cells_ + End(cell, position, telling.direction, steps)];
      if (rest == kNoCertificate) return;
      values_[cell] = std::min(values_[cell], Cost(steps, travel < length, telling.direction) + rest);
    };
    if (Inward(position, telling.direction)) {
      for (int length = 1; length <= std::min(longest, travel + 1); ++length) try_move(length);
    } else {
      for (const int length : walks_.lengths) {
        if (length <= std::min(longest, travel)) try_move(length);
      }
      if (travel < longest) try_move(longest);
    }
  }

  /// Moves that tell nothing.
  std::uint32_t Best(std::size_t cell, const Cell& at) const {
    std::uint32_t best = values_[cell];
    for (const Direction d : kDirections) {
      const auto index = static_cast<std::size_t>(IndexOf(d));
      const int silent = silent_[index][cell];
      const int position = at[AxisOf(d)];
      if (silent > 0) {
        if (Inward(position, d)) {
          for (int n = 1; n <= silent; ++n) {
            best = std::min(best, Cost(n, false, d) + values_[End(cell, position, d, n)]);
          }
        } else {
          for (const int n : walks_.lengths) {
            if (n > silent) break;
            best = std::min(best, Cost(n, false, d) + values_[End(cell, position, d, n)]);
          }
        }
      }
      if (bumps_[index][cell] != 0) {
        const int n = walks_.travel[index][cell];
        if (n > 0) best = std::min(best, Cost(n, true, d) + values_[End(cell, position, d, n)]);
      }
    }
    return best;
  }

  bool Sweep(bool backward) {
    bool changed = false;
    const Cell& size = walks_.size;
    for (std::size_t k = 0; k < cells_; ++k) {
      const std::size_t cell = backward ? cells_ - 1 - k : k;
      if (k % static_cast<std::size_t>(size.x()) == 0) row_ = At(cell);
      const auto along = static_cast<int>(k % static_cast<std::size_t>(size.x()));
      row_.x() = backward ? size.x() - 1 - along : along;
      const std::uint32_t best = Best(cell, row_);
      if (best >= values_[cell]) continue;
      values_[cell] = best;
      changed = true;
    }
    return changed;
  }

  const GuardedWalks& walks_;
  int bits_;
  std::uint16_t* planes_;
  std::size_t cells_;
  std::array<std::int64_t, 3> strides_{};
  std::array<std::vector<std::uint8_t>, kDirectionCount> silent_;  ///< longest free move that tells nothing
  std::array<std::vector<std::uint8_t>, kDirectionCount> bumps_;   ///< running into the wall tells nothing
  std::vector<std::uint32_t> values_;
  Cell row_ = Cell::Zero();
};

}  // namespace

void FillGuardedCertificates(const GuardedWalks& walks, int bits, std::uint16_t* planes) {
  const auto cells = static_cast<std::size_t>(walks.size.prod());
  std::fill(planes, planes + cells, std::uint16_t{0});
  Filler filler(walks, bits, planes);
  // By number of others: a move that tells something leads to a smaller mask.
  std::vector<std::uint32_t> masks(std::size_t{1} << bits);
  for (std::uint32_t m = 0; m < masks.size(); ++m) masks[m] = m;
  std::ranges::stable_sort(masks, {}, [](std::uint32_t m) { return std::popcount(m); });
  for (const std::uint32_t mask : masks) {
    if (mask != 0) filler.Fill(mask);
  }
}

}  // namespace feeler::planner
