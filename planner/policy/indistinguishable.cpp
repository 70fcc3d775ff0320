#include "feeler/planner/policy/indistinguishable.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <tuple>

#include "feeler/planner/belief/hypothesis_sets.h"

namespace feeler::planner {
namespace {

using Slabs = std::vector<Slab>;

class Refiner {
 public:
  Refiner(const Problem& problem, const ContactMasks& masks) : problem_(problem), masks_(masks), sets_(problem, false) {
    const HypothesisSets::Info& info = sets_.info(sets_.start());
    // Further out than this the contact map repeats itself.
    const CellBox& domain = problem.map->domain();
    box_ = {(domain.min + info.low - Cell::Constant(2)).cwiseMax(problem.workspace.min),
            (domain.max + info.high + Cell::Constant(2)).cwiseMin(problem.workspace.max)};
    box_ = {box_.min.cwiseMin(problem.start), box_.max.cwiseMax(problem.start)};
    visited_.assign(static_cast<std::size_t>(box_.Count()), 0);
  }

  /// The classes of more than one member.
  std::vector<Slabs> Classes() {
    std::vector<Slabs> classes;
    const auto all = sets_.slabs(sets_.start());
    std::vector<Slabs> open = {{all.begin(), all.end()}};
    while (!open.empty()) {
      const Slabs part = std::move(open.back());
      open.pop_back();
      if (Size(part) == 1) continue;
      std::vector<Slabs> parts = Split(part);
      if (parts.size() == 1) {
        classes.push_back(std::move(parts.front()));
      } else {
        for (Slabs& p : parts) open.push_back(std::move(p));
      }
    }
    return classes;
  }

  std::vector<int> Indices(const Slabs& slabs) const {
    std::map<std::tuple<int, int, int, int>, int> index;
    for (std::size_t i = 0; i < problem_.hypotheses.size(); ++i) {
      const Hypothesis& h = problem_.hypotheses[i];
      index[{h.offset.x(), h.offset.y(), h.offset.z(), h.orientation}] = static_cast<int>(i);
    }
    std::vector<int> indices;
    for (const Slab& slab : slabs) {
      slab.bits.ForEach([&](int bit) {
        const Cell h = sets_.Corner(slab.layer) + Cell(bit & 15, bit >> 4, 0);
        indices.push_back(index.at({h.x(), h.y(), h.z(), sets_.Orientation(slab.layer)}));
      });
    }
    std::ranges::sort(indices);
    return indices;
  }

 private:
  static int Size(const Slabs& slabs) {
    int size = 0;
    for (const Slab& slab : slabs) size += slab.bits.Count();
    return size;
  }

  /// Splits every part by `hit`: members in it, members not in it.
  static void Refine(std::vector<Slabs>& parts, const Slabs& hit) {
    const std::size_t count = parts.size();
    for (std::size_t i = 0; i < count; ++i) {
      Slabs in;
      Slabs out;
      for (const Slab& slab : parts[i]) {
        const auto same = std::ranges::find(hit, slab.layer, &Slab::layer);
        const Bits256 both = same == hit.end() ? Bits256{} : slab.bits & same->bits;
        const Bits256 rest = slab.bits.Without(both);
        if (both.Any()) in.push_back({slab.layer, both});
        if (rest.Any()) out.push_back({slab.layer, rest});
      }
      if (in.empty() || out.empty()) continue;
      parts[i] = std::move(in);
      parts.push_back(std::move(out));
    }
  }

  std::vector<Slabs> Split(const Slabs& whole) {
    std::vector<Slabs> parts = {whole};
    const auto size = static_cast<std::size_t>(Size(whole));
    ++flood_;
    const Cell extent = box_.Size();
    const auto index = [&](const Cell& c) {
      const Cell o = c - box_.min;
      return static_cast<std::size_t>((std::int64_t{o.z()} * extent.y() + o.y()) * extent.x() + o.x());
    };
    std::vector<Cell> queue = {problem_.start};
    visited_[index(problem_.start)] = flood_;
    Slabs hit;
    for (std::size_t at = 0; at < queue.size() && parts.size() < size; ++at) {
      for (const Direction d : kDirections) {
        const Cell next = queue[at] + UnitCell(d);
        if (!box_.Contains(next)) continue;
        hit.clear();
        for (const Slab& slab : whole) {
          const Bits256& mask =
              masks_.Mask(masks_.Index(queue[at] - sets_.Corner(slab.layer), d, sets_.Orientation(slab.layer)));
          const Bits256 both = slab.bits & mask;
          if (both.Any()) hit.push_back({slab.layer, both});
        }
        if (hit.empty()) {
          std::uint32_t& mark = visited_[index(next)];
          if (mark != flood_) {
            mark = flood_;
            queue.push_back(next);
          }
        } else if (hit != last_) {
          Refine(parts, hit);
          last_ = hit;
        }
      }
    }
    last_.clear();
    return parts;
  }

  const Problem& problem_;
  const ContactMasks& masks_;
  HypothesisSets sets_;
  CellBox box_;
  std::vector<std::uint32_t> visited_;
  std::uint32_t flood_ = 0;
  Slabs last_;
};

}  // namespace

std::vector<std::pair<int, int>> IndistinguishablePairs(const Problem& problem, const ContactMasks& masks,
                                                        std::size_t most_pairs) {
  std::vector<std::pair<int, int>> pairs;
  Refiner refiner(problem, masks);
  for (const auto& slabs : refiner.Classes()) {
    const std::vector<int> members = refiner.Indices(slabs);
    for (std::size_t i = 0; i < members.size() && pairs.size() < most_pairs; ++i) {
      for (std::size_t j = i + 1; j < members.size() && pairs.size() < most_pairs; ++j) {
        const Hypothesis& a = problem.hypotheses[static_cast<std::size_t>(members[i])];
        const Hypothesis& b = problem.hypotheses[static_cast<std::size_t>(members[j])];
        if (!IsGoal(problem, {a, b})) pairs.emplace_back(members[i], members[j]);
      }
    }
  }
  std::ranges::sort(pairs);
  return pairs;
}

std::int64_t CountIndistinguishablePairs(const Problem& problem, const ContactMasks& masks) {
  std::int64_t pairs = 0;
  Refiner refiner(problem, masks);
  for (const auto& slabs : refiner.Classes()) {
    const std::vector<int> members = refiner.Indices(slabs);
    const auto n = static_cast<std::int64_t>(members.size());
    if (problem.goal == GoalKind::kSingleton) {
      pairs += n * (n - 1) / 2;
      continue;
    }
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t j = i + 1; j < members.size(); ++j) {
        const Hypothesis& a = problem.hypotheses[static_cast<std::size_t>(members[i])];
        const Hypothesis& b = problem.hypotheses[static_cast<std::size_t>(members[j])];
        if (!IsGoal(problem, {a, b})) ++pairs;
      }
    }
  }
  return pairs;
}

}  // namespace feeler::planner
