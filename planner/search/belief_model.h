#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

namespace feeler::planner {

/// What RTDP-Bel and E-RTDP-Bel need to know of a problem class: a belief MDP that grows on demand, with beliefs
/// numbered from 0 as they appear.
///
/// Values are carried times the weight of their belief, w(b) V(b), where the weight of a belief is the sum of its
/// successors' weights under any action. The backup of Algorithm 1, line 5, then needs no division, w Q(b,a) = w C(b,a)
/// + sum_z w(b_a^z) V(b_a^z), and whole numbers stay whole.
///
/// Laws: Start() is no goal and has a finite value; successors are no goals (their value is zero, so they are left
/// out); actions never cost nothing without changing the belief.
template <class Model>
concept BeliefModel = requires(Model& model, std::uint32_t b) {
  { model.Start() } -> std::convertible_to<std::uint32_t>;
  { model.size() } -> std::convertible_to<std::size_t>;
  { model.Weight(b) } -> std::convertible_to<double>;
  { model.Heuristic(b) } -> std::convertible_to<double>;
  { model.expanded(b) } -> std::convertible_to<bool>;
  { (*model.Actions(b).begin()).cost } -> std::convertible_to<double>;
  model.ForEachSuccessor(*model.Actions(b).begin(), [](std::uint32_t) {});
};

}  // namespace feeler::planner
