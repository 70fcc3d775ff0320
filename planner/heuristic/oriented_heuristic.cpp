#include "planner/heuristic/oriented_heuristic.h"

#include <cstdlib>
#include <limits>
#include <utility>

#include "planner/heuristic/neighbour_masks.h"

namespace feeler::planner {

OrientedHeuristic::OrientedHeuristic(const Problem& problem, const HypothesisSets& sets,
                                     std::shared_ptr<const OrientedCertificates> table,
                                     std::shared_ptr<const OrientedPairs> pairs)
    : sets_(sets),
      table_(std::move(table)),
      pairs_(std::move(pairs)),
      unit_(pairs_->unit()),
      spread_(problem.goal == GoalKind::kInsertable ? problem.insertable_spread : Cell(Cell::Zero())),
      pitches_(problem.pitches),
      uniform_(sets.uniform()) {}

OrientedHeuristic::OrientedHeuristic(const Problem& problem, const HypothesisSets& sets,
                                     std::shared_ptr<const OrientedPairs> pairs)
    : OrientedHeuristic(problem, sets, nullptr, std::move(pairs)) {}

void OrientedHeuristic::FindMembers(SetId set) {
  members_.clear();
  const auto slabs = sets_.slabs(set);
  for (const Slab& slab : slabs) {
    const int orientation = sets_.Orientation(slab.layer);
    const Cell corner = sets_.Corner(slab.layer);
    // Per neighbour, the members of the slab that have it: the neighbour's slabs, moved onto this one.
    std::array<Bits256, OrientedCertificates::kMostNeighbours> with{};
    for (std::size_t i = 0; table_ == nullptr && i < kDirectionCount; ++i) {
      for (const Slab& theirs : slabs) {
        if (sets_.Orientation(theirs.layer) != orientation) continue;
        with[i] = with[i] | MembersWithNeighbour(slab.bits, corner, theirs.bits, sets_.Corner(theirs.layer),
                                                 UnitCell(kDirections[i]));
      }
    }
    for (std::size_t i = 0; table_ != nullptr && table_->Tabled(orientation) && i < table_->neighbours().size(); ++i) {
      const int other = table_->NeighbourOf(orientation, i);
      if (other < 0) continue;
      const Cell& by = table_->neighbours()[i].offset;
      for (const Slab& theirs : slabs) {
        if (sets_.Orientation(theirs.layer) != other) continue;
        with[i] = with[i] | MembersWithNeighbour(slab.bits, corner, theirs.bits, sets_.Corner(theirs.layer), by);
      }
    }
    slab.bits.ForEach([&](int bit) {
      Member member{corner + Cell(bit & 15, bit >> 4, 0), orientation, sets_.Weight(slab.layer, bit), 0};
      for (std::size_t i = 0; i < with.size(); ++i) member.neighbours |= (with[i].Test(bit) ? 1U : 0U) << i;
      members_.push_back(member);
    });
  }
}

std::optional<std::size_t> OrientedHeuristic::Nearest(std::size_t member) const {
  const Member& me = members_[member];
  std::optional<std::size_t> nearest;
  int distance = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& other = members_[i];
    const Cell apart = (other.offset - me.offset).cwiseAbs();
    if (other.orientation == me.orientation && (apart.array() <= spread_.array()).all()) continue;
    const int from_here = apart.sum() + std::abs(other.orientation / pitches_ - me.orientation / pitches_) +
                          std::abs(other.orientation % pitches_ - me.orientation % pitches_);
    if (from_here >= distance) continue;
    distance = from_here;
    nearest = i;
  }
  return nearest;
}

OrientedHeuristic::Terms OrientedHeuristic::Prepare(SetId set) {
  if (set >= terms_of_.size()) terms_of_.resize(sets_.count());
  if (terms_of_[set].ready) return terms_of_[set];
  FindMembers(set);
  Terms terms{static_cast<std::uint32_t>(runs_.size()), 0, true};
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& member = members_[i];
    if (member.neighbours == 0) {
      const auto nearest = Nearest(i);
      if (!nearest) continue;
      const OrientedPairs::Plane& plane =
          pairs_->Get(members_[*nearest].offset - member.offset, member.orientation, members_[*nearest].orientation);
      runs_.push_back({plane.values.data(), &plane.box, member.offset, 1});
    } else if (table_ == nullptr) {
      continue;
    } else {
      const std::uint8_t* const values = table_->Plane(member.orientation, member.neighbours);
      Run* const last = runs_.size() > terms.first ? &runs_.back() : nullptr;
      if (uniform_ && last != nullptr && last->values == values && member.offset == last->last + Cell(1, 0, 0)) {
        last->last = member.offset;
        ++last->length;
        continue;
      }
      runs_.push_back({values, &table_->box(member.orientation), member.offset, 1});
    }
    if (!uniform_) weights_.push_back(member.weight);
  }
  terms.count = static_cast<std::uint32_t>(runs_.size()) - terms.first;
  terms_of_[set] = terms;
  return terms;
}

double OrientedHeuristic::Weighted(SetId set, const Cell& robot) {
  if (sets_.info(set).goal) return 0.0;
  const Terms terms = Prepare(set);
  std::uint64_t sum = 0;
  double weighted = 0.0;
  for (std::uint32_t i = terms.first; i < terms.first + terms.count; ++i) {
    const Run& run = runs_[i];
    const Cell displacement = robot - run.last;
    const CellBox& domain = run.box->domain;
    std::uint64_t of_run = 0;
    if (domain.Contains(displacement) && displacement.x() + run.length - 1 <= domain.max.x()) {
      const std::uint8_t* const values = run.values + run.box->Index(displacement);
      for (int k = 0; k < run.length; ++k) {
        if (values[k] == OrientedCertificates::kNone) return std::numeric_limits<double>::infinity();
        of_run += values[k];
      }
    } else {
      for (int k = 0; k < run.length; ++k) {
        const Cell at = displacement + Cell(k, 0, 0);
        const std::uint8_t value = run.values[run.box->Index(at)];
        if (value == OrientedCertificates::kNone) return std::numeric_limits<double>::infinity();
        of_run += value + run.box->WayBack(at);
      }
    }
    if (uniform_) {
      sum += of_run;
    } else {
      weighted += weights_[i] * static_cast<double>(of_run);
    }
  }
  return (uniform_ ? static_cast<double>(sum) : weighted) * unit_;
}

}  // namespace feeler::planner
