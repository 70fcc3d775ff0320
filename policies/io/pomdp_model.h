#pragma once

#include <string>
#include <vector>

#include "feeler/planner/belief/problem.h"

namespace feeler::policies {

/// A problem written out as tables: what both POMDP formats are printed from.
struct PomdpModel {
  struct Step {
    int cell = 0;  ///< index of the robot cell on arrival
    double cost = 0.0;
  };
  std::vector<Cell> cells;         ///< robot cells reachable from the start under some hypothesis; 0 is the start
  std::vector<GuardedMove> moves;  ///< that are applicable somewhere
  std::vector<std::vector<int>> declarations;  ///< sets of hypotheses, largest ones that are goals
  std::vector<double> prior;                   ///< normalised, of the hypotheses
  double penalty = 0.0;                        ///< of a wrong declaration, and of a move that is not applicable

  int hypothesis_count() const { return static_cast<int>(prior.size()); }
  /// What a move does from a cell under a hypothesis. Where it is not applicable, or the cell is not free under the
  /// hypothesis (no history leads there), the robot stays and pays the penalty.
  const Step& At(std::size_t move, std::size_t cell, std::size_t hypothesis) const {
    return steps[(move * cells.size() + cell) * prior.size() + hypothesis];
  }
  std::vector<Step> steps;

  std::string CellName(std::size_t cell) const;
  std::string MoveName(std::size_t move) const;
  std::string DeclarationName(std::size_t declaration) const;
};

/// Throws InputError if there were more than `max_steps` steps, NegativeResult if the problem cannot be localized.
PomdpModel MakePomdpModel(const planner::Problem& problem, double upper_bound, std::size_t max_steps);

/// Upper bound of the optimal expected cost of a problem that can be localized. While a belief is no goal it holds a
/// pair of hypotheses that is none. The policy that tells this pair apart at least cost, W at worst from anywhere a
/// history consistent with both can lead, splits the belief, or a third hypothesis cuts in with at most one more move;
/// a belief can be split |H| - 1 times. Throws NegativeResult if a pair cannot be told apart from the start.
double CostBound(const planner::Problem& problem, const PomdpModel& model);

}  // namespace feeler::policies
