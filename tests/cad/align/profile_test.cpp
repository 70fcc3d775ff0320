// A closed line around its middle has a radius at every angle, and a turned line fits into itself, made wider, at that
// turn: whatever its size, and wherever its corners are, be it on the very rays along which radii are measured.
#include "feeler/cad/align/profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "feeler/core/random.h"

namespace feeler::cad {
namespace {

constexpr double kPi = std::numbers::pi;

/// Counterclockwise, with corners at equal steps of the parameter.
SlabLoop Oval(double a_m, double b_m, int corners, double turn_rad) {
  SlabLoop loop;
  for (int k = 0; k < corners; ++k) {
    const double t = 2 * kPi * k / corners;
    const Eigen::Vector2d at = Eigen::Rotation2Dd(turn_rad) * Eigen::Vector2d(a_m * std::cos(t), b_m * std::sin(t));
    loop.push_back({at, at, at});
  }
  return loop;
}

TEST(Profile, HasARadiusAtEveryAngle) {
  RandomStream random(1, 0, "profiles");
  for (int i = 0; i < 300; ++i) {
    const double a_m = random.Uniform(0.002, 0.01);
    const double b_m = i % 3 == 0 ? a_m : random.Uniform(0.5, 1.0) * a_m;
    const std::vector<int> corners = {4, 12, 72, 90, 120, 360};
    SlabLoop loop = Oval(a_m, b_m, corners[random.Index(corners.size())], 0.0);
    if (i % 2 == 0) std::reverse(loop.begin(), loop.end());  // around a hole
    const Profile profile = ProfileOf(loop);
    const double half = 0.5 * std::min(a_m, b_m);  // of a square on its tip its sides are as near as 0.7
    EXPECT_GT(profile.nearest_sorted_m.front(), half) << i;
    EXPECT_LT(profile.farthest_sorted_m.back(), 1.0001 * a_m) << i;
    for (std::size_t bin = 0; bin < profile.nearest_m.size(); ++bin)
      EXPECT_NEAR(profile.nearest_m[bin], profile.farthest_m[bin], 1e-9) << i;
  }
}

TEST(Profile, ATurnedLineFitsIntoItselfMadeWider) {
  RandomStream random(2, 0, "profiles");
  for (int i = 0; i < 60; ++i) {
    const double size_m = random.Uniform(0.002, 0.012);
    const double clearance_m = 0.02 * size_m;
    const double turn_rad = random.Uniform(-kPi, kPi);
    const Profile inner = ProfileOf(Oval(size_m, 0.64 * size_m, 90, turn_rad));
    const Profile outer = ProfileOf(Oval(size_m + clearance_m, 0.64 * size_m + clearance_m, 90, 0.0));
    const std::vector<double> turns = TurnsInto(inner, outer, 6);
    EXPECT_TRUE(std::any_of(turns.begin(), turns.end(),
                            [&](double t) {
                              return std::abs(std::remainder(t + turn_rad, kPi)) <
                                     0.01;  // half a turn more does as well
                            }))
        << size_m << ' ' << turn_rad;
  }
}

}  // namespace
}  // namespace feeler::cad
