#include "feeler/planner/belief/hypothesis_sets.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <map>

#include "feeler/planner/belief/hull.h"

namespace feeler::planner {
namespace {

constexpr SetId kEmpty = ~SetId{0};
constexpr int kWindow = 16;

int FloorToWindow(int x) { return x >= 0 ? x / kWindow * kWindow : -((-x + kWindow - 1) / kWindow * kWindow); }

std::uint64_t HashOf(const std::vector<Slab>& slabs) {
  std::uint64_t hash = 0x9E3779B97F4A7C15;
  for (const Slab& slab : slabs) {
    std::uint64_t h = slab.layer;
    for (const std::uint64_t w : slab.bits.word) {
      h = (h ^ w) * 0xFF51AFD7ED558CCD;
      h ^= h >> 29;
    }
    hash = (hash ^ h) * 0xC4CEB9FE1A85EC53;
    hash ^= hash >> 32;
  }
  return hash;
}

/// Which of the 16 columns (x) and rows (y) of the window are used.
void UsedColumnsAndRows(const Bits256& bits, unsigned& columns, unsigned& rows) {
  for (int y = 0; y < kWindow; ++y) {
    const auto row = static_cast<unsigned>(bits.word[static_cast<std::size_t>(y >> 2)] >> (16 * (y & 3)) & 0xFFFF);
    columns |= row;
    rows |= (row != 0 ? 1U : 0U) << y;
  }
}

}  // namespace

HypothesisSets::HypothesisSets(const Problem& problem, bool canonical)
    : goal_(problem.goal), insertable_spread_(problem.insertable_spread) {
  int orientations = 1;
  double total = 0.0;
  const bool uniform = EquallyLikely(problem);
  for (const Hypothesis& h : problem.hypotheses) {
    orientations = std::max(orientations, h.orientation + 1);
    total += h.weight;
  }
  const CellBox hull = HullOf(problem.hypotheses);
  const Cell low = hull.min;
  const Cell span = hull.Size();
  shiftable_ = canonical && uniform && span.x() <= kWindow && span.y() <= kWindow && span.z() <= 4096;

  // Layers: by orientation, then tile (one where sets are shiftable), then height.
  std::map<std::array<int, 4>, std::vector<std::size_t>> members;  // orientation, tile x, tile y, z
  for (std::size_t i = 0; i < problem.hypotheses.size(); ++i) {
    const Hypothesis& h = problem.hypotheses[i];
    const Cell offset = shiftable_ ? Cell(h.offset - low) : h.offset;
    members[{h.orientation, FloorToWindow(offset.x()), FloorToWindow(offset.y()), offset.z()}].push_back(i);
  }
  if (shiftable_) {
    depth_ = span.z();
    for (int o = 0; o < orientations; ++o) {
      for (int z = 0; z < depth_; ++z) {
        corners_.emplace_back(0, 0, z);
        orientations_.push_back(o);
      }
    }
  }
  std::vector<Slab> slabs;
  for (const auto& [key, indices] : members) {
    Slab slab;
    if (shiftable_) {
      slab.layer = static_cast<std::uint32_t>(key[0] * depth_ + key[3]);
    } else {
      slab.layer = static_cast<std::uint32_t>(corners_.size());
      corners_.emplace_back(key[1], key[2], key[3]);
      orientations_.push_back(key[0]);
      if (!uniform) weights_.resize(corners_.size() * 256, 0.0);
    }
    for (const std::size_t i : indices) {
      const Hypothesis& h = problem.hypotheses[i];
      const Cell in_window = (shiftable_ ? Cell(h.offset - low) : h.offset) - corners_[slab.layer];
      const int bit = in_window.x() + kWindow * in_window.y();
      slab.bits.Set(bit);
      if (!uniform) {
        weights_[slab.layer * std::size_t{256} + static_cast<std::size_t>(bit)] =
            h.weight / total * static_cast<double>(problem.hypotheses.size());
      }
    }
    slabs.push_back(slab);
  }
  for (const Cell& corner : corners_) {
    single_window_ = single_window_ && corner.head<2>() == corners_.front().head<2>();
  }
  table_.assign(256, kEmpty);
  Cell shift;
  start_ = Intern(slabs, shift);
  start_frame_ = shiftable_ ? low : Cell::Zero();
}

void HypothesisSets::Shift(std::vector<Slab>& slabs, Cell& shift) const {
  Bits256 all;
  int z = depth_;
  for (const Slab& slab : slabs) {
    all = all | slab.bits;
    z = std::min(z, Corner(slab.layer).z());
  }
  unsigned columns = 0;
  unsigned rows = 0;
  UsedColumnsAndRows(all, columns, rows);
  shift = Cell(std::countr_zero(columns), std::countr_zero(rows), z);
  const int down = shift.x() + kWindow * shift.y();
  if (down == 0 && z == 0) return;
  for (Slab& slab : slabs) {
    if (down != 0) slab.bits = slab.bits.Down(down);
    slab.layer -= static_cast<std::uint32_t>(z);
  }
}

HypothesisSets::Info HypothesisSets::Describe(const std::vector<Slab>& slabs) const {
  Info info;
  info.low = Cell::Constant(1 << 30);
  info.high = Cell::Constant(-(1 << 30));
  bool one_orientation = true;
  for (const Slab& slab : slabs) {
    info.size += static_cast<std::uint32_t>(slab.bits.Count());
    one_orientation = one_orientation && Orientation(slab.layer) == Orientation(slabs.front().layer);
    unsigned columns = 0;
    unsigned rows = 0;
    UsedColumnsAndRows(slab.bits, columns, rows);
    const Cell corner = Corner(slab.layer);
    info.low = info.low.cwiseMin(corner + Cell(std::countr_zero(columns), std::countr_zero(rows), 0));
    info.high = info.high.cwiseMax(
        corner + Cell(static_cast<int>(std::bit_width(columns)) - 1, static_cast<int>(std::bit_width(rows)) - 1, 0));
    if (!weights_.empty()) slab.bits.ForEach([&](int bit) { info.weight += Weight(slab.layer, bit); });
  }
  if (weights_.empty()) info.weight = info.size;
  info.goal = info.size == 1 || (goal_ == GoalKind::kInsertable && one_orientation &&
                                 ((info.high - info.low).array() <= insertable_spread_.array()).all());
  return info;
}

void HypothesisSets::Grow() {
  std::vector<SetId> table(table_.size() * 2, kEmpty);
  const std::size_t mask = table.size() - 1;
  for (SetId set = 0; set < infos_.size(); ++set) {
    std::size_t at = hashes_[set] & mask;
    while (table[at] != kEmpty) at = (at + 1) & mask;
    table[at] = set;
  }
  table_ = std::move(table);
}

SetId HypothesisSets::Intern(std::vector<Slab>& given, Cell& shift) {
  shift = Cell::Zero();
  if (shiftable_) Shift(given, shift);
  const std::uint64_t hash = HashOf(given);
  const std::size_t mask = table_.size() - 1;
  std::size_t at = hash & mask;
  for (; table_[at] != kEmpty; at = (at + 1) & mask) {
    const SetId set = table_[at];
    if (hashes_[set] == hash && std::ranges::equal(slabs(set), given)) return set;
  }
  const auto set = static_cast<SetId>(infos_.size());
  Info info = Describe(given);
  info.first_slab = static_cast<std::uint32_t>(slabs_.size());
  info.slab_count = static_cast<std::uint32_t>(given.size());
  slabs_.insert(slabs_.end(), given.begin(), given.end());
  infos_.push_back(info);
  hashes_.push_back(hash);
  table_[at] = set;
  if (infos_.size() * 2 > table_.size()) Grow();
  return set;
}

std::optional<SetId> HypothesisSets::Find(const std::vector<Hypothesis>& hypotheses) {
  assert(!shiftable_);
  std::vector<Slab> found;
  for (const Slab& slab : slabs(start_)) {
    const Cell corner = Corner(slab.layer);
    Slab part{slab.layer, {}};
    for (const Hypothesis& h : hypotheses) {
      const Cell in = h.offset - corner;
      if (h.orientation != Orientation(slab.layer) || in.z() != 0 || in.x() < 0 || in.x() >= kWindow || in.y() < 0 ||
          in.y() >= kWindow) {
        continue;
      }
      if (slab.bits.Test(in.x() + kWindow * in.y())) part.bits.Set(in.x() + kWindow * in.y());
    }
    if (part.bits.Any()) found.push_back(part);
  }
  std::size_t size = 0;
  for (const Slab& slab : found) size += static_cast<std::size_t>(slab.bits.Count());
  if (size != hypotheses.size() || size == 0) return std::nullopt;
  Cell shift;
  return Intern(found, shift);
}

bool HypothesisSets::IsSubset(SetId part, SetId whole, const Cell& by) const {
  const Info& p = infos_[part];
  const Info& w = infos_[whole];
  if (p.size > w.size) return false;
  if (((p.low + by).array() < w.low.array()).any() || ((p.high + by).array() > w.high.array()).any()) return false;
  const int up = by.x() + kWindow * by.y();
  const auto of_whole = slabs(whole);
  std::size_t at = 0;
  for (const Slab& slab : slabs(part)) {
    const std::uint32_t layer = slab.layer + static_cast<std::uint32_t>(by.z());
    while (at < of_whole.size() && of_whole[at].layer < layer) ++at;
    if (at == of_whole.size() || of_whole[at].layer != layer) return false;
    const Bits256 moved = up >= 0 ? slab.bits.Up(up) : slab.bits.Down(-up);
    if (moved.Without(of_whole[at].bits).Any()) return false;
  }
  return true;
}

std::size_t HypothesisSets::bytes() const {
  return infos_.capacity() * sizeof(Info) + hashes_.capacity() * sizeof(std::uint64_t) +
         slabs_.capacity() * sizeof(Slab) + table_.capacity() * sizeof(SetId);
}

}  // namespace feeler::planner
