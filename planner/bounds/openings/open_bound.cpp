#include "feeler/planner/bounds/openings/open_bound.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>

#include "feeler/core/lattice_grid.h"

// The proof is in docs/planner.md, "The open socket"; (O1) to (O7) are its inequalities. Here: the tables, the layers
// of a belief, the places where a layer may split. What a place costs: open_place.cpp.
namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kFirstRadius = 48;
/// Of rows of up to this many further members all are mates, of longer ones those within reach: certificates get weaker
/// the more mates there are, but then more openings have to be looked into to leave a member without.
constexpr int kWholeRow = 5;
constexpr int kMateReach = 3;

CellBox Around(const Bits256& members, const CellBox& mouths) {
  CellBox box{Cell(16, 16, 0), Cell(-1, -1, 0)};
  members.ForEach([&](int bit) {
    const Cell h(bit & 15, bit >> 4, 0);
    box.min = box.min.cwiseMin(h);
    box.max = box.max.cwiseMax(h);
  });
  return {box.min + mouths.min, box.max + mouths.max};
}

OpenBound::Openings FindOpenings(const ContactMap& open, const ContactMap& filled, int orientation) {
  OpenBound::Openings openings;
  openings.box = {Cell::Constant(1 << 20), Cell::Constant(-(1 << 20))};
  ForEachCell(open.domain(), [&](const Cell& here) {
    if (filled.Blocked(here, orientation)) return;
    const auto* const into = std::ranges::find_if(kDirections, [&](Direction d) {
      return open.StepFree(here, d, orientation) && !filled.StepFree(here, d, orientation);
    });
    if (into == kDirections.end()) return;
    openings.directions.push_back(*into);
    openings.mouths.push_back(here);
    openings.box = {openings.box.min.cwiseMin(here), openings.box.max.cwiseMax(here)};
  });
  return openings;
}

}  // namespace

OpenBound::OpenBound(const ContactMap& open, std::shared_ptr<const ContactMap> filled, const ContactMasks& masks,
                     std::shared_ptr<const CertificateTable> certificates, const StepCosts& costs, const Cell& spread)
    : filled_(std::move(filled)),
      masks_(masks),
      certificates_(std::move(certificates)),
      costs_(costs),
      spread_(spread),
      mates_(filled_, costs, spread) {
  planes_.resize(certificates_->grid().cells * 16 * static_cast<std::size_t>(open.orientations()));
  for (int o = 0; o < open.orientations(); ++o) {
    openings_.push_back(FindOpenings(open, *filled_, o));
    FillPlanes(o);
  }
}

void OpenBound::FillPlanes(int orientation) {
  const CertificateGrid& grid = certificates_->grid();
  const double per_step = grid.unit / costs_.free;
  const auto plane_of = [&](int mask) {
    return planes_.data() + static_cast<std::size_t>(orientation * 16 + mask) * grid.cells;
  };
  for (int mask = 0; mask < 16; ++mask) {
    float* const plane = plane_of(mask);
    for (std::size_t i = 0; i < grid.cells; ++i) {
      std::uint16_t least = CertificateTable::kUnreachable;
      for (const int along_x : {1, 2}) {
        for (const int along_y : {4, 8}) {
          const int one = ((mask & 3) == 0 ? 0 : along_x) | ((mask & 12) == 0 ? 0 : along_y);
          if ((one & mask) != one) continue;
          const std::size_t at =
              static_cast<std::size_t>(orientation * CertificateTable::kMasks + one) * grid.cells + i;
          least = std::min(least, certificates_->values()[at]);
        }
      }
      // The walk may begin in the middle of a motion, which has been paid for.
      const auto rest = static_cast<float>(per_step * (least - std::min<std::uint32_t>(least, grid.start_units)));
      plane[i] =
          least == CertificateTable::kUnreachable ? MateCertificates::kNone : std::min(rest, MateCertificates::kNone);
    }
  }
  ForEachCell(grid.domain, [&](const Cell& here) {
    if (!filled_->Blocked(here, orientation)) return;
    for (int mask = 0; mask < 16; ++mask) plane_of(mask)[grid.Index(here)] = -1.0F;
  });
}

double OpenBound::Weighted(const HypothesisSets& sets, SetId set, const Cell& robot) const {
  const HypothesisSets::Info& info = sets.info(set);
  if (info.goal || !sets.uniform()) return 0.0;
  double sum = 0.0;
  for (const Slab& slab : sets.slabs(set)) {
    sum += LayerBound(slab.bits, sets.Orientation(slab.layer), robot - sets.Corner(slab.layer));
  }
  return sum * costs_.free;
}

double OpenBound::LayerBound(const Bits256& bits, int orientation, const Cell& robot) const {
  const int count = bits.Count();
  const int left = std::min<int>(count, (spread_.x() + 1) * (spread_.y() + 1));  // what a goal may leave of the layer
  if (count <= left || openings(orientation).mouths.empty()) return 0.0;
  const Key key{bits.word, orientation, {robot.x(), robot.y(), robot.z()}};
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = known_.find(key); known != known_.end()) return known->second;
  }
  std::optional<OpenLayer> layer = MakeLayer(bits, orientation, robot);
  if (!layer) return 0.0;
  // (O4) Without a split openings are looked into until the rest is a goal.
  const auto looks = static_cast<std::size_t>(count - left);
  const double all_looked_into = layer->slots_before[looks] + left * layer->slots[looks - 1];
  const double bound = LeastOverPlaces(bits, robot, all_looked_into, *layer);
  const std::lock_guard lock(mutex_);
  if (known_.size() >= kMostKnown) known_.clear();
  known_.emplace(key, bound);
  return bound;
}

std::optional<OpenLayer> OpenBound::MakeLayer(const Bits256& bits, int orientation, const Cell& robot) const {
  const Openings& openings = openings_[static_cast<std::size_t>(orientation)];
  OpenLayer layer;
  layer.orientation = orientation;
  layer.mouths = Around(bits, openings.box);
  std::map<std::array<int, 3>, int> openings_at;
  std::vector<double> earliest;  // e(k) of (O1), once sorted
  bool inside = false;
  bits.ForEach([&](int bit) {
    OpenLayer::Member member;
    member.h = Cell(bit & 15, bit >> 4, 0);
    inside = inside || filled_->Blocked(robot - member.h, orientation);
    layer.index[static_cast<std::size_t>(bit)] = static_cast<int>(layer.members.size());
    double least = kInfinity;
    for (const Cell& mouth : openings.mouths) {
      const Cell at = member.h + mouth;
      least = std::min<double>(least, Distance(robot, at));
      layer.each = std::max(layer.each, ++openings_at[{at.x(), at.y(), at.z()}]);
    }
    earliest.push_back(least);
    layer.members.push_back(member);
  });
  if (inside) return std::nullopt;  // already in an opening
  layer.single = layer.each == 1 && openings.mouths.size() == 1 && spread_.isZero();
  FindNeighbours(bits, layer);
  FindMates(bits, layer);
  std::ranges::sort(earliest);
  layer.first = earliest.front();
  layer.slots_before.push_back(0.0);
  for (std::size_t k = 0; k < layer.members.size(); ++k) {
    layer.slots.push_back(std::max(layer.first + layer.StepsOf(k), earliest[k]));
    layer.slots_before.push_back(layer.slots_before.back() + layer.slots.back());
  }
  return layer;
}

void OpenBound::FindNeighbours(const Bits256& bits, OpenLayer& layer) const {
  for (OpenLayer::Member& member : layer.members) {
    for (std::size_t i = 0; i < 4; ++i) {
      const Cell at = member.h + certificates_->neighbours()[i];
      if ((at.array() < 0).any() || at.x() > 15 || at.y() > 15 || at.z() != 0 || !bits.Test(at.x() + 16 * at.y())) {
        continue;
      }
      member.mask |= 1 << i;
      member.neighbour[i] = layer.index[static_cast<std::size_t>(at.x() + 16 * at.y())];
    }
  }
}

void OpenBound::FindMates(const Bits256& bits, OpenLayer& layer) const {
  const CellBox box = Around(bits, {Cell::Zero(), Cell::Zero()});
  std::array<int, 2> reach{};
  for (int axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const int span = box.max[axis] - box.min[axis];
    reach[i] = std::max(1, span - spread_[axis] <= kWholeRow ? span - spread_[axis] : kMateReach);
    layer.alone_by_one[i] = span <= reach[i] + spread_[axis] ? 1 : 2;
  }
  layer.mates = &mates_.Within(reach, layer.orientation);
  for (OpenLayer::Member& member : layer.members) {
    for (int axis = 0; axis < 2; ++axis) {
      for (int i = 1; i <= reach[static_cast<std::size_t>(axis)]; ++i) {
        for (const int sign : {-1, 1}) {
          Cell at = member.h;
          at[axis] += sign * (i + spread_[axis]);
          if (at[axis] < 0 || at[axis] > 15 || !bits.Test(at.x() + 16 * at.y())) continue;
          ++member.mates[static_cast<std::size_t>(axis)];
        }
      }
    }
  }
}

/// What a step tells apart depends on its mask alone.
struct OpenBound::Split {
  bool splits = false;
  CellBox blocked;  ///< mouths of those under which it is blocked
  CellBox free;
  Bits256 blocked_members;
  Bits256 free_members;
  std::array<double, 2> off_path = {kInfinity, kInfinity};  ///< where the free, the blocked leave
  std::array<double, 2> off_rest = {kInfinity, kInfinity};
};

/// The places within a radius of the tool at which a step tells members apart, by distance.
OpenBound::Places OpenBound::FindPlaces(const Bits256& bits, const Cell& robot, const CellBox& box, int radius,
                                        OpenLayer& layer) const {
  const CellBox& around = openings(layer.orientation).box;
  std::unordered_map<std::uint32_t, Split> splits;
  Places places(static_cast<std::size_t>(radius) + 1);
  const auto split_of = [&](std::uint32_t mask) -> Split& {
    const auto [at, added] = splits.try_emplace(mask);
    Split& split = at->second;
    if (!added) return split;
    split.blocked_members = bits & masks_.Mask(mask);
    split.free_members = bits.Without(masks_.Mask(mask));
    split.splits = split.blocked_members.Any() && split.free_members.Any();
    if (!split.splits) return split;
    split.blocked = Around(split.blocked_members, around);
    split.free = Around(split.free_members, around);
    return split;
  };
  const auto look = [&](const Cell& place) {
    const int distance = Distance(robot, place);
    bool any = false;
    for (const Direction d : kDirections) {
      const std::uint32_t mask = masks_.Index(place, d, layer.orientation);
      if (mask == 0) continue;
      Split& split = split_of(mask);
      if (!split.splits) continue;
      any = true;
      // Those leave the main path whose mouths are further away.
      const int to_blocked = Distance(place, split.blocked);
      const int to_free = Distance(place, split.free);
      const std::size_t leave = to_blocked >= to_free ? 1 : 0;
      const double way = std::max(to_blocked, to_free);
      split.off_path[leave] = std::min(split.off_path[leave], distance + way);
      split.off_rest[leave] = std::min(split.off_rest[leave], way);
    }
    if (any) places[static_cast<std::size_t>(distance)].push_back(place);
  };
  const Cell low = box.min.cwiseMax(Cell(robot - Cell::Constant(radius)));
  const Cell high = box.max.cwiseMin(Cell(robot + Cell::Constant(radius)));
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      const int room = radius - std::abs(z - robot.z()) - std::abs(y - robot.y());
      const int end = std::min(high.x(), robot.x() + room);
      for (int x = std::max(low.x(), robot.x() - room); x <= end; ++x) look(Cell(x, y, z));
    }
  }
  for (OpenLayer::Member& member : layer.members) {
    member.off_path = layer.outside;
    member.off_rest = kInfinity;
  }
  for (const auto& entry : splits) LowerOff(entry.second, layer);
  return places;
}

void OpenBound::LowerOff(const Split& split, OpenLayer& layer) {
  if (!split.splits) return;
  for (const std::size_t leave : {0, 1}) {
    if (split.off_path[leave] == kInfinity) continue;
    const Bits256& leaving = leave == 1 ? split.blocked_members : split.free_members;
    leaving.ForEach([&](int bit) {
      OpenLayer::Member& member = layer.members[static_cast<std::size_t>(layer.index[static_cast<std::size_t>(bit)])];
      member.off_path = std::min(member.off_path, split.off_path[leave]);
      member.off_rest = std::min(member.off_rest, split.off_rest[leave]);
    });
  }
}

double OpenBound::LeastOverPlaces(const Bits256& bits, const Cell& robot, double without_split,
                                  OpenLayer& layer) const {
  const OpenCertificates certificates{certificates_->grid(), planes_};
  const CellBox& domain = filled_->domain();
  const CellBox box{domain.min.cwiseMin(robot).cwiseMin(layer.mouths.min) - Cell::Ones(),
                    (domain.max + Cell(15, 15, 0)).cwiseMax(robot).cwiseMax(layer.mouths.max) + Cell::Ones()};
  const Cell furthest = (box.max - robot).cwiseMax(Cell(robot - box.min));
  const std::size_t count = layer.members.size();
  for (int radius = kFirstRadius;; radius *= 2) {
    // Where the radius takes in all that is not repeated beyond the map, nothing is left out.
    layer.outside = furthest.sum() <= radius ? kInfinity : radius + 1.0;
    const Places places = FindPlaces(bits, robot, box, radius, layer);
    // If the first split is further than the radius.
    double beyond = kInfinity;
    for (std::size_t m = 0; m < count; ++m) {
      const double delay = m == 0 ? 0.0 : layer.first + layer.StepsOf(m - 1);
      beyond =
          std::min(beyond, layer.slots_before[m] + static_cast<double>(count - m) * std::max(layer.outside, delay));
    }
    std::priority_queue<OpenPlace, std::vector<OpenPlace>, std::greater<>> queue;
    double least = std::min(without_split, beyond);
    for (int distance = 0; distance <= radius; ++distance) {
      for (const Cell& cell : places[static_cast<std::size_t>(distance)]) {
        OpenPlace place{cell, distance, 0.0};
        place.bound = RoughBound(certificates, layer, place);
        if (place.bound < least) queue.push(place);
      }
    }
    for (; !queue.empty() && queue.top().bound < least; queue.pop()) {
      least = std::min(least, RefinedBound(certificates, layer, queue.top()));
    }
    if (least < beyond || layer.outside == kInfinity) return least;
  }
}

std::size_t OpenBound::bytes() const {
  const std::lock_guard lock(mutex_);
  return planes_.size() * sizeof(float) + mates_.bytes() + known_.size() * sizeof(std::pair<const Key, double>);
}

}  // namespace feeler::planner
