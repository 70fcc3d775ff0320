#pragma once

#include <string>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// Tag (Pineau, Gordon and Thrun 2003) in a room of any plan: a robot that knows its cell looks for an opponent that it
/// sees only where it stands itself. Moves cost 1; tagging the opponent earns 10 and ends, tagging nobody costs 10. The
/// opponent stays with probability 0.2, else goes away from where the robot was: along x or along y with 0.4 each, to
/// either side where the robot is at the same coordinate; into a wall it stays.
struct TagRoom {
  /// Rows from the north: '.' is free, '#' a wall, 'R' the free cell of the robot's start. The opponent starts in any
  /// other free cell, all equally likely.
  std::vector<std::string> plan;
  double discount = 0.95;
};

/// cells^2 + 1 states, 5 actions, 2 cells + 1 observations. Throws InputError unless rows are equally long, there is
/// one start, and the cells are at least two and few enough for the tables.
Pomdp MakeTag(const TagRoom& room);

}  // namespace feeler::planner
