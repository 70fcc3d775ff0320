#include "feeler/planner/bounds/orientations/oriented_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace feeler::planner {

OrientedPairs::OrientedPairs(std::shared_ptr<const StepFlagsGrid> flags, const StepCosts& costs,
                             std::shared_ptr<SharedPool> pool)
    : flags_(std::move(flags)),
      unit_(costs.free),
      contact_units_(static_cast<std::uint8_t>(std::min(60.0, std::floor(costs.contact / costs.free + 1e-9)))),
      pool_(std::move(pool)) {}

std::shared_ptr<const OrientedPairs::Plane> OrientedPairs::Get(const Cell& offset, int orientation, int other) const {
  const std::array<int, 5> key = {offset.x(), offset.y(), offset.z(), orientation, other};
  {
    const std::lock_guard lock(mutex_);
    const auto at = planes_.find(key);
    if (at != planes_.end()) return at->second;
  }
  auto fresh = std::make_shared<const Plane>(Make(offset, orientation, other));
  const std::lock_guard lock(mutex_);
  if (bytes_ + fresh->values.size() > kMostBytes) {
    planes_.clear();
    bytes_ = 0;
  }
  const auto [at, added] = planes_.try_emplace(key, std::move(fresh));
  if (added) bytes_ += at->second->values.size();
  return at->second;
}

OrientedPairs::Plane OrientedPairs::Make(const Cell& offset, int orientation, int other) const {
  Plane plane;
  plane.box = OrientedBox(StepFlagsGrid::Union(flags_->region(orientation), flags_->region(other)), offset.cwiseAbs());
  const SharedPool::Key key = {offset.x(), offset.y(), offset.z(), orientation, other};
  if (pool_) {
    if (const auto there = pool_->Find(key); there.size() == plane.box.cells) {
      plane.values = SharedArray<std::uint8_t>(there, pool_);
      return plane;
    }
  }
  std::vector<std::uint8_t> made = Build(plane.box, offset, orientation, other);
  const auto kept = pool_ && !made.empty() ? pool_->Keep(key, made) : std::span<const std::uint8_t>();
  plane.values =
      kept.size() == made.size() ? SharedArray<std::uint8_t>(kept, pool_) : SharedArray<std::uint8_t>(std::move(made));
  return plane;
}

std::vector<std::uint8_t> OrientedPairs::Build(const OrientedBox& box, const Cell& offset, int orientation,
                                               int other) const {
  std::vector<std::uint8_t> values(box.cells, OrientedCertificates::kNone);
  std::vector<std::uint8_t> mine(box.cells);
  std::array<std::vector<std::uint32_t>, OrientedCertificates::kMost + 1> queues;  // by cost
  const auto reach = [&](std::size_t cell, unsigned cost) {
    const auto value = static_cast<std::uint8_t>(std::min<unsigned>(cost, OrientedCertificates::kMost));
    if (value >= values[cell]) return;
    values[cell] = value;
    queues[value].push_back(static_cast<std::uint32_t>(cell));
  };
  constexpr unsigned kBlockedSteps = (1U << kDirectionCount) - 1;
  std::size_t cell = 0;
  for (int z = box.domain.min.z(); z <= box.domain.max.z(); ++z) {
    for (int y = box.domain.min.y(); y <= box.domain.max.y(); ++y) {
      for (int x = box.domain.min.x(); x <= box.domain.max.x(); ++x, ++cell) {
        const Cell here(x, y, z);
        mine[cell] = flags_->At(here, orientation);
        if (mine[cell] == kOutOfReach) continue;
        const std::uint8_t flags = flags_->At(here - offset, other);
        const unsigned theirs = flags == kOutOfReach ? kBlockedSteps : flags;
        const unsigned tells = (theirs ^ mine[cell]) & kBlockedSteps;
        if (tells == 0) continue;
        reach(cell,
              (tells & mine[cell]) != 0 ? std::min<unsigned>(contact_units_, (tells & ~mine[cell]) != 0 ? 1 : 60) : 1);
      }
    }
  }
  const auto strides = box.strides();
  for (unsigned cost = 0; cost < queues.size(); ++cost) {
    for (std::size_t k = 0; k < queues[cost].size(); ++k) {
      const std::size_t to = queues[cost][k];
      if (values[to] != cost) continue;
      const auto c = static_cast<int>(to);
      const Cell at(c % box.size.x(), c / box.size.x() % box.size.y(), c / box.size.x() / box.size.y());
      for (const Direction d : kDirections) {
        const int position = at[AxisOf(d)] - SignOf(d);
        if (position < 0 || position >= box.size[AxisOf(d)]) continue;
        const auto from = static_cast<std::size_t>(static_cast<std::int64_t>(to) -
                                                   SignOf(d) * strides[static_cast<std::size_t>(AxisOf(d))]);
        if (mine[from] == kOutOfReach || (mine[from] >> IndexOf(d) & 1) != 0) continue;
        reach(from, cost + 1);
      }
    }
  }
  return values;
}

std::size_t OrientedPairs::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace feeler::planner
