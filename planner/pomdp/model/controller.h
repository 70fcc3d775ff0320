#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// A finite-state controller, the policy of a general POMDP: in each node an action, and for each observation the node
/// that goes on. May be cyclic. Action and observation are indices of the POMDP.
struct PomdpController {
  struct Branch {
    std::uint32_t observation = 0;
    std::uint32_t next = 0;
  };
  struct Node {
    std::uint32_t action = 0;
    std::vector<Branch> branches;  ///< by ascending observation; others lead to `otherwise`
    std::uint32_t otherwise = 0;
  };
  std::vector<Node> nodes;
  std::uint32_t root = 0;

  std::uint32_t Next(std::uint32_t node, std::uint32_t observation) const;
};

struct ControllerValue {
  /// Expected reward from the initial belief, or below it by what the residual may amount to; -infinity where a goal is
  /// not reached for certain.
  double value = 0.0;
  std::size_t unknowns = 0;  ///< pairs of node and state
  double residual = 0.0;     ///< of the linear system with a discount below 1, at most
};

/// Exact evaluation by the linear system V(n, s) = R(a_n, s) + discount sum P(s', o | s, a_n) V(next(n, o), s'), over
/// the pairs that can be met, by Gauss-Seidel sweeps. `stop` may cut them short: then `value` is the lower; before a
/// sweep is done, and without discount (GoalCosts), there may be none.
std::optional<ControllerValue> EvaluateController(const Pomdp& pomdp, const PomdpController& controller,
                                                  const std::function<bool()>& stop = {});

/// Throws InputError at `where` if an action, an observation or a node does not exist.
void Validate(const Pomdp& pomdp, const PomdpController& controller, const std::string& where);

}  // namespace feeler::planner
