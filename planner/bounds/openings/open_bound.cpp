#include "feeler/planner/bounds/openings/open_bound.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>

namespace feeler::planner {
namespace {

/// Steps that looking into so many openings takes at least, where a place serves `each` of them.
double Rounded(int looks, int each) {
  const int steps = looks / each;
  return steps;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kFirstRadius = 48;
/// Of rows of up to this many further members all are mates, of longer ones those within reach: certificates get weaker
/// the more mates there are, but then more openings have to be looked into to leave a member without.
constexpr int kWholeRow = 5;
constexpr int kMateReach = 3;

int Distance(const Cell& a, const Cell& b) { return (a - b).cwiseAbs().sum(); }
int Distance(const Cell& a, const CellBox& box) { return Distance(a, box.Clamp(a)); }

CellBox Around(const Bits256& members, const CellBox& mouths) {
  CellBox box{Cell(16, 16, 0), Cell(-1, -1, 0)};
  members.ForEach([&](int bit) {
    const Cell h(bit & 15, bit >> 4, 0);
    box.min = box.min.cwiseMin(h);
    box.max = box.max.cwiseMax(h);
  });
  return {box.min + mouths.min, box.max + mouths.max};
}

/// What is saved at most by looking into up to `count` openings, `each` at a time, that save `gain` apiece when looked
/// into at time 0 and one less with every step.
double Savings(double gain, int count, int each) {
  if (gain <= 0.0 || count <= 0) return 0.0;
  const double rounds = std::min(std::ceil(gain), std::ceil(static_cast<double>(count) / each));
  return each * (rounds * gain - 0.5 * rounds * (rounds - 1.0));
}

}  // namespace

/// One layer of a belief: its members, the tool, and what does not depend on the place of the first split.
struct OpenBound::Layer {
  struct Member {
    Cell h;
    int mask = 0;                    ///< which of the neighbours +x, -x, +y, -y are members
    std::array<int, 4> neighbour{};  ///< their indices
    std::array<int, 2> mates{};      ///< members of its row, of its column, within reach
    double off_path = kInfinity;     ///< least cost of looking into an opening off the main path
    double off_rest = kInfinity;     ///< the same from where the member leaves the main path
  };
  std::vector<Member> members;
  int orientation = 0;
  int each = 1;    ///< openings that can be looked into from one place
  CellBox mouths;  ///< of all members
  const MateCertificates::Table* mates = nullptr;
  std::array<int, 2> alone_by_one{1, 1};  ///< to how many members without a mate left one opening can have contributed
  double first = 0.0;                     ///< no opening is looked into before
  std::vector<double> slots;         ///< the k-th opening of the main path is looked into at this time at the earliest
  std::vector<double> slots_before;  ///< sums of the first k of them
  double outside = kInfinity;        ///< places of splits at least so far away are not looked at
};

/// A place from which some step tells members apart on the filled map.
struct OpenBound::Candidate {
  Cell place = Cell::Zero();
  int distance = 0;
  bool refined = false;
  double bound = 0.0;
  bool operator>(const Candidate& o) const { return bound > o.bound; }
};

OpenBound::OpenBound(const ContactMap& open, std::shared_ptr<const ContactMap> filled, const ContactMasks& masks,
                     std::shared_ptr<const CertificateTable> certificates, const StepCosts& costs, const Cell& spread)
    : filled_(std::move(filled)),
      masks_(masks),
      certificates_(std::move(certificates)),
      costs_(costs),
      spread_(spread),
      mates_(filled_, costs, spread) {
  const CellBox& domain = open.domain();
  const CertificateGrid& grid = certificates_->grid();
  const double per_step = grid.unit / costs_.free;
  planes_.resize(grid.cells * 16 * static_cast<std::size_t>(open.orientations()));
  for (int o = 0; o < open.orientations(); ++o) {
    Openings openings;
    openings.box = {Cell::Constant(1 << 20), Cell::Constant(-(1 << 20))};
    for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
      for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
        for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
          const Cell here(x, y, z);
          if (filled_->Blocked(here, o)) continue;
          const auto* const into = std::ranges::find_if(
              kDirections, [&](Direction d) { return open.StepFree(here, d, o) && !filled_->StepFree(here, d, o); });
          if (into == kDirections.end()) continue;
          openings.directions.push_back(*into);
          openings.mouths.push_back(here);
          openings.box = {openings.box.min.cwiseMin(here), openings.box.max.cwiseMax(here)};
        }
      }
    }
    openings_.push_back(std::move(openings));

    for (int mask = 0; mask < 16; ++mask) {
      float* const plane = planes_.data() + static_cast<std::size_t>(o * 16 + mask) * grid.cells;
      for (std::size_t i = 0; i < grid.cells; ++i) {
        std::uint16_t least = CertificateTable::kUnreachable;
        for (const int along_x : {1, 2}) {
          for (const int along_y : {4, 8}) {
            const int one = ((mask & 3) == 0 ? 0 : along_x) | ((mask & 12) == 0 ? 0 : along_y);
            if ((one & mask) != one) continue;
            const std::size_t at = static_cast<std::size_t>(o * CertificateTable::kMasks + one) * grid.cells + i;
            least = std::min(least, certificates_->values()[at]);
          }
        }
        // The walk may begin in the middle of a motion, which has been paid for.
        const auto rest = static_cast<float>(per_step * (least - std::min<std::uint32_t>(least, grid.start_units)));
        plane[i] =
            least == CertificateTable::kUnreachable ? MateCertificates::kNone : std::min(rest, MateCertificates::kNone);
      }
    }
  }
  const CellBox& table = grid.domain;
  for (int o = 0; o < open.orientations(); ++o) {
    for (int z = table.min.z(); z <= table.max.z(); ++z) {
      for (int y = table.min.y(); y <= table.max.y(); ++y) {
        for (int x = table.min.x(); x <= table.max.x(); ++x) {
          if (!filled_->Blocked(Cell(x, y, z), o)) continue;
          for (int mask = 0; mask < 16; ++mask) {
            planes_[static_cast<std::size_t>(o * 16 + mask) * grid.cells + grid.Index(Cell(x, y, z))] = -1.0F;
          }
        }
      }
    }
  }
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

/// In free steps, times the number of members; `robot` relative to the corner of the window.
double OpenBound::LayerBound(const Bits256& bits, int orientation, const Cell& robot) const {
  const Openings& openings = openings_[static_cast<std::size_t>(orientation)];
  const int count = bits.Count();
  const int left = std::min<int>(count, (spread_.x() + 1) * (spread_.y() + 1));  // what a goal may leave of the layer
  if (count <= left || openings.mouths.empty()) return 0.0;
  const Key key{bits.word, orientation, {robot.x(), robot.y(), robot.z()}};
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = known_.find(key); known != known_.end()) return known->second;
  }
  Layer layer;
  layer.orientation = orientation;
  layer.mouths = Around(bits, openings.box);
  std::array<int, 256> index{};
  std::map<std::array<int, 3>, int> openings_at;
  std::vector<double> earliest;
  bits.ForEach([&](int bit) {
    Layer::Member member;
    member.h = Cell(bit & 15, bit >> 4, 0);
    index[static_cast<std::size_t>(bit)] = static_cast<int>(layer.members.size());
    double least = kInfinity;
    for (const Cell& mouth : openings.mouths) {
      const Cell at = member.h + mouth;
      least = std::min<double>(least, Distance(robot, at));
      layer.each = std::max(layer.each, ++openings_at[{at.x(), at.y(), at.z()}]);
    }
    earliest.push_back(least);
    layer.members.push_back(member);
  });
  for (Layer::Member& member : layer.members) {
    for (std::size_t i = 0; i < 4; ++i) {
      const Cell at = member.h + certificates_->neighbours()[i];
      if ((at.array() < 0).any() || at.x() > 15 || at.y() > 15 || at.z() != 0 || !bits.Test(at.x() + 16 * at.y())) {
        continue;
      }
      member.mask |= 1 << i;
      member.neighbour[i] = index[static_cast<std::size_t>(at.x() + 16 * at.y())];
    }
  }
  const CellBox members_box = Around(bits, {Cell::Zero(), Cell::Zero()});
  std::array<int, 2> reach{};
  for (int axis = 0; axis < 2; ++axis) {
    const int span = members_box.max[axis] - members_box.min[axis];
    reach[static_cast<std::size_t>(axis)] =
        std::max(1, span - spread_[axis] <= kWholeRow ? span - spread_[axis] : kMateReach);
    layer.alone_by_one[static_cast<std::size_t>(axis)] =
        span <= reach[static_cast<std::size_t>(axis)] + spread_[axis] ? 1 : 2;
  }
  layer.mates = &mates_.Within(reach, orientation);
  for (Layer::Member& member : layer.members) {
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
  for (const Layer::Member& member : layer.members) {
    if (filled_->Blocked(robot - member.h, orientation)) return 0.0;  // already inside an opening
  }
  std::ranges::sort(earliest);
  layer.first = earliest.front();
  layer.slots_before.push_back(0.0);
  for (int k = 0; k < count; ++k) {
    const int steps = k / layer.each;
    layer.slots.push_back(std::max(layer.first + steps, earliest[static_cast<std::size_t>(k)]));
    layer.slots_before.push_back(layer.slots_before.back() + layer.slots.back());
  }

  // Looking into openings until the rest is a goal.
  const auto looks = static_cast<std::size_t>(count - left);
  const double all_looked_into = layer.slots_before[looks] + left * layer.slots[looks - 1];

  // What a step tells apart depends on its mask alone.
  struct Split {
    bool splits = false;
    bool blocked_leave = false;
    CellBox blocked;
    CellBox free;
    Bits256 blocked_members;
    Bits256 free_members;
    std::array<double, 2> off_path = {kInfinity, kInfinity};  ///< where the free, the blocked leave
    std::array<double, 2> off_rest = {kInfinity, kInfinity};
  };
  const CellBox& domain = filled_->domain();
  const CellBox box{domain.min.cwiseMin(robot).cwiseMin(layer.mouths.min) - Cell::Ones(),
                    (domain.max + Cell(15, 15, 0)).cwiseMax(robot).cwiseMax(layer.mouths.max) + Cell::Ones()};
  double bound = all_looked_into;
  for (int radius = kFirstRadius;; radius *= 2) {
    // Where the radius takes in all that is not repeated beyond the map, nothing is left out.
    const Cell furthest = (box.max - robot).cwiseMax(Cell(robot - box.min));
    const double outside = furthest.sum() <= radius ? kInfinity : radius + 1.0;
    layer.outside = outside;
    std::unordered_map<std::uint32_t, Split> splits;
    std::vector<std::vector<Cell>> places(static_cast<std::size_t>(radius) + 1);
    const Cell low = box.min.cwiseMax(Cell(robot - Cell::Constant(radius)));
    const Cell high = box.max.cwiseMin(Cell(robot + Cell::Constant(radius)));
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        const int room = radius - std::abs(z - robot.z()) - std::abs(y - robot.y());
        for (int x = std::max(low.x(), robot.x() - room); x <= std::min(high.x(), robot.x() + room); ++x) {
          const Cell place(x, y, z);
          const int distance = Distance(robot, place);
          bool any = false;
          for (const Direction d : kDirections) {
            const std::uint32_t mask = masks_.Index(place, d, orientation);
            if (mask == 0) continue;
            const auto [at, added] = splits.try_emplace(mask);
            Split& split = at->second;
            if (added) {
              split.blocked_members = bits & masks_.Mask(mask);
              split.free_members = bits.Without(masks_.Mask(mask));
              split.splits = split.blocked_members.Any() && split.free_members.Any();
              if (split.splits) {
                split.blocked = Around(split.blocked_members, openings.box);
                split.free = Around(split.free_members, openings.box);
              }
            }
            if (!split.splits) continue;
            any = true;
            const int to_blocked = Distance(place, split.blocked);
            const int to_free = Distance(place, split.free);
            const std::size_t leave = to_blocked >= to_free ? 1 : 0;
            const double way = std::max(to_blocked, to_free);
            split.off_path[leave] = std::min(split.off_path[leave], distance + way);
            split.off_rest[leave] = std::min(split.off_rest[leave], way);
          }
          if (any) places[static_cast<std::size_t>(distance)].push_back(place);
        }
      }
    }
    for (Layer::Member& member : layer.members) {
      member.off_path = outside;
      member.off_rest = kInfinity;
    }
    for (const auto& entry : splits) {
      const auto& split = entry.second;
      if (!split.splits) continue;
      for (const std::size_t leave : {0, 1}) {
        if (split.off_path[leave] == kInfinity) continue;
        const Bits256& leaving = leave == 1 ? split.blocked_members : split.free_members;
        leaving.ForEach([&](int bit) {
          Layer::Member& member = layer.members[static_cast<std::size_t>(index[static_cast<std::size_t>(bit)])];
          member.off_path = std::min(member.off_path, split.off_path[leave]);
          member.off_rest = std::min(member.off_rest, split.off_rest[leave]);
        });
      }
    }

    // If the first split is further than the radius.
    double beyond = kInfinity;
    for (int m = 0; m < count; ++m) {
      const double delay = m == 0 ? 0.0 : layer.first + Rounded(m - 1, layer.each);
      beyond =
          std::min(beyond, layer.slots_before[static_cast<std::size_t>(m)] + (count - m) * std::max(outside, delay));
    }

    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue;
    double least = std::min(all_looked_into, beyond);
    for (int distance = 0; distance <= radius; ++distance) {
      for (const Cell& place : places[static_cast<std::size_t>(distance)]) {
        Candidate candidate{place, distance, false, 0.0};
        Evaluate(layer, candidate, false);
        if (candidate.bound < least) queue.push(candidate);
      }
    }
    while (!queue.empty() && queue.top().bound < least) {
      Candidate candidate = queue.top();
      queue.pop();
      Evaluate(layer, candidate, true);
      least = std::min(least, candidate.bound);
    }
    bound = least;
    if (least < beyond || outside == kInfinity) break;
  }
  const std::lock_guard lock(mutex_);
  known_.emplace(key, bound);
  return bound;
}

/// Raises the candidate's bound: the least over m1 and m2 if members are first told apart there. Without `refine` all
/// openings are taken to save as much as the best one does.
void OpenBound::Evaluate(const Layer& layer, Candidate& candidate, bool refine) const {
  const std::size_t count = layer.members.size();
  const CertificateGrid& grid = certificates_->grid();
  // Reused per thread: this is called some hundred thousand times a problem.
  thread_local std::vector<double> charge;
  thread_local std::vector<double> incoming;
  thread_local std::vector<double> overlap;
  charge.assign(count, 0.0);
  incoming.assign(count, 0.0);
  if (refine) overlap.assign(4 * count, 0.0);
  int inside = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Layer::Member& member = layer.members[k];
    const std::size_t at = grid.Index(candidate.place - member.h);
    const auto plane = [&](int mask) {
      return planes_[static_cast<std::size_t>(layer.orientation * 16 + mask) * grid.cells + at];
    };
    const double both = plane(member.mask);
    if (both < 0.0) {
      ++inside;
      continue;
    }
    const double along_x = plane(member.mask & 3);
    const double along_y = plane(member.mask & 12);
    if (along_x + along_y <= 0.0) continue;
    const double charge_x = std::min(along_x, both * along_x / (along_x + along_y));
    const double charge_y = std::min(along_y, both - charge_x);
    charge[k] = charge_x + charge_y;
    for (std::size_t i = 0; i < 4; ++i) {
      if ((member.mask >> i & 1) == 0) continue;
      const bool alone = (member.mask >> (i ^ 1) & 1) == 0;
      const double share = (i < 2 ? charge_x : charge_y) * (alone ? 1.0 : 0.5);
      incoming[static_cast<std::size_t>(member.neighbour[i])] += share;
      if (refine) overlap[4 * k + i] = share;
    }
  }

  const double way = candidate.distance;
  const double to_mouths = Distance(candidate.place, layer.mouths);
  // Two ways to bound what a hypothesis costs from here: with the way from the start to where it leaves the main path,
  // which does not know of the delay by openings looked into; and with the delay.
  thread_local std::vector<double> from_start;
  thread_local std::vector<double> from_here;
  from_start.resize(count);
  from_here.resize(count);
  double sum_from_start = 0.0;
  double sum_from_here = 0.0;
  double most_from_here = 0.0;
  double best_from_start = 0.0;
  double best_from_here = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const Layer::Member& member = layer.members[k];
    from_start[k] = std::min(std::max(member.off_path, way), way + charge[k]);
    from_here[k] = std::min(member.off_rest, charge[k]);
    sum_from_start += from_start[k];
    sum_from_here += from_here[k];
    most_from_here = std::max(most_from_here, from_here[k]);
    from_start[k] += incoming[k];
    from_here[k] += incoming[k];
    best_from_start = std::max(best_from_start, from_start[k]);
    best_from_here = std::max(best_from_here, from_here[k]);
  }

  // The same with mates for neighbours. A member is spared its certificate only if all its mates are looked into.
  thread_local std::array<std::vector<double>, 2> mate_charge;
  thread_local std::vector<double> mate_from_start;
  thread_local std::vector<double> mate_from_here;
  mate_from_start.resize(count);
  mate_from_here.resize(count);
  for (std::vector<double>& charges : mate_charge) charges.assign(count, 0.0);
  double sum_mate_start = 0.0;
  double sum_mate_here = 0.0;
  double most_mate_here = 0.0;
  double best_mate_start = 0.0;
  double best_mate_here = 0.0;
  std::array<double, 2> best_spared{};
  for (std::size_t k = 0; k < count; ++k) {
    const Layer::Member& member = layer.members[k];
    const CertificateGrid& mate_grid = layer.mates->grid;
    const std::size_t at = mate_grid.Index(candidate.place - member.h);
    const double along_x = member.mates[0] > 0 ? layer.mates->planes[at] : 0.0;
    const double along_y = member.mates[1] > 0 ? layer.mates->planes[mate_grid.cells + at] : 0.0;
    double charges = 0.0;
    if (along_x >= 0.0 && along_y >= 0.0 && along_x + along_y > 0.0) {
      const double both = member.mates[0] == 0   ? along_y
                          : member.mates[1] == 0 ? along_x
                                                 : layer.mates->planes[2 * mate_grid.cells + at];
      mate_charge[0][k] = std::min(along_x, both * along_x / (along_x + along_y));
      mate_charge[1][k] = std::min(along_y, both - mate_charge[0][k]);
      charges = mate_charge[0][k] + mate_charge[1][k];
      for (std::size_t axis = 0; axis < 2; ++axis) {
        if (member.mates[axis] == 0) continue;
        best_spared[axis] =
            std::max(best_spared[axis], layer.alone_by_one[axis] * mate_charge[axis][k] / member.mates[axis]);
      }
    }
    mate_from_start[k] = std::min(std::max(member.off_path, way), way + charges);
    mate_from_here[k] = std::min(member.off_rest, charges);
    sum_mate_start += mate_from_start[k];
    sum_mate_here += mate_from_here[k];
    most_mate_here = std::max(most_mate_here, mate_from_here[k]);
    best_mate_start = std::max(best_mate_start, mate_from_start[k]);
    best_mate_here = std::max(best_mate_here, mate_from_here[k]);
  }
  best_mate_start += best_spared[0] + best_spared[1];
  best_mate_here += best_spared[0] + best_spared[1];

  if (!refine) {
    double bound = kInfinity;
    for (std::size_t m = static_cast<std::size_t>(inside); m < count; ++m) {
      const double delayed = m == 0 ? 0.0 : layer.first + Rounded(static_cast<int>(m - 1), layer.each) + to_mouths;
      const double time = std::max(way, delayed);
      const double again = std::max(time + to_mouths, layer.first + Rounded(static_cast<int>(m), layer.each));
      const int rest = static_cast<int>(count - m);
      const double early = layer.slots_before[m];
      const double a = sum_from_start - static_cast<double>(m) * best_from_start -
                       Savings(best_from_start - again, rest, layer.each);
      // A place beyond the radius may be where a hypothesis leaves the main path.
      const double scale = most_from_here > 0.0 ? std::clamp((layer.outside - time) / most_from_here, 0.0, 1.0) : 1.0;
      const double b = static_cast<double>(rest) * time + scale * sum_from_here -
                       static_cast<double>(m) * best_from_here -
                       Savings(time + best_from_here - again, rest, layer.each);
      const double mate_scale =
          most_mate_here > 0.0 ? std::clamp((layer.outside - time) / most_mate_here, 0.0, 1.0) : 1.0;
      const double c = sum_mate_start - static_cast<double>(m) * best_mate_start -
                       Savings(best_mate_start - again, rest, layer.each);
      const double d = static_cast<double>(rest) * time + mate_scale * sum_mate_here -
                       static_cast<double>(m) * best_mate_here -
                       Savings(time + best_mate_here - again, rest, layer.each);
      bound = std::min(bound, early + std::max({a, b, c, d, static_cast<double>(rest) * time}));
      if (early > bound) break;
    }
    candidate.bound = std::max(candidate.bound, bound);
    return;
  }

  candidate.refined = true;
  // Openings looked into one step apart are neighbours, and what a neighbour is spared is then counted twice.
  const bool single =
      layer.each == 1 && openings_[static_cast<std::size_t>(layer.orientation)].mouths.size() == 1 && spread_.isZero();
  std::vector<double> spared(count, 0.0);
  double most_spared = 0.0;
  if (single) {
    for (std::size_t k = 0; k < count; ++k) {
      double least = kInfinity;
      const Layer::Member& member = layer.members[k];
      for (std::size_t i = 0; i < 4; ++i) {
        if ((member.mask >> i & 1) == 0) continue;
        const auto other = static_cast<std::size_t>(member.neighbour[i]);
        least = std::min(least, overlap[4 * k + i] + overlap[4 * other + (i ^ 1)]);
      }
      spared[k] = least == kInfinity ? 0.0 : least;
      most_spared = std::max(most_spared, spared[k]);
    }
  }
  // Looking two steps later instead saves what is spared but delays all that follow.
  double bonus = most_spared;
  for (int i = 1; i < most_spared; ++i) bonus += most_spared - i;

  struct Variant {
    const std::vector<double>* gains;
    bool delayed;
    bool path;
    std::vector<double> sorted;
    std::vector<double> sums;
  };
  std::array<Variant, 6> variants{{{&from_start, false, false, {}, {}},
                                   {&from_start, false, true, {}, {}},
                                   {&from_here, true, false, {}, {}},
                                   {&from_here, true, true, {}, {}},
                                   {&mate_from_start, false, false, {}, {}},
                                   {&mate_from_here, true, false, {}, {}}}};
  for (Variant& variant : variants) {
    variant.sorted = *variant.gains;
    if (variant.path) {
      for (std::size_t k = 0; k < count; ++k) variant.sorted[k] -= spared[k];
    }
    std::ranges::sort(variant.sorted, std::greater<>());
    variant.sums.push_back(0.0);
    for (const double gain : variant.sorted) variant.sums.push_back(variant.sums.back() + gain);
  }
  // What mates are spared at most when so many openings are looked into: each stands beside at most `alone_by_one`
  // members without a mate left, and such a member needs all its mates looked into.
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::vector<std::pair<double, double>> items;  // what is spared per mate, mates
    for (std::size_t k = 0; k < count; ++k) {
      const double mates = layer.members[k].mates[axis];
      if (mates > 0.0) items.emplace_back(mate_charge[axis][k] / mates, mates);
    }
    std::ranges::sort(items, std::greater<>());
    std::size_t item = 0;
    double used = 0.0;
    double spared_so_far = 0.0;
    for (std::size_t looks = 1; looks <= count; ++looks) {
      double room = layer.alone_by_one[axis];
      while (room > 0.0 && item < items.size()) {
        const double take = std::min(room, items[item].second - used);
        spared_so_far += take * items[item].first;
        used += take;
        room -= take;
        if (used >= items[item].second) {
          used = 0.0;
          ++item;
        }
      }
      variants[4].sums[looks] += spared_so_far;
      variants[5].sums[looks] += spared_so_far;
    }
  }
  double bound = kInfinity;
  for (std::size_t m = static_cast<std::size_t>(inside); m < count; ++m) {
    const double early = layer.slots_before[m];
    const double early_on_path = static_cast<double>(m) * layer.first + 0.5 * static_cast<double>(m * (m - (m > 0)));
    if (early_on_path > bound) break;
    const double delayed = m == 0 ? 0.0 : layer.first + Rounded(static_cast<int>(m - 1), layer.each) + to_mouths;
    const double time = std::max(way, delayed);
    const double again = std::max(time + to_mouths, layer.first + Rounded(static_cast<int>(m), layer.each));
    const double scale = most_from_here > 0.0 ? std::clamp((layer.outside - time) / most_from_here, 0.0, 1.0) : 1.0;
    const double mate_scale =
        most_mate_here > 0.0 ? std::clamp((layer.outside - time) / most_mate_here, 0.0, 1.0) : 1.0;
    // By the number of openings that are looked into in all.
    double late = 0.0;
    for (std::size_t looks = m; looks < count; ++looks) {
      if (looks > m) late += again + Rounded(static_cast<int>(looks - 1 - m), layer.each);
      const double least_rest = static_cast<double>(count - looks) * time;
      double best = early + least_rest;
      for (const Variant& variant : variants) {
        double rest = -variant.sums[looks] - (variant.path ? (m == 0 ? 1.0 : 2.0) * bonus : 0.0);
        const bool of_mates = variant.gains == &mate_from_start || variant.gains == &mate_from_here;
        rest += !variant.delayed ? (of_mates ? sum_mate_start : sum_from_start)
                                 : static_cast<double>(count - looks) * time +
                                       (of_mates ? mate_scale * sum_mate_here : scale * sum_from_here);
        best = std::max(best, (variant.path ? early_on_path : early) + rest);
      }
      bound = std::min(bound, best + late);
    }
  }
  candidate.bound = std::max(candidate.bound, bound);
}

}  // namespace feeler::planner
