#pragma once

#include <vector>

#include "feeler/perception/point_cloud.h"

namespace feeler::perception {

struct Cluster {
  Points points;
  Eigen::Vector3d densest_m = Eigen::Vector3d::Zero();  ///< the point with the most neighbours
  int neighbours = 0;                                   ///< of that point
};

/// A number for each point, 0 to `groups` - 1, the same for points whose cubes of edge `link_m` touch, directly or by
/// others.
std::vector<int> GroupsOf(const Points& points, double link_m, int& groups);

/// Groups points that a chain of steps of at most about `link_m` joins, and ranks the groups by the point with the most
/// others within `neighbourhood_m`; of each group what lies within `reach_m` of that point. Groups of fewer than
/// `least_points` are left out. At most `count` groups, densest first.
std::vector<Cluster> DensestClusters(const Points& points, double link_m, double neighbourhood_m, double reach_m,
                                     int least_points, int count);

}  // namespace feeler::perception
