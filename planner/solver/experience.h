#pragma once

#include <unordered_map>
#include <vector>

#include "planner/belief/belief_graph.h"
#include "planner/solver/policy.h"

namespace feeler::planner {

/// The experience MDP B^E (the paper, Section V-B): beliefs of the present problem, some with the transition that an
/// earlier policy takes there. The graph must not be canonical.
struct ExperienceMdp {
  struct Entry {
    BeliefId belief = 0;
    bool has_action = false;
    double cost = 0.0;                                     ///< expected cost of the action
    std::vector<std::pair<std::size_t, double>> branches;  ///< entry and probability; goals (value zero) left out
  };
  std::vector<Entry> entries;  ///< distinct beliefs; successors come after the beliefs that lead to them
};

/// Rolls out the histories of a policy from the start belief of the graph's problem (Algorithm 3, line 7). Where the
/// policy does not know an outcome, the belief reached is part of B^E without a transition.
ExperienceMdp RollOut(BeliefGraph& graph, const Policy& policy);

/// B^E_naive: the transitions of the policy as they are, aligned at the start cells. Beliefs with hypotheses that the
/// present problem does not have are left out: no jump can lead to them.
ExperienceMdp Transplant(BeliefGraph& graph, const Problem& problem_of_policy, const Policy& policy);

/// The pseudo-cost of jumping from one belief to another: infinite unless H' is a subset of H, else max(L1 distance of
/// the robot cells times the cost of a cell, heur(b) - heur(b')). Both satisfy the triangle inequality, so their
/// maximum does; heur(b) <= heur(b,b') + heur(b').
double JumpHeuristic(const BeliefGraph& graph, BeliefId from, BeliefId to);

/// The experience heuristic heur^E (equations 5 to 7).
class ExperienceHeuristic {
 public:
  /// Algorithm 2: heur^E of the beliefs of B^E, by sweeps of equation 6 from epsilon * heur until nothing changes.
  ExperienceHeuristic(const BeliefGraph& graph, ExperienceMdp experience, double epsilon);

  /// heur^E(b), equation 7 for beliefs outside B^E. At most epsilon * heur(b).
  double operator()(BeliefId b) const;

  const ExperienceMdp& experience() const { return experience_; }
  const std::vector<double>& values() const { return values_; }
  /// Sweeps that Algorithm 2 took.
  int sweeps() const { return sweeps_; }

 private:
  /// A belief of B^E from which following the experience is cheaper than epsilon * heur: only these are worth a jump.
  struct Target {
    BeliefId belief = 0;
    SetId set = 0;
    Cell robot = Cell::Zero();
    double value = 0.0;
    double heuristic = 0.0;
  };
  double BestJump(BeliefId b, double best) const;
  void ListTargets();

  const BeliefGraph& graph_;
  ExperienceMdp experience_;
  double epsilon_ = 1.0;
  std::vector<double> values_;
  std::vector<Target> targets_;
  std::unordered_map<BeliefId, std::size_t> entry_of_;
  int sweeps_ = 0;
};

}  // namespace feeler::planner
