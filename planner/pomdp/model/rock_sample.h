#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// RockSample (Smith and Simmons 2004): a rover on a grid of size x size cells knows where it and the rocks are, and
/// not which rocks are good (each with probability 1/2). Moves are certain; leaving to the east ends with +10; sampling
/// gives +10 for a good rock, which is then bad, and -10 for a bad one; `check i` reads rock i rightly with probability
/// (1 + 2^(-d / half_distance)) / 2 at distance d. Moves off the other edges and samples where no rock is cost
/// `illegal` and change nothing.
struct RockSample {
  struct Cell {
    int x = 0, y = 0;  ///< x to the east, y to the north, from 0
    bool operator==(const Cell&) const = default;
  };
  int size = 4;
  std::vector<Cell> rocks;
  Cell start;
  double half_distance = 20.0;
  double discount = 0.95;
  double illegal = -100.0;
};

/// The start in the middle of the western edge and `rocks` rocks in cells drawn from the seed, no two in one.
RockSample DrawRockSample(int size, int rocks, std::uint64_t seed);

/// size^2 2^rocks + 1 states. Throws InputError if it would not fit, or a rock or the start lies outside.
Pomdp MakeRockSample(const RockSample& problem);

}  // namespace feeler::planner
