#include "feeler/planner/noise/carry_out.h"

#include <algorithm>
#include <optional>

#include "feeler/planner/noise/noisy_outcomes.h"

namespace feeler::planner {
namespace {

class Carrier {
 public:
  Carrier(const NoisyProblem& noisy, const PolicyGraph& policy) : noisy_(noisy), policy_(policy), moves_(noisy.noise) {}

  NoisyEvaluation Under(const Hypothesis& truth) {
    known_.assign(policy_.nodes.size(), std::nullopt);
    return From(policy_.root, noisy_.problem.start, truth);
  }

 private:
  /// The graph is acyclic, and each node is one belief: it knows the robot's cell.
  const NoisyEvaluation& From(std::uint32_t n, const Cell& robot, const Hypothesis& truth) {
    if (known_[n]) return *known_[n];
    const PolicyNode& node = policy_.nodes[n];
    NoisyEvaluation sum;
    if (node.is_leaf()) {
      const bool right = std::ranges::any_of(node.leaf, [&](const PolicyLeaf& leaf) {
        return leaf.offset == truth.offset && leaf.orientation == truth.orientation;
      });
      (right ? sum.right : sum.wrong) = 1.0;
      sum.expected_cost = right ? 0.0 : noisy_.WrongCost();
    } else {
      const int room = Simulate(noisy_.problem, robot, node.move, truth).cells;
      const NoisyMove& does = moves_.Of(node.move.cells, room);
      sum.expected_cost = does.Cost(noisy_.problem.cost, node.move.direction);
      sum.moves = 1.0;
      for (const NoisyOutcome& o : does.outcomes) {
        const auto branch = std::ranges::find_if(
            node.branches, [&](const PolicyBranch& b) { return b.outcome.cells == o.outcome.cells; });
        if (branch == node.branches.end()) {
          sum.given_up += o.probability;
          sum.expected_cost += o.probability * noisy_.WrongCost();
        } else {
          Add(o.probability, From(branch->next, robot + o.outcome.cells * UnitCell(node.move.direction), truth), sum);
        }
      }
    }
    known_[n] = sum;
    return *known_[n];
  }

 public:
  static void Add(double share, const NoisyEvaluation& part, NoisyEvaluation& sum) {
    sum.expected_cost += share * part.expected_cost;
    sum.right += share * part.right;
    sum.wrong += share * part.wrong;
    sum.given_up += share * part.given_up;
    sum.moves += share * part.moves;
  }

 private:
  const NoisyProblem& noisy_;
  const PolicyGraph& policy_;
  NoisyMoves moves_;
  std::vector<std::optional<NoisyEvaluation>> known_;
};

}  // namespace

NoisyEvaluation CarryOut(const NoisyProblem& noisy, const PolicyGraph& policy) {
  Carrier carrier(noisy, policy);
  NoisyEvaluation sum;
  double weights = 0.0;
  for (const Hypothesis& h : noisy.problem.hypotheses) weights += h.weight;
  for (const Hypothesis& h : noisy.problem.hypotheses) Carrier::Add(h.weight / weights, carrier.Under(h), sum);
  return sum;
}

}  // namespace feeler::planner
