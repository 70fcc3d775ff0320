#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

namespace feeler::planner {

/// A model of normalised beliefs, whose successors come with the probability of their outcome.
template <class Model>
concept HasShares = requires(Model& model, std::uint32_t b) {
  model.ForEachShare(*model.Actions(b).begin(), [](std::uint32_t, double) {});
};

/// Calls f(successor, share) for each outcome of an action that is no goal. Models whose beliefs carry their
/// probability as a weight list successors (ForEachSuccessor; all shares are 1), models of normalised beliefs list them
/// with the probability of the outcome (ForEachShare).
template <class Model, class Action, class F>
void ForEachShareOf(Model& model, const Action& action, F f) {
  if constexpr (HasShares<Model>) {
    model.ForEachShare(action, f);
  } else {
    model.ForEachSuccessor(action, [&](std::uint32_t next) { f(next, 1.0); });
  }
}

/// What RTDP-Bel, E-RTDP-Bel and the bounded search need to know of a problem class: a belief MDP that grows on demand,
/// with beliefs numbered from 0 as they appear.
///
/// Values are carried times the weight of their belief, w(b) V(b). Either the weight of a belief is the sum of its
/// successors' weights under any action (its probability: the beliefs of lattice problems, where it depends on the
/// hypotheses alone); the backup of Algorithm 1, line 5, then needs no division, w Q(b,a) = w C(b,a) + sum_z w(b_a^z)
/// V(b_a^z), and whole numbers stay whole. Or weights are 1 and successors come with shares: Q(b,a) = C(b,a) + sum_z
/// share(z) V(b_a^z), shares summing to at most 1 (less by what reaches a goal).
///
/// Laws: Start() is no goal and has a finite value; successors are no goals (their value is zero, or part of the cost
/// of the action, so they are left out); actions never cost nothing without changing the belief.
template <class Model>
concept BeliefModel = requires(Model& model, std::uint32_t b) {
  { model.Start() } -> std::convertible_to<std::uint32_t>;
  { model.size() } -> std::convertible_to<std::size_t>;
  { model.Weight(b) } -> std::convertible_to<double>;
  { model.Heuristic(b) } -> std::convertible_to<double>;
  { model.expanded(b) } -> std::convertible_to<bool>;
  { (*model.Actions(b).begin()).cost } -> std::convertible_to<double>;
  ForEachShareOf(model, *model.Actions(b).begin(), [](std::uint32_t, double) {});
};

}  // namespace feeler::planner
