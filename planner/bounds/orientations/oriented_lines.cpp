#include "feeler/planner/bounds/orientations/oriented_lines.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "feeler/core/worker_pool.h"
#include "feeler/planner/bounds/certificates/equal_steps.h"

namespace feeler::planner {
namespace {

constexpr std::uint32_t kInfinite = ~std::uint32_t{0};
constexpr std::uint32_t kUnitsPerStep = 16;  ///< where contacts cost something

/// The cell after `from` in a box, by its index.
std::uint32_t NextIn(const OrientedBox& box, std::uint32_t from, Direction d) {
  return static_cast<std::uint32_t>(from + SignOf(d) * box.strides()[static_cast<std::size_t>(AxisOf(d))]);
}

}  // namespace

OrientedLines::OrientedLines(const Problem& problem, const StepFlagsGrid& flags, const StepCosts& costs,
                             Parallelism jobs, const ProgressCallback& progress, const CancellationToken* cancellation,
                             const ArrayStore* store)
    : units_per_step_(costs.contact > 0.0 ? kUnitsPerStep : 1) {
  std::vector<char> used(static_cast<std::size_t>(flags.orientations()), 0);
  for (const Hypothesis& h : problem.hypotheses) used[static_cast<std::size_t>(h.orientation)] = 1;
  for (const Axis axis : {kYaw, kPitch}) AddLines(axis, problem, flags, used);
  std::vector<SharedArray<std::uint16_t>*> values;
  std::vector<SharedArray<std::uint32_t>*> cells;
  for (Line& line : lines_) {
    values.push_back(line.values.differences());
    cells.push_back(line.values.cells());
  }
  if (store != nullptr && store->Take("oriented lines", values) && store->Take("cells of oriented lines", cells))
    return;
  const double contact = costs.contact / costs.free * units_per_step_;
  const auto contact_units = static_cast<std::uint32_t>(std::min(4000.0, std::floor(contact + 1e-9)));
  const bool all = ParallelFor(
      lines_.size(), jobs, [&](std::size_t i) { Fill(flags, contact_units, lines_[i]); }, progress, cancellation);
  if (!all || store == nullptr) return;
  store->Keep("oriented lines", values);
  store->Keep("cells of oriented lines", cells);
}

void OrientedLines::AddLines(Axis axis, const Problem& problem, const StepFlagsGrid& flags,
                             const std::vector<char>& used) {
  const int pitches = problem.pitches;
  const int yaws = flags.orientations() / pitches;
  const int along = axis == kYaw ? yaws : pitches;
  const int across = axis == kYaw ? pitches : yaws;
  places_[axis].resize(used.size());
  for (int i = 0; i < across; ++i) {
    Line line;
    const auto close = [&] {
      if (line.orientations.size() > 1) {
        for (std::size_t bit = 0; bit < line.orientations.size(); ++bit) {
          places_[axis][static_cast<std::size_t>(line.orientations[bit])] = {static_cast<int>(lines_.size()),
                                                                             static_cast<int>(bit)};
        }
        StepFlagsGrid::Region region = flags.region(line.orientations.front());
        for (const int o : line.orientations) region = StepFlagsGrid::Union(region, flags.region(o));
        line.box = OrientedBox(region, Cell::Zero());
        lines_.push_back(std::move(line));
      }
      line = Line();
    };
    for (int k = 0; k < along; ++k) {
      const int orientation = axis == kYaw ? k * pitches + i : i * pitches + k;
      if (used[static_cast<std::size_t>(orientation)] != 0) line.orientations.push_back(orientation);
      if (line.orientations.size() == kLongest) close();
    }
    close();
  }
}

/// What a line meets at each cell of its box. Bit i: under hypothesis i of the line.
struct OrientedLines::LineBits {
  std::vector<std::uint8_t> inside;                                ///< the cell is out of reach
  std::vector<std::array<std::uint8_t, kDirectionCount>> blocked;  ///< the step is
  std::vector<std::uint8_t> leads;                                 ///< bit d: the step in direction d stays in the box
  std::vector<std::uint32_t> telling;                              ///< cells where some step splits the line
};

OrientedLines::LineBits OrientedLines::BitsOf(const StepFlagsGrid& flags, const Line& line) {
  const OrientedBox& box = line.box;
  LineBits bits;
  bits.inside.assign(box.cells, 0);
  bits.blocked.resize(box.cells);
  bits.leads.assign(box.cells, 0);
  const auto all = static_cast<std::uint8_t>((1U << line.orientations.size()) - 1);
  std::uint32_t cell = 0;
  ForEachCell({Cell::Zero(), box.size - Cell::Ones()}, [&](const Cell& at) {
    for (std::size_t i = 0; i < line.orientations.size(); ++i) {
      const std::uint8_t steps = flags.At(box.domain.min + at, line.orientations[i]);
      const auto bit = static_cast<std::uint8_t>(1U << i);
      if (steps == kOutOfReach) bits.inside[cell] |= bit;
      for (const Direction d : kDirections) {
        if (steps == kOutOfReach || (steps >> IndexOf(d) & 1) != 0) {
          bits.blocked[cell][static_cast<std::size_t>(IndexOf(d))] |= bit;
        }
      }
    }
    if (std::ranges::any_of(bits.blocked[cell], [&](std::uint8_t b) { return b != 0 && b != all; })) {
      bits.telling.push_back(cell);
    }
    for (const Direction d : kDirections) {
      const int to = at[AxisOf(d)] + SignOf(d);
      if (to >= 0 && to < box.size[AxisOf(d)]) bits.leads[cell] |= static_cast<std::uint8_t>(1U << IndexOf(d));
    }
    ++cell;
  });
  return bits;
}

void OrientedLines::SplittingSteps(const OrientedBox& box, const std::vector<std::uint16_t>& values,
                                   const LineBits& bits, std::uint32_t subset, std::uint32_t contact_units,
                                   std::vector<std::uint32_t>& cost,
                                   std::vector<std::pair<std::uint32_t, std::uint32_t>>& seeds) const {
  const auto value = [&](std::uint32_t part, std::uint32_t at) -> std::uint32_t {
    if (std::has_single_bit(part)) return 0;
    const std::uint16_t v = values[part * box.cells + at];
    return v == kNone ? kInfinite : v;
  };
  for (const std::uint32_t at : bits.telling) {
    if ((bits.inside[at] & subset) != 0) continue;
    for (const Direction d : kDirections) {
      const std::uint32_t hit = bits.blocked[at][static_cast<std::size_t>(IndexOf(d))] & subset;
      if (hit == 0 || hit == subset) continue;
      const std::uint32_t missed = subset & ~hit;
      const std::uint32_t after_hit = value(hit, at);
      // Over the edge everything repeats.
      const bool stays = (bits.leads[at] >> IndexOf(d) & 1) == 0;
      const std::uint32_t after_miss = value(missed, stays ? at : NextIn(box, at, d));
      if (after_hit == kInfinite || after_miss == kInfinite) continue;
      const std::uint32_t of_split = after_hit + after_miss +
                                     static_cast<std::uint32_t>(std::popcount(hit)) * contact_units +
                                     static_cast<std::uint32_t>(std::popcount(missed)) * units_per_step_;
      if (of_split >= cost[at]) continue;
      cost[at] = of_split;
      seeds.emplace_back(of_split, at);
    }
  }
}

void OrientedLines::Fill(const StepFlagsGrid& flags, std::uint32_t contact_units, Line& line) const {
  const std::size_t cells = line.box.cells;
  const LineBits bits = BitsOf(flags, line);
  const std::uint32_t subsets = 1U << line.orientations.size();
  std::vector<std::uint16_t> values(cells * subsets, 0);
  std::vector<std::uint32_t> order;
  for (std::uint32_t s = 1; s < subsets; ++s) {
    if (!std::has_single_bit(s)) order.push_back(s);
  }
  std::ranges::stable_sort(order, {}, [](std::uint32_t s) { return std::popcount(s); });
  std::vector<std::uint32_t> cost(cells);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> seeds;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> queue;
  for (const std::uint32_t subset : order) {
    const auto count = static_cast<std::uint32_t>(std::popcount(subset));
    std::ranges::fill(cost, kInfinite);
    seeds.clear();
    SplittingSteps(line.box, values, bits, subset, contact_units, cost, seeds);
    SpreadByEqualSteps(seeds, count * units_per_step_, cost, queue, [&](std::uint32_t to, auto relax) {
      for (const Direction d : kDirections) {
        if ((bits.leads[to] >> IndexOf(Opposite(d)) & 1) == 0) continue;
        const std::uint32_t before = NextIn(line.box, to, Opposite(d));
        if ((bits.inside[before] | bits.blocked[before][static_cast<std::size_t>(IndexOf(d))]) & subset) continue;
        relax(before);
      }
    });
    std::uint16_t* const plane = &values[subset * cells];
    for (std::size_t i = 0; i < cells; ++i) {
      plane[i] =
          cost[i] == kInfinite ? kNone : static_cast<std::uint16_t>(std::min<std::uint32_t>(cost[i], kNone - 1U));
    }
  }
  std::vector<std::uint16_t> times(subsets, 0);
  for (const std::uint32_t s : order) times[s] = static_cast<std::uint16_t>(std::popcount(s));
  line.values = DifferenceRows<std::uint16_t>(cells, times, [&](std::size_t cell, std::span<std::uint16_t> of_subsets) {
    for (std::size_t subset = 0; subset < subsets; ++subset) of_subsets[subset] = values[subset * cells + cell];
  });
}

OrientedLines::Plane OrientedLines::PlaneOf(int line, unsigned subset) const {
  if (std::has_single_bit(subset)) return {};
  const Line& of = lines_[static_cast<std::size_t>(line)];
  return of.values.Of(subset, std::size_t{1} << of.orientations.size(),
                      static_cast<std::uint16_t>(std::popcount(subset)));
}

std::size_t OrientedLines::bytes() const {
  std::size_t sum = 0;
  for (const Line& line : lines_) sum += line.values.bytes();
  return sum;
}

}  // namespace feeler::planner
