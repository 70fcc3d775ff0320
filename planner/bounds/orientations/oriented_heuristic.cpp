#include "feeler/planner/bounds/orientations/oriented_heuristic.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <utility>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/belief/neighbour_masks.h"

namespace feeler::planner {

OrientedHeuristic::OrientedHeuristic(const Problem& problem, const HypothesisSets& sets,
                                     std::shared_ptr<const OrientedCertificates> table,
                                     std::shared_ptr<const OrientedPairs> pairs,
                                     std::shared_ptr<const OrientedLines> lines)
    : sets_(sets),
      table_(std::move(table)),
      pairs_(std::move(pairs)),
      lines_(sets.uniform() ? std::move(lines) : nullptr),
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

const OrientedPairs::Plane& OrientedHeuristic::PairPlane(const Member& one, const Member& other) {
  const Cell offset = other.offset - one.offset;
  std::shared_ptr<const OrientedPairs::Plane>& plane =
      pair_planes_[{offset.x(), offset.y(), offset.z(), one.orientation, other.orientation}];
  if (!plane) plane = pairs_->Get(offset, one.orientation, other.orientation);
  return *plane;
}

/// Members that share a place, by place; within it by the lines that they are on.
void OrientedHeuristic::FindGroups(SetId set, Terms& terms) {
  const HypothesisSets::Info& info = sets_.info(set);
  const Cell size = info.high - info.low + Cell::Ones();
  const auto place_of = [&](const Member& member) { return GridIndex(size, member.offset - info.low); };
  // By place; within it they stay in order.
  std::vector<std::uint32_t> ends(static_cast<std::size_t>(size.prod()) + 1, 0);
  for (const Member& member : members_) ++ends[place_of(member) + 1];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<std::uint32_t> order(members_.size());
  for (std::uint32_t i = 0; i < members_.size(); ++i) order[ends[place_of(members_[i])]++] = i;
  terms.first_place = static_cast<std::uint32_t>(places_.size());
  std::size_t begin = 0;
  for (const std::uint32_t end : ends) {
    if (end <= begin) continue;
    Place place{members_[order[begin]].offset, static_cast<std::uint32_t>(groups_.size()), {}};
    for (const OrientedLines::Axis axis : {OrientedLines::kYaw, OrientedLines::kPitch}) {
      on_line_.clear();
      for (std::size_t k = begin; k < end; ++k) {
        const int orientation = members_[order[k]].orientation;
        const int line = lines_->PlaceOf(axis, orientation).line;
        on_line_.emplace_back(line < 0 ? -1 - orientation : line, order[k]);
      }
      std::ranges::sort(on_line_);
      for (auto next = on_line_.begin(); next != on_line_.end();) {
        const int line = next->first;
        Group group{{}, nullptr, static_cast<std::uint32_t>(grouped_.size()), 0};
        unsigned subset = 0;
        for (; next != on_line_.end() && next->first == line; ++next, ++group.count) {
          grouped_.push_back(next->second);
          if (line >= 0) subset |= 1U << lines_->PlaceOf(axis, members_[next->second].orientation).bit;
        }
        if (group.count > 1) {
          group.values = lines_->PlaneOf(line, subset);
          group.box = &lines_->box(line);
        }
        groups_.push_back(group);
        ++place.count[axis];
      }
    }
    places_.push_back(place);
    begin = end;
  }
  terms.places = static_cast<std::uint32_t>(places_.size()) - terms.first_place;
}

std::size_t OrientedHeuristic::PreparedBytes() const {
  return runs_.capacity() * sizeof(Run) + weights_.capacity() * sizeof(double) + places_.capacity() * sizeof(Place) +
         groups_.capacity() * sizeof(Group) + grouped_.capacity() * sizeof(std::uint32_t);
}

void OrientedHeuristic::Forget() {
  std::ranges::fill(terms_of_, Terms());
  runs_.clear();
  weights_.clear();
  places_.clear();
  groups_.clear();
  grouped_.clear();
  pair_planes_.clear();
}

OrientedHeuristic::Terms OrientedHeuristic::Prepare(SetId set) {
  if (set >= terms_of_.size()) terms_of_.resize(sets_.count());
  if (terms_of_[set].ready) return terms_of_[set];
  if (runs_.size() * sizeof(Run) + groups_.size() * sizeof(Group) + grouped_.size() * sizeof(std::uint32_t) >
      most_prepared_bytes_) {
    Forget();
  }
  FindMembers(set);
  Terms terms;
  terms.first = static_cast<std::uint32_t>(runs_.size());
  terms.members = static_cast<std::uint32_t>(members_.size());
  terms.ready = true;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& member = members_[i];
    const auto index = static_cast<std::uint32_t>(i);
    if (member.neighbours == 0) {
      const auto nearest = Nearest(i);
      if (!nearest) continue;
      const OrientedPairs::Plane& plane = PairPlane(member, members_[*nearest]);
      runs_.push_back({{}, plane.values.data(), &plane.box, member.offset, 1, index});
    } else if (table_ == nullptr) {
      continue;
    } else {
      const OrientedCertificates::Plane values = table_->PlaneOf(member.orientation, member.neighbours);
      Run* const last = runs_.size() > terms.first ? &runs_.back() : nullptr;
      if (uniform_ && last != nullptr && last->values.differences == values.differences &&
          member.offset == last->last + Cell(1, 0, 0)) {
        last->last = member.offset;
        ++last->length;
        continue;
      }
      runs_.push_back({values, nullptr, &table_->box(member.orientation), member.offset, 1, index});
    }
    if (!uniform_) weights_.push_back(member.weight);
  }
  terms.count = static_cast<std::uint32_t>(runs_.size()) - terms.first;
  if (lines_) FindGroups(set, terms);
  terms_of_[set] = terms;
  return terms;
}

/// False if some member cannot be told from its neighbours.
bool OrientedHeuristic::CostsOfMembers(const Terms& terms, const Cell& robot) {
  costs_.assign(terms.members, 0);
  for (std::uint32_t i = terms.first; i < terms.first + terms.count; ++i) {
    const Run& run = runs_[i];
    const Cell displacement = robot - run.last;
    const CellBox& domain = run.box->domain;
    std::uint32_t* const costs = &costs_[run.member + static_cast<std::uint32_t>(run.length - 1)];
    const bool tabled = domain.Contains(displacement) && displacement.x() + run.length - 1 <= domain.max.x();
    const std::size_t first = run.box->Index(displacement);
    const auto value_at = [&](std::size_t cell) { return run.pair != nullptr ? run.pair[cell] : run.values[cell]; };
    for (int k = 0; k < run.length; ++k) {
      std::uint8_t value = 0;
      std::uint32_t way_back = 0;
      if (tabled) {
        value = value_at(first + static_cast<std::size_t>(k));
      } else {
        const Cell at = displacement + Cell(k, 0, 0);
        value = value_at(run.box->Index(at));
        way_back = run.box->WayBack(at);
      }
      if (value == OrientedCertificates::kNone) return false;
      costs[-k] = value + way_back;
    }
  }
  return true;
}

/// In units of the lines; none where some line cannot be localized.
std::optional<std::uint64_t> OrientedHeuristic::SumOverPlaces(const Terms& terms, const Cell& robot) const {
  const std::uint32_t units = lines_->units_per_step();
  std::uint64_t sum = 0;
  for (std::uint32_t p = terms.first_place; p < terms.first_place + terms.places; ++p) {
    const Place& place = places_[p];
    const Cell displacement = robot - place.offset;
    std::uint64_t most = 0;
    std::uint32_t group = place.first;
    for (const std::uint32_t groups : place.count) {
      std::uint64_t of_parting = 0;
      for (const std::uint32_t end = group + groups; group < end; ++group) {
        const Group& of = groups_[group];
        std::uint32_t certificates = 0;
        for (std::uint32_t i = of.first; i < of.first + of.count; ++i) certificates += costs_[grouped_[i]];
        certificates *= units;
        if (of.values.differences != nullptr) {
          const std::uint16_t value = of.values[of.box->Index(displacement)];
          if (value == OrientedLines::kNone) return std::nullopt;
          certificates = std::max(certificates, value + of.count * units * of.box->WayBack(displacement));
        }
        of_parting += certificates;
      }
      most = std::max(most, of_parting);
    }
    sum += most;
  }
  return sum;
}

double OrientedHeuristic::Weighted(SetId set, const Cell& robot) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (sets_.info(set).goal) return 0.0;
  const Terms terms = Prepare(set);
  if (!CostsOfMembers(terms, robot)) return kInfinity;
  if (terms.places > 0) {
    const auto sum = SumOverPlaces(terms, robot);
    return sum ? static_cast<double>(*sum) * unit_ / lines_->units_per_step() : kInfinity;
  }
  if (uniform_) return unit_ * static_cast<double>(std::accumulate(costs_.begin(), costs_.end(), std::uint64_t{0}));
  double weighted = 0.0;
  for (std::uint32_t i = terms.first; i < terms.first + terms.count; ++i) {
    weighted += weights_[i] * static_cast<double>(costs_[runs_[i].member]);
  }
  return weighted * unit_;
}

}  // namespace feeler::planner
