#pragma once

#include <Eigen/Core>
#include <vector>

#include "feeler/cad/section/section.h"

namespace feeler::cad {

/// Radius over angle of a closed line, about the middle of the area that it encloses.
struct Profile {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  std::vector<double> farthest_m;  ///< where it meets rays at equal angles, from the x axis counterclockwise
  std::vector<double> nearest_m;
  std::vector<double> farthest_sorted_m;
  std::vector<double> nearest_sorted_m;
  bool round = false;  ///< every turn is as good
};
Profile ProfileOf(const SlabLoop& loop);

/// What is farther on the wrong side is no fit at its angle, whatever way it is moved.
inline constexpr double kFarOut_m = 5e-4;

/// Turns of `inner` (0 to 2 pi) under which it lies farthest inside of `outer`, the middles on each other: the best
/// first, of equals the smallest turn either way; a few degrees apart, at most `most`. None where one of them is round.
std::vector<double> TurnsInto(const Profile& inner, const Profile& outer, std::size_t most);

/// A turn of `inner` near `turn_rad`, at which sides of both are parallel; `turn_rad` itself where there are none.
/// Sides: straight stretches between corners, or long ones; the facets of an arc are none.
double WithParallelSides(const SlabLoop& inner, const SlabLoop& outer, double turn_rad, bool& found);

/// The least distance between two closed lines of which the first lies inside of the second; where it does not,
/// negative: how far a corner of one is on the wrong side of the other. What is less than `least_m` need not be known
/// better. m
double Room(const std::vector<Eigen::Vector2d>& inner, const std::vector<Eigen::Vector2d>& outer, double least_m);

/// `inner` moved to where it has the most room, in steps down to a micrometre: returns the way, and the room.
struct Centered {
  Eigen::Vector2d move = Eigen::Vector2d::Zero();
  double room_m = 0.0;
};
Centered MostRoom(const std::vector<Eigen::Vector2d>& inner, const std::vector<Eigen::Vector2d>& outer, double reach_m);

}  // namespace feeler::cad
