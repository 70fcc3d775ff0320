#include "feeler/perception/clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>

#include "feeler/core/lattice_grid.h"
#include "feeler/perception/nearest_points.h"

namespace feeler::perception {
namespace {

using CubeKey = std::array<std::int64_t, 3>;

}  // namespace

std::vector<int> GroupsOf(const Points& points, double link_m, int& groups) {
  std::map<CubeKey, std::vector<std::size_t>> cubes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    cubes[CubeOf(points[i], link_m)].push_back(i);
  }
  std::map<CubeKey, int> group_of;
  groups = 0;
  for (const auto& [seed, members] : cubes) {
    if (group_of.contains(seed)) continue;
    const int group = groups++;
    std::vector<CubeKey> open = {seed};
    group_of[seed] = group;
    while (!open.empty()) {
      const CubeKey at = open.back();
      open.pop_back();
      for (int n = 0; n < 27; ++n) {
        const CubeKey next = {at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
        if (cubes.contains(next) && group_of.emplace(next, group).second) open.push_back(next);
      }
    }
  }
  std::vector<int> group(points.size());
  for (const auto& [key, members] : cubes) {
    for (const std::size_t i : members) group[i] = group_of.at(key);
  }
  return group;
}

std::vector<Cluster> DensestClusters(const Points& points, double link_m, double neighbourhood_m, double reach_m,
                                     int least_points, int count) {
  if (points.empty()) return {};
  int groups = 0;
  const std::vector<int> group_of = GroupsOf(points, link_m, groups);
  std::vector<std::vector<std::size_t>> members(static_cast<std::size_t>(groups));
  for (std::size_t i = 0; i < points.size(); ++i) members[static_cast<std::size_t>(group_of[i])].push_back(i);

  std::vector<Cluster> clusters;
  for (const std::vector<std::size_t>& group : members) {
    if (static_cast<int>(group.size()) < least_points) continue;
    Points own;
    own.reserve(group.size());
    for (const std::size_t i : group) own.push_back(points[i]);
    const NearestPoints tree(own);
    // Neighbourhoods overlap: it is enough to look at some of the points.
    const std::size_t step = std::max<std::size_t>(1, own.size() / 400);
    Cluster cluster;
    for (std::size_t i = 0; i < own.size(); i += step) {
      const int neighbours = static_cast<int>(tree.CountWithin(own[i], neighbourhood_m));
      if (neighbours <= cluster.neighbours) continue;
      cluster.neighbours = neighbours;
      cluster.densest_m = own[i];
    }
    for (const Eigen::Vector3d& p : own) {
      if ((p - cluster.densest_m).norm() <= reach_m) cluster.points.push_back(p);
    }
    clusters.push_back(std::move(cluster));
  }
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const Cluster& a, const Cluster& b) { return a.neighbours > b.neighbours; });
  if (clusters.size() > static_cast<std::size_t>(count)) clusters.resize(static_cast<std::size_t>(count));
  return clusters;
}

}  // namespace feeler::perception
