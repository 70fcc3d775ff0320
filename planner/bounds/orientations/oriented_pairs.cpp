#include "feeler/planner/bounds/orientations/oriented_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace feeler::planner {
namespace {

/// By cell of the box, bit d: the cell from which a step in direction d leads here lies outside.
std::vector<std::uint8_t> EdgesOf(const OrientedBox& box) {
  std::vector<std::uint8_t> edges(box.cells, 0);
  const auto bit = [](Direction d) { return static_cast<std::uint8_t>(1U << IndexOf(d)); };
  const Cell last = box.size - Cell::Ones();
  std::size_t row = 0;
  for (int z = 0; z <= last.z(); ++z) {
    for (int y = 0; y <= last.y(); ++y, row += static_cast<std::size_t>(box.size.x())) {
      std::uint8_t of_row = 0;
      if (z == 0) of_row |= bit(Direction::kPlusZ);
      if (z == last.z()) of_row |= bit(Direction::kMinusZ);
      if (y == 0) of_row |= bit(Direction::kPlusY);
      if (y == last.y()) of_row |= bit(Direction::kMinusY);
      std::fill_n(&edges[row], box.size.x(), of_row);
      edges[row] |= bit(Direction::kPlusX);
      edges[row + static_cast<std::size_t>(last.x())] |= bit(Direction::kMinusX);
    }
  }
  return edges;
}

}  // namespace

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
    // Tables that somebody holds take their memory all the same.
    std::erase_if(planes_, [this](const auto& entry) {
      if (entry.second.use_count() > 1) return false;
      bytes_ -= entry.second->values.size();
      return true;
    });
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
  std::vector<std::uint8_t> theirs(box.cells);
  flags_->Copy(box.domain, orientation, mine);
  flags_->Copy({box.domain.min - offset, box.domain.max - offset}, other, theirs);
  for (std::size_t cell = 0; cell < box.cells; ++cell) {
    if (mine[cell] == kOutOfReach) continue;
    const unsigned tells = ((theirs[cell] == kOutOfReach ? kBlockedSteps : theirs[cell]) ^ mine[cell]) & kBlockedSteps;
    if (tells == 0) continue;
    reach(cell,
          (tells & mine[cell]) != 0 ? std::min<unsigned>(contact_units_, (tells & ~mine[cell]) != 0 ? 1 : 60) : 1);
  }
  const std::vector<std::uint8_t> edges = EdgesOf(box);
  std::array<std::int64_t, kDirectionCount> back{};  // to the cell before, by direction
  for (const Direction d : kDirections) {
    back[static_cast<std::size_t>(IndexOf(d))] = -SignOf(d) * box.strides()[static_cast<std::size_t>(AxisOf(d))];
  }
  for (unsigned cost = 0; cost < queues.size(); ++cost) {
    for (std::size_t k = 0; k < queues[cost].size(); ++k) {
      const std::size_t to = queues[cost][k];
      if (values[to] != cost) continue;
      for (std::size_t d = 0; d < kDirectionCount; ++d) {
        if ((edges[to] >> d & 1) != 0) continue;
        const auto from = static_cast<std::size_t>(static_cast<std::int64_t>(to) + back[d]);
        if (mine[from] == kOutOfReach || (mine[from] >> d & 1) != 0) continue;
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
