#include "feeler/planner/pomdp/model/rock_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/core/random.h"

namespace feeler::planner {
namespace {

enum Observation : std::uint32_t { kNothing, kGood, kBad };

void Validate(const RockSample& problem) {
  const auto inside = [&](const RockSample::Cell& c) {
    return c.x >= 0 && c.y >= 0 && c.x < problem.size && c.y < problem.size;
  };
  if (problem.size < 1 || problem.rocks.size() > 30) {
    throw InputError("RockSample", fmt::format("size {}, {} rocks", problem.size, problem.rocks.size()),
                     "size at least 1, at most 30 rocks");
  }
  if (!inside(problem.start) || !std::ranges::all_of(problem.rocks, inside)) {
    throw InputError("RockSample", "the start or a rock lies outside of the grid", "cells count from 0");
  }
  const double states = std::pow(problem.size, 2) * std::pow(2.0, static_cast<double>(problem.rocks.size())) + 1.0;
  const double actions = 5.0 + static_cast<double>(problem.rocks.size());
  RequireFits("RockSample", states, actions, 3.0 * states * actions);
}

}  // namespace

RockSample DrawRockSample(int size, int rocks, std::uint64_t seed) {
  if (size < 1 || rocks < 0 || rocks > size * size) {
    throw InputError("RockSample", fmt::format("{} rocks in {} x {} cells", rocks, size, size),
                     "a cell holds one rock");
  }
  RandomStream random(seed, 0, "rock-sample");
  RockSample problem;
  problem.size = size;
  problem.start = {0, size / 2};
  while (problem.rocks.size() < static_cast<std::size_t>(rocks)) {
    const auto count = static_cast<std::uint64_t>(size);
    const RockSample::Cell cell{static_cast<int>(random.Index(count)), static_cast<int>(random.Index(count))};
    if (std::ranges::find(problem.rocks, cell) == problem.rocks.end()) problem.rocks.push_back(cell);
  }
  return problem;
}

Pomdp MakeRockSample(const RockSample& problem) {
  Validate(problem);
  const std::size_t rocks = problem.rocks.size();
  const std::uint32_t kinds = 1U << rocks;
  const auto size = static_cast<std::uint32_t>(problem.size);
  const std::uint32_t gone = size * size * kinds;
  Pomdp pomdp;
  pomdp.name = fmt::format("RockSample_{}_{}", problem.size, rocks);
  pomdp.discount = problem.discount;
  pomdp.actions = {"north", "south", "east", "west", "sample"};
  for (std::size_t r = 0; r < rocks; ++r) pomdp.actions.push_back(fmt::format("check{}", r));
  pomdp.observations = {"none", "good", "bad"};
  const auto number = [&](RockSample::Cell c, std::uint32_t good) {
    return (static_cast<std::uint32_t>(c.y) * size + static_cast<std::uint32_t>(c.x)) * kinds + good;
  };
  const auto cell_of = [&](std::uint32_t s) {
    return RockSample::Cell{static_cast<int>(s / kinds % size), static_cast<int>(s / kinds / size)};
  };
  for (std::uint32_t s = 0; s < gone; ++s) {
    std::string name = fmt::format("x{}y{}r", cell_of(s).x, cell_of(s).y);
    for (std::size_t r = 0; r < rocks; ++r) name += (s >> r & 1U) != 0 ? 'g' : 'b';
    pomdp.states.push_back(name);
  }
  pomdp.states.push_back("gone");

  for (std::size_t a = 0; a < pomdp.actions.size(); ++a) {
    for (std::uint32_t s = 0; s <= gone; ++s) {
      std::uint32_t next = s;
      double reward = 0.0;
      double good = -1.0;  // probability of reading good, where the action reads
      if (s != gone) {
        RockSample::Cell c = cell_of(s);
        const std::uint32_t kind = s % kinds;
        if (a < 4) {
          const int dx[] = {0, 0, 1, -1};
          const int dy[] = {1, -1, 0, 0};
          c.x += dx[a];
          c.y += dy[a];
          if (c.x == problem.size) {
            next = gone;
            reward = 10.0;
          } else if (c.x < 0 || c.y < 0 || c.y == problem.size) {
            reward = problem.illegal;
          } else {
            next = number(c, kind);
          }
        } else if (a == 4) {
          const auto rock = std::ranges::find(problem.rocks, c) - problem.rocks.begin();
          if (rock == static_cast<std::ptrdiff_t>(rocks)) {
            reward = problem.illegal;
          } else {
            const std::uint32_t bit = 1U << rock;
            reward = (kind & bit) != 0 ? 10.0 : -10.0;
            next = number(c, kind & ~bit);
          }
        } else {
          const RockSample::Cell& rock = problem.rocks[a - 5];
          const double efficiency = std::exp2(-std::hypot(rock.x - c.x, rock.y - c.y) / problem.half_distance);
          good = (kind >> (a - 5) & 1U) != 0 ? 0.5 + 0.5 * efficiency : 0.5 - 0.5 * efficiency;
        }
      }
      const SparseEntry moved{next, 1.0};
      pomdp.transitions.Append({&moved, 1});
      pomdp.reward.push_back(reward);
      std::vector<SparseEntry> read = {{kNothing, 1.0}};
      if (good >= 0.0) read = {{kGood, good}, {kBad, 1.0 - good}};
      std::erase_if(read, [](const SparseEntry& e) { return e.value == 0.0; });
      pomdp.observation_rows.Append(read);
    }
  }
  for (std::uint32_t kind = 0; kind < kinds; ++kind) pomdp.start.push_back({number(problem.start, kind), 1.0 / kinds});
  return pomdp;
}

}  // namespace feeler::planner
