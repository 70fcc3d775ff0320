#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/noise/noisy_belief_graph.h"

namespace feeler::planner {

/// A policy of a noisy problem: in each node a move and, for each outcome, the node that goes on; at its ends what is
/// declared. May be cyclic.
struct NoisyPolicy {
  struct Branch {
    Outcome outcome;
    std::uint32_t next = 0;
    double probability = 0.0;  ///< given the belief of the node
  };
  struct Node {
    GuardedMove move;              ///< cells = 0 at an end
    std::vector<Branch> branches;  ///< every possible outcome; empty exactly at an end
    std::vector<int> declared;     ///< at an end: hypotheses declared, in problem order; empty where it is given up
    double confidence = 0.0;       ///< at an end: probability that the declared set holds the truth
    double expected_cost = 0.0;    ///< to go
    bool ends() const { return branches.empty(); }
  };
  std::vector<Node> nodes;
  std::uint32_t root = 0;
};

/// What a policy does, from the start belief.
struct NoisyEvaluation {
  double expected_cost = 0.0;  ///< costs of moves, of wrong declarations and of giving up
  double right = 0.0;          ///< probability of declaring a set that holds the truth
  double wrong = 0.0;          ///< of declaring one that does not
  double given_up = 0.0;
  double moves = 0.0;  ///< expected number
};

/// The policy that makes the move `move_of(b)` at every belief it reaches from the start (cells = 0: ends). Beliefs
/// reached with less than `least_reach` end, and all that are left, the least probable ones, once `late(nodes)` (may
/// be empty) says so. `beliefs` (may be null): of each node.
NoisyPolicy FreezeNoisyPolicy(NoisyBeliefGraph& graph, const std::function<GuardedMove(std::uint32_t)>& move_of,
                              double least_reach, NoisyEvaluation* evaluation,
                              std::vector<std::uint32_t>* beliefs = nullptr,
                              const std::function<bool(std::size_t)>& late = {});

/// How often a move whose outcome leaves a belief as it is with probability `stays` is made again before that counts as
/// giving up: so often that it happens with less than 1e-18.
int MostRepeats(double stays);

/// The exact cost of a policy under each hypothesis, in problem order, replayed step by step against the contact map
/// and independent of beliefs: moves, a wrong declaration and giving up paid by `noisy`. Outcomes that have no branch
/// (too improbable for one), moves repeated more than MostRepeats, what goes round without a way out and what is
/// reached with less than 1e-13 count as giving up, which only adds to the cost.
std::vector<double> ReplayNoisyPolicy(const NoisyProblem& noisy, const NoisyPolicy& policy);

}  // namespace feeler::planner
