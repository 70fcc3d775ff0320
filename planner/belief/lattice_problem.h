#pragma once

#include <string>
#include <vector>

#include "feeler/planner/belief/noise.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

/// The data of a lattice problem file: a problem without a robot. blocked(r,h) iff some tool cell + r = some target
/// cell + h. Only r is confined to `size` (cells 0..size-1); tool and target cells may lie outside. An axis of size 1
/// has no moves. Weights are normalised by the solvers.
struct LatticeProblemData {
  std::string name;
  Cell size = Cell::Ones();
  Cell start = Cell::Zero();
  std::vector<Cell> tool;    ///< relative to r
  std::vector<Cell> target;  ///< relative to h
  std::vector<Hypothesis> hypotheses;
  std::vector<int> move_lengths = {1, 2, 4, 8, 16};
  CostWeights cost;
  GoalKind goal = GoalKind::kSingleton;
  Cell insertable_spread = Cell::Zero();
  Noise noise;  ///< not part of a Problem: see planner/noise
};

/// Builds the contact map from the voxel sets and the problem from the rest; validates. Throws InputError (non-positive
/// size, no tool or target cells, start outside, noise, blocked or duplicate hypotheses, bad weights, more than 2^26
/// displacements).
Problem MakeLatticeProblem(const LatticeProblemData& data);

}  // namespace feeler::planner
