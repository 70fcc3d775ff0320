#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

#include "feeler/planner/noise/noisy_outcomes.h"
#include "feeler/planner/noise/noisy_problem.h"

namespace feeler::planner {

/// A hypothesis of a belief, by its index in the problem, and its probability.
struct WeightedHypothesis {
  std::uint32_t hypothesis = 0;
  double weight = 0.0;
};

/// The belief MDP of a noisy problem as a model of the searches (BeliefModel), grown on demand: the robot's cell, known
/// exactly, and the probability of each hypothesis. Two beliefs are one if all probabilities agree to 1e-9, and
/// hypotheses less likely than that count as impossible: this alone keeps beliefs few. What it does to values is
/// kept out of what is reported (SolveNoisy): policies are evaluated without beliefs, bounds are lowered.
///
/// The first action of every belief ends the episode: it declares the most probable goal set where that has the
/// probability asked for and pays for being wrong with the probability that is left, else it gives up and pays in full.
/// No belief is a goal. Moves that leave a belief as it is, whatever happens, are no actions; where a move leaves it so
/// with probability q < 1, the action is to repeat the move until something else happens: its cost and the shares of
/// its successors are divided by 1 - q, which changes no optimal value (repeating what was best stays best).
class NoisyBeliefGraph {
 public:
  struct Action {
    double cost = 0.0;
    GuardedMove move;  ///< cells = 0: ends the episode
    std::uint32_t first = 0, count = 0;
    bool ends() const { return move.cells == 0; }
  };
  struct Successor {
    std::uint32_t belief = 0;
    double share = 0.0;
  };
  /// One outcome of a move, with what it leaves the belief at.
  struct Branch {
    Outcome outcome;
    std::uint32_t belief = 0;
    double probability = 0.0;
  };
  /// A lower bound of the optimal cost of a belief.
  using Bound = std::function<double(const Cell& robot, std::span<const WeightedHypothesis> belief)>;

  /// `bound` may be empty (zero). The problem must outlive the graph.
  NoisyBeliefGraph(const NoisyProblem& noisy, Bound bound);

  std::uint32_t Start() const { return 0; }
  std::size_t size() const { return beliefs_.size(); }
  double Weight(std::uint32_t /*b*/) const { return 1.0; }
  double Heuristic(std::uint32_t b) const { return beliefs_[b].heuristic; }
  bool expanded(std::uint32_t b) const { return beliefs_[b].first_action != kUnexpanded; }
  std::span<const Action> Actions(std::uint32_t b) {
    if (!expanded(b)) Expand(b);
    return {actions_.data() + beliefs_[b].first_action, beliefs_[b].action_count};
  }
  template <class F>
  void ForEachShare(const Action& action, F f) const {
    for (std::uint32_t i = action.first; i < action.first + action.count; ++i)
      f(successors_[i].belief, successors_[i].share);
  }

  const NoisyProblem& noisy() const { return noisy_; }
  const Cell& Robot(std::uint32_t b) const { return beliefs_[b].robot; }
  std::span<const WeightedHypothesis> Belief(std::uint32_t b) const {
    return {entries_.data() + beliefs_[b].first, beliefs_[b].count};
  }
  /// The belief without hypotheses less likely than `least`, at the same cell.
  std::uint32_t Core(std::uint32_t b, double least);
  /// A better lower bound of a belief.
  void RaiseHeuristic(std::uint32_t b, double bound) {
    beliefs_[b].heuristic = std::min(beliefs_[b].end_cost, std::max(beliefs_[b].heuristic, bound));
  }
  /// Cost of ending here.
  double EndCost(std::uint32_t b) const { return beliefs_[b].end_cost; }
  /// What is declared at the end: an index into goal_sets(); -1 where it is given up.
  int Declared(std::uint32_t b) const { return beliefs_[b].sure ? beliefs_[b].likeliest : -1; }
  /// The most probable goal set, whether it may be declared or not.
  int Likeliest(std::uint32_t b) const { return beliefs_[b].likeliest; }
  /// Probability of that set.
  double Confidence(std::uint32_t b) const { return beliefs_[b].confidence; }
  const std::vector<std::vector<int>>& goal_sets() const { return goal_sets_; }

  /// What a move does, all outcomes, those that leave the belief as it is included; and what it costs.
  std::vector<Branch> Branches(std::uint32_t b, const GuardedMove& move, double* cost);
  std::size_t bytes() const;

 private:
  static constexpr std::uint32_t kUnexpanded = ~std::uint32_t{0};
  struct Node {
    Cell robot = Cell::Zero();
    std::uint64_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t first_action = kUnexpanded;
    std::uint32_t action_count = 0;
    std::int32_t likeliest = 0;
    bool sure = false;  ///< so probable that it may be declared
    double heuristic = 0.0;
    double end_cost = 0.0;
    double confidence = 0.0;
  };

  /// Normalises and finds or adds; `belief` by ascending hypothesis, `total` its sum.
  std::uint32_t Intern(const Cell& robot, std::vector<WeightedHypothesis>& belief, double total);
  void SetEnd(Node& node) const;
  bool Same(const Node& node, const Cell& robot, std::span<const WeightedHypothesis> belief) const;
  void Expand(std::uint32_t b);
  /// Free cells before the tool under each hypothesis of a belief, at most `longest`, into room_.
  void LookAhead(std::uint32_t b, Direction direction, int longest);
  int LongestApplicable(const Cell& robot, Direction direction) const;
  /// Outcomes of a move along the direction of room_, into branches_; returns its cost.
  double Split(std::uint32_t b, const GuardedMove& move);

  const NoisyProblem& noisy_;
  Bound bound_;
  NoisyMoves moves_;
  std::vector<std::vector<int>> goal_sets_;
  std::vector<Node> beliefs_;
  std::vector<WeightedHypothesis> entries_;
  std::vector<Action> actions_;
  std::vector<Successor> successors_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> index_;
  std::vector<int> room_;
  std::vector<Branch> branches_;
  std::vector<std::vector<WeightedHypothesis>> parts_;  ///< by 2 * cells + contact
  mutable std::vector<double> dense_;                   ///< by hypothesis; zero between uses
};

}  // namespace feeler::planner
