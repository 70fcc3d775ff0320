#include "feeler/policies/noisy_graph_policy.h"

#include <algorithm>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::policies {

NoisyGraphPolicy::NoisyGraphPolicy(std::shared_ptr<const planner::NoisyPolicy> policy, const Doubt& doubt)
    : policy_(std::move(policy)), doubt_(doubt) {
  if (!policy_ || policy_->root >= policy_->nodes.size()) {
    throw InputError("policy with noise", "the graph has no root", "solve the problem again");
  }
  planner::Validate(doubt_.noise, "policy with noise");
  for (const planner::NoisyPolicy::Node& node : policy_->nodes) {
    const bool leads_out = std::ranges::any_of(node.branches, [&](const planner::NoisyPolicy::Branch& branch) {
      return branch.next >= policy_->nodes.size();
    });
    if (leads_out) throw InputError("policy with noise", "a branch leads to no node", "solve the problem again");
    if (!node.ends() && node.move.cells < 1) {
      throw InputError("policy with noise", "a move of less than one cell", "solve the problem again");
    }
  }
  node_ = policy_->root;
}

void NoisyGraphPolicy::Begin(const planner::Problem& /*problem*/) { node_ = policy_->root; }

Decision NoisyGraphPolicy::Next(const Belief& /*belief*/) {
  const planner::NoisyPolicy::Node& node = policy_->nodes[node_];
  if (!node.ends()) return node.move;
  if (node.declared.empty()) return GiveUp{"what was felt is too unlikely to say where the target is"};
  return Insert{};
}

bool NoisyGraphPolicy::Observe(const Outcome& outcome) {
  const planner::NoisyPolicy::Node& node = policy_->nodes[node_];
  const auto branch = std::ranges::find(node.branches, outcome, &planner::NoisyPolicy::Branch::outcome);
  if (branch == node.branches.end()) return false;
  node_ = branch->next;
  return true;
}

}  // namespace feeler::policies
