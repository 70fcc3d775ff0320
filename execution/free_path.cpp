#include "execution/free_path.h"

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

/// True if every displacement that the straight line comes nearest to is clear (both ends excepted at the start).
bool LineIsClear(const planner::ContactMap& map, const Cell& from, const Cell& to, int orientation) {
  const Eigen::Vector3d line = (to - from).cast<double>();
  const int samples = std::max(1, static_cast<int>(std::ceil(4.0 * line.norm())));
  for (int i = 0; i <= samples; ++i) {
    const Eigen::Vector3d p = from.cast<double>() + line * i / samples;
    const Cell nearest(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())),
                       static_cast<int>(std::lround(p.z())));
    if (!IsClear(map, nearest, orientation)) return false;
  }
  return true;
}

bool Straight(const Cell& a, const Cell& b, const Cell& c) {
  return (b - a).cross(c - b).isZero() && (b - a).dot(c - b) > 0;
}

/// Keeps the corners of a lattice path, then cuts corners off as long as the lines stay clear.
std::vector<Cell> CutCorners(const planner::ContactMap& map, const std::vector<Cell>& path, int orientation) {
  std::vector<Cell> corners;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool inner = i > 0 && i + 1 < path.size();
    if (!inner || !Straight(path[i - 1], path[i], path[i + 1])) corners.push_back(path[i]);
  }
  std::vector<Cell> cut = {corners.front()};
  for (std::size_t at = 0; at + 1 < corners.size();) {
    std::size_t next = at + 1;
    for (std::size_t far = corners.size() - 1; far > next; --far) {
      if (LineIsClear(map, corners[at], corners[far], orientation)) {
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

std::optional<std::vector<Cell>> FindFreePath(const planner::ContactMap& map, const Cell& start,
                                              const std::function<bool(const Cell&)>& goal, int orientation) {
  CellBox box{map.domain().min - Cell::Constant(2), map.domain().max + Cell::Constant(2)};
  box.min = box.min.cwiseMin(start);
  box.max = box.max.cwiseMax(start);
  const Cell size = box.Size();
  const auto index = [&](const Cell& c) {
    const Cell o = c - box.min;
    return static_cast<std::size_t>((std::int64_t{o.z()} * size.y() + o.y()) * size.x() + o.x());
  };
  const auto cell = [&](std::size_t i) {
    const auto x = static_cast<int>(i % static_cast<std::size_t>(size.x()));
    const std::size_t rest = i / static_cast<std::size_t>(size.x());
    return Cell(box.min + Cell(x, static_cast<int>(rest % static_cast<std::size_t>(size.y())),
                               static_cast<int>(rest / static_cast<std::size_t>(size.y()))));
  };
  const auto count = static_cast<std::size_t>(box.Count());
  std::vector<int> cost(count, std::numeric_limits<int>::max());
  std::vector<std::uint8_t> arrival(count, kDirectionCount);
  // Dijkstra; the index in the key makes the order, and so the path, unique.
  using Entry = std::tuple<int, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[index(start)] = 0;
  open.emplace(0, index(start));
  while (!open.empty()) {
    const auto [so_far, at] = open.top();
    open.pop();
    if (so_far > cost[at]) continue;
    const Cell here = cell(at);
    if (goal(here)) {
      std::vector<Cell> path = {here};
      for (std::size_t i = at; arrival[i] != kDirectionCount;) {
        const Cell previous = cell(i) - UnitCell(kDirections[arrival[i]]);
        path.push_back(previous);
        i = index(previous);
      }
      std::reverse(path.begin(), path.end());
      return CutCorners(map, path, orientation);
    }
    for (const Direction d : kDirections) {
      const Cell next = here + UnitCell(d);
      if (!box.Contains(next) || !map.StepFree(here, d, orientation)) continue;
      const std::size_t to = index(next);
      const int through = so_far + (IsClear(map, next, orientation) ? 1 : kUnclearCost);
      if (through >= cost[to]) continue;
      cost[to] = through;
      arrival[to] = static_cast<std::uint8_t>(IndexOf(d));
      open.emplace(through, to);
    }
  }
  return std::nullopt;
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
