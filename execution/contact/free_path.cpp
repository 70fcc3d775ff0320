#include "feeler/execution/contact/free_path.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <queue>
#include <tuple>

namespace feeler::execution {
namespace {

/// Crossing a displacement next to a wall costs as much as this many clear ones.
constexpr int kUnclearCost = 8;

/// Goals up to this much farther away, in lattice steps, than the nearest one are looked at too, and at most so many.
constexpr int kDetour = 6;
constexpr std::size_t kMostGoals = 24;
/// A tool that stands next to a wall leaves it no flatter than this, in cells off the wall per cell of its way: the
/// wall may be turned by a few degrees against what is known.
constexpr double kLeastSlope = 0.25;
/// Times that differ by less are the same: the way that was found first stands.
constexpr double kLess = 1e-9;

/// The clear displacements of a box, looked up when first asked for.
class Clearance {
 public:
  Clearance(const planner::ContactMap& map, const CellBox& box, int orientation)
      : map_(map), box_(box), size_(box.Size()), orientation_(orientation) {
    known_.assign(static_cast<std::size_t>(box.Count()), kUnknown);
  }

  std::size_t Index(const Cell& c) const {
    const Cell o = c - box_.min;
    return static_cast<std::size_t>((std::int64_t{o.z()} * size_.y() + o.y()) * size_.x() + o.x());
  }
  Cell At(std::size_t i) const {
    const auto x = static_cast<int>(i % static_cast<std::size_t>(size_.x()));
    const std::size_t rest = i / static_cast<std::size_t>(size_.x());
    return box_.min + Cell(x, static_cast<int>(rest % static_cast<std::size_t>(size_.y())),
                           static_cast<int>(rest / static_cast<std::size_t>(size_.y())));
  }
  bool Clear(const Cell& c) {
    if (!box_.Contains(c)) return IsClear(map_, c, orientation_);
    char& known = known_[Index(c)];
    if (known == kUnknown) known = IsClear(map_, c, orientation_) ? kClear : kUnclear;
    return known == kClear;
  }

  /// True if every displacement that the straight line comes nearest to is clear. From the start of a path, which may
  /// be next to walls, the line may lead away from them to a clear end.
  bool LineIsClear(const Cell& from, const Cell& to, const std::vector<Cell>& walls) {
    const Eigen::Vector3d line = (to - from).cast<double>();
    for (const Cell& wall : walls) {
      if (line.dot(wall.cast<double>()) > -kLeastSlope * line.norm()) return false;
    }
    if (!Clear(to)) return false;
    const int samples = std::max(1, static_cast<int>(std::ceil(4.0 * line.norm())));
    for (int i = 0; i <= samples; ++i) {
      const Eigen::Vector3d p = from.cast<double>() + line * i / samples;
      const Cell nearest(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())),
                         static_cast<int>(std::lround(p.z())));
      if (!Clear(nearest) && (walls.empty() || !BesideOnly(nearest, walls))) return false;
    }
    return true;
  }

  /// Directions from a displacement into what it stands next to.
  std::vector<Cell> WallsAt(const Cell& c) const {
    std::vector<Cell> walls;
    for (const Direction d : kDirections) {
      if (map_.Blocked(c + UnitCell(d), orientation_)) walls.push_back(UnitCell(d));
    }
    return walls;
  }

 private:
  enum : char { kUnknown, kClear, kUnclear };

  /// The displacement is free, and what is near it lies towards the walls.
  bool BesideOnly(const Cell& c, const std::vector<Cell>& walls) const {
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) {
          const Cell by(x, y, z);
          if (!map_.Blocked(c + by, orientation_)) continue;
          if (std::ranges::none_of(walls, [&](const Cell& wall) { return wall.dot(by) > 0; })) return false;
        }
      }
    }
    return true;
  }

  const planner::ContactMap& map_;
  CellBox box_;
  Cell size_;
  int orientation_;
  std::vector<char> known_;
};

double Time(const Cell& from, const Cell& to) { return std::sqrt((to - from).cast<double>().norm()); }

struct WayPoints {
  std::vector<Cell> cells;
  double time = std::numeric_limits<double>::infinity();
};

/// The quickest way points among the cells of a lattice path. Where lines are not clear, next to a wall, the tool goes
/// as the path does.
WayPoints Quickest(const std::vector<Cell>& path, const std::vector<Cell>& walls, Clearance& clearance) {
  std::vector<double> time(path.size(), std::numeric_limits<double>::infinity());
  std::vector<std::size_t> from(path.size(), 0);
  time[0] = 0.0;
  for (std::size_t to = 1; to < path.size(); ++to) {
    for (std::size_t at = 0; at < to; ++at) {
      const double through = time[at] + Time(path[at], path[to]);
      if (through >= time[to]) continue;
      const bool straight = (path[to] - path[at]).cwiseAbs().maxCoeff() == static_cast<int>(to - at);
      if (!straight && !clearance.LineIsClear(path[at], path[to], at == 0 ? walls : std::vector<Cell>())) continue;
      time[to] = through;
      from[to] = at;
    }
  }
  WayPoints way;
  way.time = time.back();
  for (std::size_t at = path.size() - 1; at != 0; at = from[at]) way.cells.push_back(path[at]);
  way.cells.push_back(path.front());
  std::ranges::reverse(way.cells);
  return way;
}

bool Straight(const Cell& a, const Cell& b, const Cell& c) {
  return (b - a).cross(c - b).isZero() && (b - a).dot(c - b) > 0;
}

/// Keeps the corners of a lattice path, then cuts corners off as long as the lines stay clear.
std::vector<Cell> CutCorners(const std::vector<Cell>& path, Clearance& clearance) {
  std::vector<Cell> corners;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool inner = i > 0 && i + 1 < path.size();
    if (!inner || !Straight(path[i - 1], path[i], path[i + 1])) corners.push_back(path[i]);
  }
  std::vector<Cell> cut = {corners.front()};
  for (std::size_t at = 0; at + 1 < corners.size();) {
    std::size_t next = at + 1;
    for (std::size_t far = corners.size() - 1; far > next; --far) {
      if (clearance.LineIsClear(corners[at], corners[far], {})) {
        next = far;
        break;
      }
    }
    cut.push_back(corners[next]);
    at = next;
  }
  return cut;
}

}  // namespace

PathGoal EndAt(const Cell& goal) {
  return [goal](const Cell& cell) { return cell == goal ? std::optional(0.0) : std::nullopt; };
}

bool IsClear(const planner::ContactMap& map, const Cell& displacement, int orientation) {
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (map.Blocked(displacement + Cell(x, y, z), orientation)) return false;
      }
    }
  }
  return true;
}

std::optional<std::vector<Cell>> FindFreePath(const planner::ContactMap& map, const Cell& start, const PathGoal& goal,
                                              int orientation, bool care) {
  CellBox box{map.domain().min - Cell::Constant(2), map.domain().max + Cell::Constant(2)};
  box.min = box.min.cwiseMin(start);
  box.max = box.max.cwiseMax(start);
  Clearance clearance(map, box, orientation);
  const std::vector<Cell> walls = clearance.WallsAt(start);
  const auto count = static_cast<std::size_t>(box.Count());
  std::vector<int> cost(count, std::numeric_limits<int>::max());
  std::vector<std::uint8_t> arrival(count, kDirectionCount);
  // Dijkstra; the index in the key makes the order, and so the path, unique.
  using Entry = std::tuple<int, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[clearance.Index(start)] = 0;
  open.emplace(0, clearance.Index(start));
  std::vector<Cell> passed;
  std::vector<std::pair<Cell, double>> goals;  // and the time of what follows
  WayPoints best;
  int farthest = std::numeric_limits<int>::max();
  while (!open.empty() && goals.size() < kMostGoals) {
    const auto [so_far, at] = open.top();
    open.pop();
    if (so_far > farthest) break;
    if (so_far > cost[at]) continue;
    const Cell here = clearance.At(at);
    passed.push_back(here);
    if (const auto rest = goal(here)) {
      std::vector<Cell> path = {here};
      for (std::size_t i = at; arrival[i] != kDirectionCount; i = clearance.Index(path.back())) {
        path.push_back(path.back() - UnitCell(kDirections[arrival[i]]));
      }
      std::ranges::reverse(path);
      if (care) return CutCorners(path, clearance);
      WayPoints way = Quickest(path, walls, clearance);
      way.time += *rest;
      if (way.time < best.time - kLess) best = std::move(way);
      goals.emplace_back(here, *rest);
      farthest = std::min(farthest, so_far + kDetour);
    }
    for (const Direction d : kDirections) {
      const Cell next = here + UnitCell(d);
      if (!box.Contains(next) || !map.StepFree(here, d, orientation)) continue;
      const std::size_t to = clearance.Index(next);
      const int through = so_far + (clearance.Clear(next) ? 1 : kUnclearCost);
      if (through >= cost[to]) continue;
      cost[to] = through;
      arrival[to] = static_cast<std::uint8_t>(IndexOf(d));
      open.emplace(through, to);
    }
  }
  if (goals.empty()) return std::nullopt;
  // By way of one point: the lattice path need not pass where two lines would do.
  for (const auto& [end, rest] : goals) {
    for (const Cell& via : passed) {
      const double time = Time(start, via) + Time(via, end) + rest;
      if (time >= best.time - kLess || via == start) continue;
      if (!clearance.LineIsClear(start, via, walls) || !clearance.LineIsClear(via, end, {})) continue;
      best.time = time;
      best.cells = {start, via};
      if (end != via) best.cells.push_back(end);
    }
  }
  return std::move(best.cells);
}

Cell NearestFree(const planner::ContactMap& map, const Eigen::Vector3d& displacement_cells, int orientation) {
  const Eigen::Vector3d lattice = displacement_cells - map.phase();
  const Cell nearest(static_cast<int>(std::lround(lattice.x())), static_cast<int>(std::lround(lattice.y())),
                     static_cast<int>(std::lround(lattice.z())));
  Cell best = nearest;
  double least = std::numeric_limits<double>::infinity();
  for (int x = -2; x <= 2; ++x) {
    for (int y = -2; y <= 2; ++y) {
      for (int z = -2; z <= 2; ++z) {
        const Cell cell = nearest + Cell(x, y, z);
        const double distance = (cell.cast<double>() - lattice).squaredNorm();
        if (distance < least && !map.Blocked(cell, orientation)) {
          least = distance;
          best = cell;
        }
      }
    }
  }
  return best;
}

}  // namespace feeler::execution
