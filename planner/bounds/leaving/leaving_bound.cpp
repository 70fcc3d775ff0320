#include "feeler/planner/bounds/leaving/leaving_bound.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <limits>
#include <span>
#include <utility>

#include "feeler/core/lattice_grid.h"

namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostHypotheses = 600;
/// How far groups are followed. Whoever has not been singled out by then counts with that way.
constexpr int kRadius2d = 10;
constexpr int kRadius3d = 6;
/// Displacements looked at before new groups are no longer followed.
constexpr std::int64_t kMostLookups = 100'000'000;
/// Probes kept, in all sets.
constexpr std::size_t kMostProbes = std::size_t{1} << 23;
constexpr std::size_t kMostFaces = 200;
constexpr std::uint8_t kBlocked = 64;

Cell ToCell(const std::array<int, 3>& a) { return {a[0], a[1], a[2]}; }

/// Bounds for members of these weights (ascending) from those for members of weight 1: members that weigh more than
/// w, for every w, cost together what so many cost at least.
std::vector<double> Weigh(const std::vector<double>& bounds, const std::vector<double>& weights) {
  std::vector<double> weighed(bounds.size(), 0.0);
  for (std::size_t k = 1; k < bounds.size(); ++k) {
    double before = 0.0;
    for (std::size_t i = 0; i < k; ++i) {
      weighed[k] += (weights[i] - before) * bounds[k - i];
      before = weights[i];
    }
  }
  return weighed;
}

/// Places from which the target is touched, in displacements.
std::size_t Faces(const ContactMap& map, std::size_t most) {
  std::size_t faces = 0;
  for (int orientation = 0; orientation < map.orientations(); ++orientation) {
    const ContactMap::LayerView& layer = map.layer(orientation);
    for (std::size_t i = 0; i < layer.blocked.size() && faces <= most; ++i) {
      if (layer.blocked[i] != 0) continue;
      faces += std::ranges::any_of(layer.travel, [&](std::span<const float> travel) { return travel[i] < 1.0F; });
    }
  }
  return faces;
}

}  // namespace

LeavingBound::LeavingBound(const Problem& problem) : problem_(problem), domain_(problem.map->domain()) {
  assert(Fits(problem));
  const Cell size = domain_.Size();
  strides_ = GridStrides(size);
  radius_ = problem.workspace.Size().z() == 1 ? kRadius2d : kRadius3d;
  if (problem.goal == GoalKind::kInsertable) {
    most_in_goal_ = static_cast<std::size_t>((problem.insertable_spread + Cell::Ones()).cast<std::int64_t>().prod());
  }
  most_in_goal_ = std::min(most_in_goal_, kMostHypotheses);
  for (std::size_t k = 0; k <= most_in_goal_; ++k) zeros_.emplace_back(k + 1, 0.0);
  seen_.assign(static_cast<std::size_t>(problem.workspace.Count()), 0);
  for (int orientation = 0; orientation < problem.map->orientations(); ++orientation) FillFlags(orientation);
}

bool LeavingBound::Fits(const Problem& problem) {
  constexpr int kMostCoordinate = 30000;  // of a Probe
  const CellBox& workspace = problem.workspace;
  if (problem.generous_workspace || problem.hypotheses.size() > kMostHypotheses) return false;
  if (workspace.max.maxCoeff() > kMostCoordinate || workspace.min.minCoeff() < -kMostCoordinate) return false;
  for (const Hypothesis& h : problem.hypotheses) {
    const CellBox& domain = problem.map->domain();
    if (!domain.Contains(workspace.min - h.offset) || !domain.Contains(workspace.max - h.offset)) return false;
  }
  return Faces(*problem.map, kMostFaces) <= kMostFaces;
}

void LeavingBound::FillFlags(int orientation) {
  std::vector<std::uint8_t>& flags = flags_.emplace_back();
  std::vector<Cell>& faces = faces_.emplace_back();
  CellBox& box = face_boxes_.emplace_back(CellBox{domain_.max, domain_.min});
  flags.reserve(static_cast<std::size_t>(domain_.Count()));
  for (int z = domain_.min.z(); z <= domain_.max.z(); ++z) {
    for (int y = domain_.min.y(); y <= domain_.max.y(); ++y) {
      for (int x = domain_.min.x(); x <= domain_.max.x(); ++x) {
        const Cell displacement(x, y, z);
        std::uint8_t flag = 0;
        if (problem_.map->Blocked(displacement, orientation)) {
          flag = kBlocked;
        } else {
          for (const Direction d : kDirections) {
            if (!problem_.map->StepFree(displacement, d, orientation)) {
              flag |= static_cast<std::uint8_t>(1U << IndexOf(d));
            }
          }
          if (flag != 0) {
            faces.push_back(displacement);
            box.min = box.min.cwiseMin(displacement);
            box.max = box.max.cwiseMax(displacement);
          }
        }
        flags.push_back(flag);
      }
    }
  }
}

double LeavingBound::Weighted(const HypothesisSets& sets, SetId set, const Cell& robot) {
  if (sets.info(set).goal) return 0.0;
  Group group;
  std::vector<double> weights;
  sets.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t layer, int bit) {
    group.push_back({{h.x(), h.y(), h.z()}, orientation});
    weights.push_back(sets.Weight(layer, bit));
  });
  const Probes& probes = ProbesOfSet(set, group, sets.uniform() ? std::vector<double>() : weights);
  std::ranges::sort(weights);
  if (probes.probes.empty()) return 0.0;

  // The least distance to a probe of each group, and to one that singles out each member.
  thread_local std::vector<int> distances;
  distances.assign(probes.groups.size(), std::numeric_limits<int>::max());
  for (const Probe& probe : probes.probes) {
    const int distance = std::abs(probe.place[0] - robot.x()) + std::abs(probe.place[1] - robot.y()) +
                         std::abs(probe.place[2] - robot.z());
    distances[probe.group] = std::min(distances[probe.group], distance);
  }
  const auto last = static_cast<std::size_t>(*std::ranges::max_element(distances));
  std::vector<Layer> layers(last + 1);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const std::vector<double>& bounds = *probes.groups[i];
    std::vector<double>& rest = layers[static_cast<std::size_t>(distances[i])].rest;
    if (rest.size() < bounds.size()) rest.resize(bounds.size(), kInfinity);
    for (std::size_t g = 0; g < bounds.size(); ++g) rest[g] = std::min(rest[g], bounds[g]);
  }
  for (const Member& member : group) {
    const Cell displacement = robot - ToCell(member.offset);
    const CellBox& box = face_boxes_[static_cast<std::size_t>(member.orientation)];
    const auto distance = static_cast<std::size_t>((displacement - box.Clamp(displacement)).cwiseAbs().sum());
    if (distance <= last) ++layers[distance].gone;
  }
  for (std::size_t t = 1; t <= last; ++t) {
    const std::vector<double>& before = layers[t - 1].rest;
    std::vector<double>& rest = layers[t].rest;
    if (rest.size() < before.size()) rest.resize(before.size(), kInfinity);
    for (std::size_t g = 0; g < before.size(); ++g) rest[g] = std::min(rest[g], before[g]);
    layers[t].gone += layers[t - 1].gone;
  }
  return Bounds(weights, layers, true).back();
}

const LeavingBound::Probes& LeavingBound::ProbesOfSet(SetId set, const Group& group,
                                                      const std::vector<double>& weights) {
  if (probe_count_ > kMostProbes) {
    probes_.clear();
    probe_count_ = 0;
  }
  const auto [entry, added] = probes_.try_emplace(set);
  Probes& probes = entry->second;
  if (!added) return probes;
  // Places from which some member is touched, each once.
  ++sets_seen_;
  const Cell size = problem_.workspace.Size();
  std::vector<Cell> places;
  std::vector<const std::uint8_t*> tables;
  for (const Member& member : group) {
    const Cell offset = ToCell(member.offset);
    const auto orientation = static_cast<std::size_t>(member.orientation);
    tables.push_back(flags_[orientation].data() + Linear(-offset - domain_.min));
    for (const Cell& face : faces_[orientation]) {
      const Cell place = face + offset;
      if (!problem_.workspace.Contains(place)) continue;
      const Cell o = place - problem_.workspace.min;
      std::uint32_t& seen = seen_[GridIndex(size, o)];
      if (std::exchange(seen, sets_seen_) != sets_seen_) places.push_back(place);
    }
  }
  std::unordered_map<const std::vector<double>*, std::uint32_t> index;
  std::vector<double> own;
  for (const Cell& place : places) {
    const std::int64_t at = Linear(place);
    const auto step = [&](const std::vector<double>& bounds, Direction d) {
      const Probe probe{{static_cast<std::int16_t>(place.x()), static_cast<std::int16_t>(place.y()),
                         static_cast<std::int16_t>(place.z())},
                        static_cast<std::uint32_t>(probes.groups.size())};
      const bool nothing =
          bounds.size() <= most_in_goal_ + 1;  // those that a goal may keep cost nothing at any weights
      if (weights.empty() || nothing) {
        const auto [known, is_new] = index.try_emplace(&bounds, probe.group);
        if (is_new) probes.groups.push_back(&bounds);
        probes.probes.push_back({probe.place, known->second});
        return;
      }
      own.clear();
      for (std::size_t i = 0; i < group.size(); ++i) {
        if ((tables[i][at] >> IndexOf(d) & 1) != 0) own.push_back(weights[i]);
      }
      std::ranges::sort(own);
      probes.weighted.push_back(std::make_unique<const std::vector<double>>(Weigh(bounds, own)));
      probes.groups.push_back(probes.weighted.back().get());
      probes.probes.push_back(probe);
    };
    ForEachTellingStep(group, tables, place, problem_.workspace, step);
  }
  probe_count_ += probes.probes.size() + 8 * probes.weighted.size();
  return probes;
}

template <class F>
unsigned LeavingBound::ForEachTellingStep(const Group& group, const std::vector<const std::uint8_t*>& tables,
                                          const Cell& place, const CellBox& box, F f) {
  lookups_ += static_cast<std::int64_t>(group.size());
  const std::int64_t at = Linear(place);
  std::array<std::uint8_t, kMostHypotheses> flags;
  unsigned any = 0;
  unsigned every = kBlocked - 1;
  for (std::size_t i = 0; i < group.size(); ++i) {
    flags[i] = tables[i][at];
    any |= flags[i];
    if ((flags[i] & kBlocked) == 0) every &= flags[i];
  }
  unsigned further = 0;
  for (const Direction d : kDirections) {
    const unsigned bit = 1U << IndexOf(d);
    if ((every & bit) != 0 || !box.Contains(place + UnitCell(d))) continue;  // nobody gets further, and nobody learns
    further |= bit;
    if ((any & bit) == 0) continue;
    const auto is_singled_out = [&](std::uint8_t flag) { return (flag & bit) != 0; };
    const auto count = static_cast<std::size_t>(
        std::count_if(flags.begin(), flags.begin() + static_cast<std::ptrdiff_t>(group.size()), is_singled_out));
    if (count <= most_in_goal_) {
      f(zeros_[count], d);
      continue;
    }
    Group singled_out;
    singled_out.reserve(count);
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (!is_singled_out(flags[i])) continue;
      singled_out.push_back(group[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        singled_out.back().offset[axis] -= place[static_cast<Eigen::Index>(axis)];
      }
    }
    f(OfGroup(singled_out), d);
  }
  return further;
}

std::size_t LeavingBound::HashOfGroup::operator()(const Group& group) const {
  std::uint64_t hash = group.size();
  for (const Member& member : group) {
    for (const int part : {member.offset[0], member.offset[1], member.offset[2], member.orientation}) {
      hash = (hash ^ static_cast<std::uint32_t>(part)) * 0x9E3779B97F4A7C15;
    }
    hash ^= hash >> 31;
  }
  return hash;
}

const std::vector<double>& LeavingBound::OfGroup(const Group& group) {
  const auto known = known_.find(group);
  if (known != known_.end()) return known->second;
  std::vector<double> bounds(group.size() + 1, 0.0);
  if (lookups_ < kMostLookups) {
    CellBox box{Cell::Constant(-radius_), Cell::Constant(radius_)};
    for (const Member& member : group) {  // where all displacements are of the map: the workspace lies within
      box.min = box.min.cwiseMax(domain_.min + ToCell(member.offset));
      box.max = box.max.cwiseMin(domain_.max + ToCell(member.offset));
    }
    bounds = Bounds(std::vector<double>(group.size(), 1.0), LayersOfGroup(group, box), false);
  }
  bytes_ += group.size() * sizeof(Member) + bounds.size() * sizeof(double) + 128;
  return known_.emplace(group, std::move(bounds)).first->second;
}

std::vector<LeavingBound::Layer> LeavingBound::LayersOfGroup(const Group& group, const CellBox& box) {
  const Cell size = box.Size();
  std::vector<char> seen(static_cast<std::size_t>(box.Count()), 0);
  const auto see = [&](const Cell& c) {
    const Cell o = c - box.min;
    char& it = seen[GridIndex(size, o)];
    return std::exchange(it, 1) == 0;
  };
  std::vector<const std::uint8_t*> tables;
  for (const Member& member : group) {
    tables.push_back(flags_[static_cast<std::size_t>(member.orientation)].data() +
                     Linear(-ToCell(member.offset) - domain_.min));
  }
  std::vector<Layer> layers;
  std::vector<Cell> places = {Cell::Zero()};
  see(Cell::Zero());
  Layer layer;
  for (int distance = 0; distance < radius_; ++distance) {
    std::vector<Cell> next_places;
    for (const Cell& place : places) {
      const unsigned further =
          ForEachTellingStep(group, tables, place, box, [&](const std::vector<double>& bounds, Direction) {
            if (layer.rest.size() < bounds.size()) layer.rest.resize(bounds.size(), kInfinity);
            for (std::size_t g = 0; g < bounds.size(); ++g) layer.rest[g] = std::min(layer.rest[g], bounds[g]);
          });
      for (const Direction d : kDirections) {
        const Cell next = place + UnitCell(d);
        if ((further >> IndexOf(d) & 1) != 0 && see(next)) next_places.push_back(next);
      }
    }
    layers.push_back(layer);
    places = std::move(next_places);
  }
  return layers;
}

std::vector<double> LeavingBound::Bounds(const std::vector<double>& weights, const std::vector<Layer>& layers,
                                         bool all_start) const {
  const std::size_t n = weights.size();
  const CostWeights& cost = problem_.cost;
  // The least that k of the group weigh.
  std::vector<double> lightest = {0.0};
  lightest.insert(lightest.end(), weights.begin(), weights.end());
  for (std::size_t k = 1; k <= n; ++k) lightest[k] += lightest[k - 1];

  const auto after_leaving = [&](const Layer& layer, std::size_t k, const std::vector<double>& next, std::size_t stay) {
    double best = kInfinity;
    for (std::size_t g = 1; g < k && g < layer.rest.size() && k - g >= stay; ++g) {
      best = std::min(best,
                      layer.rest[g] + lightest[g] * cost.per_contact + lightest[k - g] * cost.per_cell + next[k - g]);
    }
    return best;
  };
  std::vector<double> next(n + 1, 0.0);
  if (all_start) {
    for (std::size_t k = most_in_goal_ + 1; k <= n; ++k) {
      const double value = after_leaving(layers.back(), k, next, 0);
      next[k] = value < kInfinity ? value : 0.0;
    }
  }
  std::vector<double> now(n + 1, 0.0);
  for (std::size_t t = layers.size(); t-- > 0;) {
    const std::size_t stay = all_start ? n - std::min(n, layers[t].gone) : 0;
    for (std::size_t k = most_in_goal_ + 1; k <= n; ++k) {
      now[k] = std::min(lightest[k] * cost.per_cell + next[k], after_leaving(layers[t], k, next, stay));
    }
    std::swap(now, next);
  }
  for (std::size_t k = most_in_goal_ + 1; k <= n; ++k) next[k] += lightest[k] * cost.per_action;
  return next;
}

}  // namespace feeler::planner
