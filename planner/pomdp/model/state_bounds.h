#pragma once

#include <functional>
#include <span>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// Bounds on V* of a POMDP that need no search, in reward terms. Vectors over states; every sweep keeps them bounds, so
/// they hold wherever the sweeps stop. With a discount of 1 (a goal POMDP), lower ones are infinite where a policy does
/// not reach a goal.
struct StateBounds {
  /// Q of the MDP whose state is observed: V*(b) <= max_a sum_s b(s) qmdp[a][s] (Littman, Cassandra and Kaelbling
  /// 1995).
  std::vector<std::vector<double>> qmdp;
  /// The fast informed bound (Hauskrecht 2000): the state is observed one step late. Between V* and QMDP.
  std::vector<std::vector<double>> informed;
  /// Value of doing the same action for ever: V*(b) >= max_a sum_s b(s) blind[a][s] (Hauskrecht 1997).
  std::vector<std::vector<double>> blind;
};

struct StateBoundsOptions {
  int sweeps = 1000;        ///< at most, of each
  double precision = 1e-7;  ///< stop where a sweep changes less, relative to the largest value
  /// Asked now and then; true to stop early. May be empty.
  std::function<bool()> stop = {};
};

StateBounds ComputeStateBounds(const Pomdp& pomdp, const StateBoundsOptions& options = {});

/// max over the rows of sum b(s) row[s].
double BestRow(const std::vector<std::vector<double>>& rows, std::span<const SparseEntry> belief);

}  // namespace feeler::planner
