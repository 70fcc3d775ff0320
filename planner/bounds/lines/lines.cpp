#include "feeler/planner/bounds/lines/lines.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/bounds/certificates/equal_steps.h"

namespace feeler::planner {
namespace {

constexpr std::uint32_t kInfinite = ~std::uint32_t{0};
constexpr int kBorder = 2;
constexpr std::uint32_t kUnitsPerStep = 16;

/// A hypothesis without these is a run of one along every axis.
std::array<Cell, 6> UnitNeighbours() {
  std::array<Cell, 6> neighbours;
  for (const Direction d : kDirections) neighbours[static_cast<std::size_t>(IndexOf(d))] = UnitCell(d);
  return neighbours;
}

}  // namespace

LineTable::LineTable(const ContactMap& map, const StepCosts& costs, const Cell& spread, const Cell& longest,
                     const std::vector<int>& orientations, const ArrayStore* store)
    : place_(static_cast<std::size_t>(map.orientations()), -1) {
  for (std::size_t i = 0; i < orientations.size(); ++i)
    place_[static_cast<std::size_t>(orientations[i])] = static_cast<int>(i);
  const std::uint32_t free_units = costs.contact > 0.0 ? kUnitsPerStep : 1;
  unit_ = costs.free / free_units;
  const auto contact_units = static_cast<std::uint32_t>(std::min(4000.0, std::floor(costs.contact / unit_)));
  for (int axis = 0; axis < 3; ++axis) {
    Grid& grid = grids_[static_cast<std::size_t>(axis)];
    grid.longest = std::min(longest[axis], kLongest);
    if (grid.longest < 2) {
      grid.longest = 1;
      continue;
    }
    // Far enough out that the whole line has left the map's domain: beyond, everything repeats.
    grid.domain = {map.domain().min - Cell::Constant(kBorder), map.domain().max + Cell::Constant(kBorder)};
    grid.domain.max[axis] += grid.longest;
    grid.size = grid.domain.Size();
    grid.cells = static_cast<std::size_t>(grid.domain.Count());
    const std::string name = "lines " + std::to_string(axis);
    if (store != nullptr && store->Take<std::uint16_t>(name, {&grid.values})) continue;
    std::vector<std::uint16_t> values(grid.cells * static_cast<std::size_t>(grid.longest + 1) * orientations.size(), 0);
    for (const int o : orientations) Fill(map, axis, o, spread[axis], {free_units, contact_units}, values);
    grid.values = std::move(values);
    if (store != nullptr) store->Keep<std::uint16_t>(name, {&grid.values});
  }
}

/// What a line meets at each cell of the grid. Bit i: under hypothesis i of the line, at `cell` - i along the axis.
struct LineTable::LineBits {
  std::vector<std::uint16_t> inside;                                ///< the cell is blocked
  std::array<std::vector<std::uint16_t>, kDirectionCount> blocked;  ///< the step is
  std::vector<std::uint8_t> leads;  ///< bit d: the next cell in direction d is in the domain
};

LineTable::LineBits LineTable::BitsOf(const ContactMap& map, const Grid& grid, int axis, int orientation) {
  const std::int64_t along = GridStrides(grid.size)[static_cast<std::size_t>(axis)];
  LineBits bits;
  bits.inside.assign(grid.cells, 0);
  bits.leads.assign(grid.cells, 0);
  for (auto& of_direction : bits.blocked) of_direction.assign(grid.cells, 0);
  std::size_t cell = 0;
  ForEachCell(grid.domain, [&](const Cell& here) {
    const bool first = here[axis] == grid.domain.min[axis];
    const std::size_t before = first ? cell : cell - static_cast<std::size_t>(along);
    const auto shifted = [&](const std::vector<std::uint16_t>& line, bool bit) {
      // Before the domain's edge the line continues as it is at the edge.
      const unsigned rest = first ? (bit ? 0xFFFFU : 0U) : static_cast<unsigned>(line[before]);
      return static_cast<std::uint16_t>(rest << 1 | (bit ? 1U : 0U));
    };
    bits.inside[cell] = shifted(bits.inside, map.Blocked(here, orientation));
    for (const Direction d : kDirections) {
      auto& line = bits.blocked[static_cast<std::size_t>(IndexOf(d))];
      line[cell] = shifted(line, !map.StepFree(here, d, orientation));
      if (grid.domain.Contains(here + UnitCell(d))) bits.leads[cell] |= static_cast<std::uint8_t>(1U << IndexOf(d));
    }
    ++cell;
  });
  return bits;
}

std::uint32_t LineTable::RunsValue(const Grid& grid, const std::uint16_t* planes, std::int64_t along,
                                   std::uint32_t bits, std::size_t at) {
  std::uint32_t sum = 0;
  for (int i = 0; bits >> i != 0;) {
    if ((bits >> i & 1) == 0) {
      ++i;
      continue;
    }
    int length = 0;
    while ((bits >> (i + length) & 1) != 0) ++length;
    if (length >= 2) {
      const std::uint16_t value =
          planes[static_cast<std::size_t>(length) * grid.cells + at - static_cast<std::size_t>(i * along)];
      if (value == kUnreachable) return kInfinite;
      sum += value;
    }
    i += length;
  }
  return sum;
}

void LineTable::SplittingSteps(const Grid& grid, const LineBits& bits, int axis, int length, const StepUnits& units,
                               const std::uint16_t* planes, std::vector<std::uint32_t>& cost,
                               std::vector<std::pair<std::uint32_t, std::uint32_t>>& seeds) {
  const std::array<std::int64_t, 3> strides = GridStrides(grid.size);
  const std::int64_t along = strides[static_cast<std::size_t>(axis)];
  const auto whole = static_cast<std::uint32_t>((std::uint32_t{1} << length) - 1);
  for (std::size_t at = 0; at < grid.cells; ++at) {
    if ((bits.inside[at] & whole) != 0) continue;
    for (const Direction d : kDirections) {
      const std::uint32_t hit = bits.blocked[static_cast<std::size_t>(IndexOf(d))][at] & whole;
      if (hit == 0 || hit == whole) continue;
      // Near the edge of the domain lines are the same further in; there is no need to look at them here.
      const std::int64_t position = static_cast<std::int64_t>(at) / along % grid.size[axis];
      if (position < length) continue;
      const std::uint32_t missed = whole & ~hit;
      const bool stays = (bits.leads[at] >> IndexOf(d) & 1) == 0;
      const std::int64_t step = stays ? 0 : SignOf(d) * strides[static_cast<std::size_t>(AxisOf(d))];
      const std::uint32_t after_hit = RunsValue(grid, planes, along, hit, at);
      const std::uint32_t after_miss =
          RunsValue(grid, planes, along, missed, static_cast<std::size_t>(static_cast<std::int64_t>(at) + step));
      if (after_hit == kInfinite || after_miss == kInfinite) continue;
      const std::uint32_t value = after_hit + after_miss +
                                  static_cast<std::uint32_t>(std::popcount(hit)) * units.contact +
                                  static_cast<std::uint32_t>(std::popcount(missed)) * units.free;
      if (value >= cost[at]) continue;
      cost[at] = value;
      seeds.emplace_back(value, static_cast<std::uint32_t>(at));
    }
  }
}

void LineTable::Fill(const ContactMap& map, int axis, int orientation, int spread, const StepUnits& units,
                     std::vector<std::uint16_t>& values) const {
  const Grid& grid = grids_[static_cast<std::size_t>(axis)];
  const std::array<std::int64_t, 3> strides = GridStrides(grid.size);
  const LineBits bits = BitsOf(map, grid, axis, orientation);
  const int place = place_[static_cast<std::size_t>(orientation)];
  std::uint16_t* const planes = &values[static_cast<std::size_t>(place * (grid.longest + 1)) * grid.cells];
  std::vector<std::uint32_t> cost(grid.cells);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> seeds;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> queue;
  for (int length = 2; length <= grid.longest; ++length) {
    std::uint16_t* const plane = planes + static_cast<std::size_t>(length) * grid.cells;
    if (length <= spread + 1) continue;  // a goal
    const auto whole = static_cast<std::uint32_t>((std::uint32_t{1} << length) - 1);
    std::ranges::fill(cost, kInfinite);
    seeds.clear();
    SplittingSteps(grid, bits, axis, length, units, planes, cost, seeds);
    SpreadByEqualSteps(
        seeds, units.free * static_cast<std::uint32_t>(length), cost, queue, [&](std::uint32_t at, auto relax) {
          for (const Direction d : kDirections) {
            if ((bits.leads[at] >> IndexOf(Opposite(d)) & 1) == 0) continue;
            const auto before = static_cast<std::uint32_t>(static_cast<std::int64_t>(at) -
                                                           SignOf(d) * strides[static_cast<std::size_t>(AxisOf(d))]);
            const std::uint32_t blocked = bits.blocked[static_cast<std::size_t>(IndexOf(d))][before];
            if (((bits.inside[before] | blocked) & whole) == 0) relax(before);
          }
        });
    for (std::size_t i = 0; i < grid.cells; ++i) {
      plane[i] = cost[i] == kInfinite ? kUnreachable
                                      : static_cast<std::uint16_t>(std::min<std::uint32_t>(cost[i], kUnreachable - 1));
    }
  }
}

LineHeuristic::LineHeuristic(const HypothesisSets& sets, std::shared_ptr<const LineTable> table,
                             std::shared_ptr<const PairCertificates> pairs)
    : sets_(sets), table_(std::move(table)) {
  isolated_.emplace(sets, std::move(pairs), UnitNeighbours());
}

LineHeuristic::LineHeuristic(const Problem& problem, const HypothesisSets& sets, std::shared_ptr<const LineTable> table,
                             std::shared_ptr<const OrientedPairs> oriented_pairs)
    : sets_(sets),
      table_(std::move(table)),
      oriented_isolated_(std::make_unique<OrientedHeuristic>(problem, sets, std::move(oriented_pairs))) {}

const LineHeuristic::Runs& LineHeuristic::Prepare(SetId set) {
  if (set >= runs_of_.size()) runs_of_.resize(sets_.count());
  Runs& runs = runs_of_[set];
  if (runs.ready) return runs;
  runs.ready = true;
  std::vector<std::pair<Cell, int>> members;
  sets_.ForEach(set, [&](const Cell& h, int o, std::uint32_t, int) { members.emplace_back(h, o); });
  for (int axis = 0; axis < 3; ++axis) {
    runs.first[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(runs_.size());
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    std::ranges::sort(members, {}, [&](const std::pair<Cell, int>& m) {
      return std::make_tuple(m.second, m.first[u], m.first[v], m.first[axis]);
    });
    for (std::size_t i = 0; i < members.size(); ++i) {
      const auto& [h, o] = members[i];
      Run* const last = i > 0 ? &runs_.back() : nullptr;
      if (last != nullptr && last->orientation == o && last->length < std::max(1, table_->longest(axis)) &&
          last->first[u] == h[u] && last->first[v] == h[v] && last->first[axis] + last->length == h[axis]) {
        ++last->length;
      } else {
        runs_.push_back({h, 1, o});
      }
    }
  }
  runs.first[3] = static_cast<std::uint32_t>(runs_.size());
  return runs;
}

double LineHeuristic::Weighted(SetId set, const Cell& robot) {
  if (sets_.info(set).goal || !sets_.uniform()) return 0.0;
  const Runs runs = Prepare(set);
  double best = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double sum = 0.0;
    for (std::uint32_t i = runs.first[axis]; i < runs.first[axis + 1]; ++i) {
      const Run& run = runs_[i];
      const std::uint16_t value = table_->At(robot - run.first, static_cast<int>(axis), run.length, run.orientation);
      if (value == LineTable::kUnreachable) return std::numeric_limits<double>::infinity();
      sum += value;
    }
    best = std::max(best, sum);
  }
  return best * table_->unit() +
         (isolated_ ? isolated_->Weighted(set, robot) : oriented_isolated_->Weighted(set, robot));
}

}  // namespace feeler::planner
