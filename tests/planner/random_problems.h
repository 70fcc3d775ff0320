#pragma once

#include <array>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/belief/lattice_problem.h"

namespace feeler::planner::testing {

/// Which kinds of problem `RandomProblem` draws.
struct RandomProblemOptions {
  bool three_d = false;
  bool weights = false;     ///< a prior that is not uniform
  bool costs = false;       ///< costs per contact and per action
  bool axis_costs = false;  ///< another cost per cell along each axis
  bool insertable = false;  ///< goal insertable with a spread of one cell
  int most_hypotheses = 5;
};

inline int Draw(RandomStream& random, int low, int high) {
  return low + static_cast<int>(random.Index(static_cast<std::uint64_t>(high - low + 1)));
}

/// A small lattice problem: a tool of one or two cells, a target that is a slot, an L, a pocket or a scatter of cells,
/// a few hypotheses of its offset around the middle, a start that is free under all. Deterministic in (seed, index).
/// The problem may be unlocalizable.
inline LatticeProblemData RandomProblem(std::uint64_t seed, std::uint64_t index, const RandomProblemOptions& options) {
  RandomStream random(seed, index, "random lattice problem");
  while (true) {
    LatticeProblemData data;
    data.name = "random " + std::to_string(index);
    data.size = options.three_d ? Cell(Draw(random, 3, 4), Draw(random, 3, 4), Draw(random, 3, 4))
                                : Cell(Draw(random, 4, 7), Draw(random, 4, 6), 1);
    data.tool = {Cell::Zero()};
    if (random.Uniform() < 0.4) data.tool.emplace_back(1, 0, 0);
    switch (random.Index(4)) {
      case 0:  // a slot: a wall with a gap
        for (int y = -4; y <= 4; ++y) {
          if (y != 0) data.target.emplace_back(0, y, 0);
        }
        break;
      case 1:  // an L
        data.target = {Cell(0, 0, 0), Cell(1, 0, 0), Cell(2, 0, 0), Cell(0, 1, 0)};
        break;
      case 2:  // a pocket, open at the top
        data.target = {Cell(-1, 0, 0), Cell(-1, 1, 0), Cell(0, 0, 0), Cell(1, 0, 0), Cell(1, 1, 0)};
        break;
      default:
        for (int i = Draw(random, 1, 4); i > 0; --i) {
          data.target.emplace_back(Draw(random, -1, 1), Draw(random, -1, 1), 0);
        }
    }
    if (options.three_d && random.Uniform() < 0.5) {
      const std::vector<Cell> layer = data.target;
      for (const Cell& c : layer) data.target.emplace_back(c.x(), c.y(), 1);
    }
    std::set<std::tuple<int, int, int>> offsets;
    const int count = Draw(random, 2, options.most_hypotheses);
    const Cell middle = data.size / 2;
    for (int tries = 0; tries < 50 && static_cast<int>(offsets.size()) < count; ++tries) {
      const Cell h = middle + Cell(Draw(random, -2, 2), Draw(random, -2, 2), options.three_d ? Draw(random, -1, 1) : 0);
      if (!offsets.emplace(h.x(), h.y(), h.z()).second) continue;
      data.hypotheses.push_back({h, 0, options.weights ? random.Uniform(0.1, 3.0) : 1.0});
    }
    data.start = Cell(Draw(random, 0, data.size.x() - 1), Draw(random, 0, data.size.y() - 1),
                      Draw(random, 0, data.size.z() - 1));
    data.move_lengths = random.Uniform() < 0.5 ? std::vector<int>{1, 2, 4} : std::vector<int>{1, 3};
    if (options.costs) data.cost = {random.Uniform(0.2, 2.0), random.Uniform(0.0, 3.0), random.Uniform(0.0, 3.0)};
    if (options.axis_costs) {
      std::array<double, 3> per_cell{};
      for (double& value : per_cell) value = random.Uniform(0.2, 4.0);
      data.cost = CostPerAxis(per_cell, data.cost.per_contact, data.cost.per_action);
    }
    if (options.insertable) {
      data.goal = GoalKind::kInsertable;
      data.insertable_spread = Cell(1, 1, 0);
    }
    bool blocked = false;
    for (const Hypothesis& h : data.hypotheses) {
      for (const Cell& tool : data.tool) {
        for (const Cell& target : data.target) blocked = blocked || tool + data.start == target + h.offset;
      }
    }
    if (!blocked) return data;
  }
}

}  // namespace feeler::planner::testing
