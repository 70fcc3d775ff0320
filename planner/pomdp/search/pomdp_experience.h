#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "feeler/planner/pomdp/model/controller.h"
#include "feeler/planner/pomdp/search/pomdp_belief_graph.h"

namespace feeler::planner {

/// heur^E of E-RTDP-Bel (the paper, Algorithm 2, equations 5 to 7) on a general POMDP, in costs to the goal.
///
/// B^E: the beliefs that a policy of a similar problem leads to from the initial belief of this one (Algorithm 3, line
/// 7). A jump from b to b' costs epsilon heur(b, b') with heur(b, b') = max(0, heur(b) - heur(b')) if both have the
/// same states, else it is impossible; so heur(b) <= heur(b, b') + heur(b'), and the triangle inequality holds.
class PomdpExperience {
 public:
  /// Rolls out at most `limit` beliefs; `graph` grows by them. Throws Interrupted where `stop` (asked now and then, may
  /// be empty) or that of the graph says so.
  PomdpExperience(PomdpBeliefGraph& graph, const PomdpController& policy, double epsilon, std::size_t limit,
                  const std::function<bool()>& stop = {});

  /// At most epsilon * heur(b).
  double operator()(std::uint32_t b) const;
  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::uint32_t belief = 0;
    std::uint32_t node = 0;  ///< of the policy
    double cost = 0.0;
    std::vector<std::pair<std::uint32_t, double>> branches;  ///< entry and share
    bool followed = false;                                   ///< false where the roll-out was cut
    double value = 0.0;
  };
  void RollOut(const PomdpController& policy, std::size_t limit);
  void Sweep(Pulse pulse);
  std::uint64_t StatesOf(std::uint32_t b) const;

  PomdpBeliefGraph& graph_;
  double epsilon_;
  std::vector<Entry> entries_;
  std::unordered_map<std::uint32_t, double> value_of_;  ///< least value of a belief of B^E
  struct Target {
    double heuristic = 0.0;
    double value = 0.0;
  };
  std::unordered_map<std::uint64_t, std::vector<Target>> targets_;  ///< by set of states; worth a jump
};

}  // namespace feeler::planner
