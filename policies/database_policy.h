#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "feeler/planner/policy/policy_graph.h"
#include "feeler/policies/policy.h"

namespace feeler::policies {

/// Walks the graph of a policy computed ahead of time, from its root, one branch per outcome.
class DatabasePolicy final : public Policy {
 public:
  /// Throws InputError unless every node index lies in the graph and the root exists.
  explicit DatabasePolicy(std::shared_ptr<const planner::PolicyGraph> policy);

  std::string_view name() const override { return "database"; }
  bool reads_hypotheses() const override { return false; }
  void Begin(const planner::Problem& problem) override;
  Decision Next(const Belief& belief) override;
  bool Observe(const Outcome& outcome) override;

  const planner::PolicyNode& node() const { return policy_->nodes[node_]; }
  /// Offset of the node's canonical frame in the coordinates of the problem.
  const Cell& shift() const { return shift_; }
  /// Hypotheses that the present leaf holds, in the coordinates of the problem; empty inside the graph.
  std::vector<Hypothesis> LeafHypotheses() const;

 private:
  std::shared_ptr<const planner::PolicyGraph> policy_;
  std::uint32_t node_ = 0;
  Cell shift_ = Cell::Zero();
  std::size_t depth_ = 0;
};

}  // namespace feeler::policies
