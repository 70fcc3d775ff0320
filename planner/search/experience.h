#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

/// The experience MDP B^E (the paper, Section V-B): beliefs of the present problem, with the transitions that an
/// earlier policy takes there. The graph must not be canonical.
struct ExperienceMdp {
  /// A pair (b, a) of B^E.
  struct Transition {
    GuardedMove move;
    double cost = 0.0;                                     ///< expected cost of the action
    std::vector<std::pair<std::size_t, double>> branches;  ///< entry and probability; goals (value zero) left out
  };
  /// A belief may have no transition (the policy did not foresee it), or several (histories that meet in it).
  struct Entry {
    BeliefId belief = 0;
    std::vector<Transition> transitions;
  };
  std::vector<Entry> entries;  ///< distinct beliefs; mostly, successors come after the beliefs that lead to them
};

/// Rolls out the histories of a policy from the start belief of the graph's problem (Algorithm 3, line 7). Where the
/// policy does not know an outcome, the belief reached is part of B^E without a transition. A move that changes nothing
/// here (a known wall) is passed over: the history goes on with what it returns.
ExperienceMdp RollOut(BeliefGraph& graph, const PolicyGraph& policy);

/// B^E_naive: the transitions of the policy as they are, aligned at the start cells. Beliefs with hypotheses that the
/// present problem does not have are left out: they are no beliefs of B.
ExperienceMdp Transplant(BeliefGraph& graph, const Problem& problem_of_policy, const PolicyGraph& policy);

/// The pseudo-cost of jumping from one belief to another: max(L1 distance of the robot cells times the cost of a cell,
/// heur(b) - heur(b')) if the jump is possible, else infinite. `kSameHypotheses`: possible if H' = H; `kSubsets`: if H'
/// is a subset of H. Both terms satisfy the triangle inequality, and the two relations are transitive, so the
/// maximum does; heur(b) <= heur(b,b') + heur(b').
double JumpHeuristic(const BeliefGraph& graph, BeliefId from, BeliefId to, JumpKind jumps);

/// The experience heuristic heur^E (equations 5 to 7). Grows a cache as it is asked: one thread.
class ExperienceHeuristic {
 public:
  /// Algorithm 2: heur^E of the beliefs of B^E, by sweeps of equation 6 from epsilon * heur until nothing changes.
  ExperienceHeuristic(const BeliefGraph& graph, ExperienceMdp experience, double epsilon, JumpKind jumps);

  /// heur^E(b), equation 7 for beliefs outside B^E. At most epsilon * heur(b).
  double operator()(BeliefId b);

  const ExperienceMdp& experience() const { return experience_; }
  const std::vector<double>& values() const { return values_; }
  /// Sweeps that Algorithm 2 took.
  int sweeps() const { return sweeps_; }
  /// Beliefs of B^E that are worth a jump, and how many of them equation 7 has looked at in all.
  std::size_t targets() const { return targets_.size(); }
  std::int64_t looks() const { return looks_; }

 private:
  /// A belief of B^E from which following the experience is cheaper than epsilon * heur: only these are worth a jump.
  struct Target {
    SetId set = 0;
    Cell robot = Cell::Zero();
    double value = 0.0;
    double heuristic = 0.0;
  };
  double BestJump(BeliefId b, double best);
  void ListTargets();
  /// The targets that a belief with this set can jump to, cheapest first.
  std::span<const Target> TargetsOf(SetId set);

  const BeliefGraph& graph_;
  ExperienceMdp experience_;
  double epsilon_ = 1.0;
  JumpKind jumps_;
  std::vector<double> values_;
  std::vector<std::uint32_t> entry_of_;  ///< by belief: index of the entry + 1, 0 outside B^E
  std::vector<Target> targets_;
  std::unordered_map<SetId, std::vector<Target>> targets_of_;  ///< same hypotheses: complete; subsets: as asked for
  int sweeps_ = 0;
  std::int64_t looks_ = 0;
};

}  // namespace feeler::planner
