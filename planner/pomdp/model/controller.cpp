#include "feeler/planner/pomdp/model/controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/model/goal_costs.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {
namespace {

constexpr double kPrecision = 1e-12;
constexpr int kSweeps = 100000;

/// The linear system of a controller: rows of the pairs (node, state) that can be met.
struct System {
  std::vector<SparseEntry> start;
  SparseRows rows;  ///< discounted
  std::vector<double> reward;
  std::vector<std::uint8_t> final;  ///< of goals: value 0

  System(const Pomdp& pomdp, const PomdpController& controller, Pulse& pulse) {
    constexpr std::size_t kPairWork = 50;  // see Pulse
    const std::vector<std::uint8_t> absorbing = AbsorbingStates(pomdp);
    std::unordered_map<std::uint64_t, std::uint32_t> number;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    const auto of = [&](std::uint32_t node, std::uint32_t state) {
      const auto [found, added] =
          number.try_emplace(std::uint64_t{node} << 32 | state, static_cast<std::uint32_t>(pairs.size()));
      if (added) pairs.emplace_back(node, state);
      return found->second;
    };
    for (const SparseEntry& s : pomdp.start) start.push_back({of(controller.root, s.index), s.value});
    std::vector<SparseEntry> row;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto [n, s] = pairs[i];
      const PomdpController::Node& node = controller.nodes[n];
      row.clear();
      final.push_back(absorbing[s]);
      reward.push_back(absorbing[s] != 0 ? 0.0 : pomdp.reward[pomdp.At(node.action, s)]);
      if (absorbing[s] == 0) {
        for (const SparseEntry& next : pomdp.transitions.Row(pomdp.At(node.action, s))) {
          const auto seen = pomdp.observation_rows.Row(pomdp.At(node.action, next.index));
          pulse(kPairWork * seen.size());
          for (const SparseEntry& o : seen) {
            row.push_back({of(controller.Next(n, o.index), next.index), pomdp.discount * next.value * o.value});
          }
        }
      }
      rows.Append(row);
    }
  }
};

}  // namespace

std::uint32_t PomdpController::Next(std::uint32_t node, std::uint32_t observation) const {
  const std::vector<Branch>& branches = nodes[node].branches;
  const auto found = std::ranges::lower_bound(branches, observation, {}, &Branch::observation);
  return found != branches.end() && found->observation == observation ? found->next : nodes[node].otherwise;
}

namespace {

std::optional<ControllerValue> Evaluate(const Pomdp& pomdp, const PomdpController& controller,
                                        const std::function<bool()>& stop) {
  Pulse pulse(stop);
  System system(pomdp, controller, pulse);
  ControllerValue result;
  result.unknowns = system.reward.size();
  std::vector<double> values(result.unknowns, 0.0);
  if (pomdp.discount == 1.0) {
    for (double& reward : system.reward) reward = std::max(0.0, -reward);
    const auto costs = GoalCosts({std::move(system.rows), std::move(system.reward), std::move(system.final)}, stop);
    if (!costs) return std::nullopt;
    for (const SparseEntry& s : system.start) result.value -= s.value * (*costs)[s.index];
    return result;
  }
  double scale = 1.0;
  double fall = 0.0;  // of the last sweep, at most
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    result.residual = fall = 0.0;
    // Backwards: successors come after what leads to them, mostly.
    for (std::size_t i = values.size(); i-- > 0;) {
      double value = system.reward[i];
      for (const SparseEntry& next : system.rows.Row(i)) value += next.value * values[next.index];
      result.residual = std::max(result.residual, std::abs(value - values[i]));
      fall = std::max(fall, values[i] - value);
      values[i] = value;
      scale = std::max(scale, std::abs(value));
    }
    if (result.residual <= kPrecision * scale || (stop && stop())) break;
  }
  for (const SparseEntry& s : system.start) result.value += s.value * values[s.index];
  // Sweeps are monotone, and take a constant off by discount times it at least: later ones fall by ever less.
  result.value -= fall * pomdp.discount / (1.0 - pomdp.discount);
  return result;
}

}  // namespace

std::optional<ControllerValue> EvaluateController(const Pomdp& pomdp, const PomdpController& controller,
                                                  const std::function<bool()>& stop) {
  try {
    return Evaluate(pomdp, controller, stop);
  } catch (const Interrupted&) {
    return std::nullopt;
  }
}

void Validate(const Pomdp& pomdp, const PomdpController& controller, const std::string& where) {
  const auto require = [&](bool holds, std::size_t node, const char* what) {
    if (!holds) throw InputError(where, fmt::format("node {}: {}", node, what), "is the policy of another model?");
  };
  require(controller.root < controller.nodes.size(), controller.root, "the root does not exist");
  for (std::size_t n = 0; n < controller.nodes.size(); ++n) {
    const PomdpController::Node& node = controller.nodes[n];
    require(node.action < pomdp.action_count(), n, "no such action");
    require(node.otherwise < controller.nodes.size(), n, "the node after other observations does not exist");
    for (const PomdpController::Branch& branch : node.branches) {
      require(branch.observation < pomdp.observation_count(), n, "no such observation");
      require(branch.next < controller.nodes.size(), n, "a branch leads nowhere");
    }
    require(std::ranges::adjacent_find(node.branches, std::ranges::greater_equal(),
                                       &PomdpController::Branch::observation) == node.branches.end(),
            n, "observations twice or out of order");
  }
}

}  // namespace feeler::planner
