// The table gives, bit for bit, the point that a walk over all gives: the first of the farthest.
#include "feeler/planner/contact/support_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "feeler/core/random.h"

namespace feeler::planner {
namespace {

std::size_t FirstOfFarthest(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& direction) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (direction.dot(points[i]) > direction.dot(points[best])) best = i;
  }
  return best;
}

void ExpectTheSame(const std::vector<Eigen::Vector3d>& points, RandomStream& random) {
  const SupportTable table(points);
  for (int i = 0; i < 2000; ++i) {
    Eigen::Vector3d direction(random.Normal(), random.Normal(), random.Normal());
    if (i % 4 == 0) direction[static_cast<int>(random.Index(3))] = 0.0;
    if (i % 8 == 0) direction = Eigen::Vector3d::Unit(static_cast<int>(random.Index(3)));  // many are as far
    direction *= std::exp(random.Uniform(-20.0, 20.0));
    const Eigen::Vector3d& expected = points[FirstOfFarthest(points, direction)];
    EXPECT_EQ(table.Farthest(direction), expected);
  }
}

TEST(SupportTable, IsAWalkOverAllPoints) {
  RandomStream random(1, 0, "support table");
  for (const int count : {1, 2, 8, 9, 50, 333}) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < count; ++i) points.emplace_back(random.Normal(), random.Normal(), random.Normal());
    ExpectTheSame(points, random);
  }
  std::vector<Eigen::Vector3d> frustum;
  for (int k = 0; k < 120; ++k) {
    const double angle = 2 * std::numbers::pi * k / 120;
    frustum.emplace_back(0.006 * std::cos(angle), 0.006 * std::sin(angle), 0.0);
    frustum.emplace_back(0.0075 * std::cos(angle), 0.0075 * std::sin(angle), 0.03);
  }
  ExpectTheSame(frustum, random);
  std::vector<Eigen::Vector3d> lattice;  // of each coordinate many points have the same
  for (int i = 0; i < 216; ++i) lattice.emplace_back(i % 6, (i / 6) % 6, i / 36);
  ExpectTheSame(lattice, random);
}

}  // namespace
}  // namespace feeler::planner
