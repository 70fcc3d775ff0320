#include "feeler/planner/bounds/openings/open_heuristic.h"

#include <algorithm>
#include <utility>

namespace feeler::planner {

OpenHeuristic::OpenHeuristic(const HypothesisSets& sets, std::unique_ptr<BeliefHeuristic> other,
                             std::shared_ptr<const ContactMap> filled, std::shared_ptr<const LookTable> looks)
    : sets_(sets), other_(std::move(other)), filled_(std::move(filled)), looks_(std::move(looks)) {}

void OpenHeuristic::AddParts(const Bits256& bits, const Cell& corner, std::uint32_t slab,
                             std::vector<Part>& parts) const {
  if (!bits.Any()) return;
  Cell low(LookTable::kLongest, LookTable::kLongest, 0);
  Cell high(-1, -1, 0);
  bits.ForEach([&](int bit) {
    const Cell h(bit & 15, bit >> 4, 0);
    low = low.cwiseMin(h);
    high = high.cwiseMax(h);
  });
  for (int y = low.y(); y <= high.y(); y += looks_->largest().y()) {
    for (int x = low.x(); x <= high.x(); x += looks_->largest().x()) {
      const Cell size = Cell(high.x() - x + 1, high.y() - y + 1, 1).cwiseMin(looks_->largest());
      const int there = (bits & Rectangle(x, y, size.x(), size.y())).Count();
      if (there > 0) parts.push_back({corner + Cell(x, y, 0), size, size.x() * size.y() - there, slab});
    }
  }
}

const OpenHeuristic::Range& OpenHeuristic::Prepare(SetId set) {
  if (set >= ranges_.size()) ranges_.resize(sets_.count());
  Range& range = ranges_[set];
  if (range.ready) return range;
  range.first = static_cast<std::uint32_t>(parts_.size());
  std::uint32_t k = 0;
  for (const Slab& slab : sets_.slabs(set)) AddParts(slab.bits, sets_.Corner(slab.layer), k++, parts_);
  range.count = static_cast<std::uint32_t>(parts_.size()) - range.first;
  range.ready = true;
  return range;
}

double OpenHeuristic::Outside(const Slab& slab, const Part& part, const Cell& robot) const {
  const Cell& corner = sets_.Corner(slab.layer);
  const Cell at = part.low - corner;
  Bits256 outside;
  bool any_inside = false;
  (slab.bits & Rectangle(at.x(), at.y(), part.size.x(), part.size.y())).ForEach([&](int bit) {
    if (filled_->Blocked(robot - corner - Cell(bit & 15, bit >> 4, 0))) {
      any_inside = true;
    } else {
      outside.Set(bit);
    }
  });
  if (!any_inside) return looks_->At(robot - part.low, part.size, part.gone);
  std::vector<Part> parts;
  AddParts(outside, corner, part.slab, parts);
  double sum = 0.0;
  for (const Part& left : parts) sum += looks_->At(robot - left.low, left.size, left.gone);
  return sum;
}

double OpenHeuristic::Weighted(SetId set, const Cell& robot) {
  const double other = other_->Weighted(set, robot);
  if (sets_.info(set).goal || !sets_.uniform()) return other;
  const Range range = Prepare(set);
  double sum = 0.0;
  for (std::uint32_t i = range.first; i < range.first + range.count; ++i) {
    const Part& part = parts_[i];
    const Cell displacement = robot - part.low;
    sum += looks_->MayBeInside(displacement) ? Outside(sets_.slabs(set)[part.slab], part, robot)
                                             : looks_->At(displacement, part.size, part.gone);
  }
  return std::max(other, sum);
}

std::size_t OpenHeuristic::bytes() const {
  return other_->bytes() + ranges_.capacity() * sizeof(Range) + parts_.capacity() * sizeof(Part);
}

}  // namespace feeler::planner
