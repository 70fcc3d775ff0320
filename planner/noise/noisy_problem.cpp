#include "feeler/planner/noise/noisy_problem.h"

#include <algorithm>
#include <cstddef>
#include <set>

namespace feeler::planner {

void Validate(const NoisyProblem& noisy) {
  Validate(noisy.problem);
  const std::string where = noisy.problem.name.empty() ? "noise" : "noise of " + noisy.problem.name;
  Validate(noisy.noise, where);
  Validate(noisy.declaration, where);
}

std::vector<std::vector<int>> LargestGoalSets(const Problem& problem) {
  const auto count = static_cast<int>(problem.hypotheses.size());
  std::vector<std::vector<int>> sets;
  if (problem.goal == GoalKind::kSingleton) {
    for (int i = 0; i < count; ++i) sets.push_back({i});
    return sets;
  }
  // Goal `insertable` bounds the spread per axis: boxes with faces at hypotheses suffice.
  std::set<int> lows[3], orientations;
  for (int i = 0; i < count; ++i) {
    const Hypothesis& h = problem.hypotheses[static_cast<std::size_t>(i)];
    for (int axis = 0; axis < 3; ++axis) lows[axis].insert(h.offset[axis]);
    orientations.insert(h.orientation);
  }
  std::set<std::vector<int>> distinct;
  for (const int orientation : orientations) {
    for (const int x : lows[0]) {
      for (const int y : lows[1]) {
        for (const int z : lows[2]) {
          const CellBox box{Cell(x, y, z), Cell(x, y, z) + problem.insertable_spread};
          std::vector<int> inside;
          for (int i = 0; i < count; ++i) {
            const Hypothesis& h = problem.hypotheses[static_cast<std::size_t>(i)];
            if (h.orientation == orientation && box.Contains(h.offset)) inside.push_back(i);
          }
          if (!inside.empty()) distinct.insert(inside);
        }
      }
    }
  }
  for (const std::vector<int>& set : distinct) {
    const bool contained = std::ranges::any_of(distinct, [&](const std::vector<int>& other) {
      return other.size() > set.size() && std::ranges::includes(other, set);
    });
    if (!contained) sets.push_back(set);
  }
  return sets;
}

}  // namespace feeler::planner
