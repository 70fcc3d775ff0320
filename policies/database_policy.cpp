#include "feeler/policies/database_policy.h"

#include <string>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::policies {

DatabasePolicy::DatabasePolicy(std::shared_ptr<const planner::PolicyGraph> policy) : policy_(std::move(policy)) {
  if (!policy_ || policy_->root >= policy_->nodes.size()) {
    throw InputError("policy", "the graph has no root", "solve the problem again");
  }
  for (const planner::PolicyNode& node : policy_->nodes) {
    for (const planner::PolicyBranch& branch : node.branches) {
      if (branch.next >= policy_->nodes.size()) {
        throw InputError(
            "policy",
            "a branch leads to node " + std::to_string(branch.next) + " of " + std::to_string(policy_->nodes.size()),
            "make the policy again");
      }
    }
    if (node.is_leaf() && node.leaf.empty())
      throw InputError("policy", "a leaf holds no hypothesis", "make the policy again");
    if (!node.is_leaf() && node.move.cells < 1)
      throw InputError("policy", "a move of less than one cell", "make the policy again");
  }
  node_ = policy_->root;
}

void DatabasePolicy::Begin(const planner::Problem& /*problem*/) {
  node_ = policy_->root;
  shift_ = Cell::Zero();
  depth_ = 0;
}

Decision DatabasePolicy::Next(const Belief& /*belief*/) {
  if (node().is_leaf()) return Insert{};
  // The graph of a sound policy is acyclic: no walk is longer than its nodes are many.
  if (depth_ >= policy_->nodes.size()) return GiveUp{"the policy graph has a cycle"};
  return node().move;
}

bool DatabasePolicy::Observe(const Outcome& outcome) {
  for (const planner::PolicyBranch& branch : node().branches) {
    if (branch.outcome == outcome) {
      shift_ += branch.shift;
      node_ = branch.next;
      ++depth_;
      return true;
    }
  }
  return false;
}

std::vector<Hypothesis> DatabasePolicy::LeafHypotheses() const {
  std::vector<Hypothesis> hypotheses;
  for (const planner::PolicyLeaf& leaf : node().leaf)
    hypotheses.push_back({leaf.offset + shift_, leaf.orientation, 1.0});
  return hypotheses;
}

}  // namespace feeler::policies
