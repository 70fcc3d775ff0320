#include "feeler/planner/search/experience.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "feeler/planner/policy/expand_policy.h"

namespace feeler::planner {
namespace {

/// Collects beliefs and transitions.
class Builder {
 public:
  explicit Builder(BeliefGraph& graph) : graph_(graph) {}

  std::size_t Entry(BeliefId b) {
    const auto [at, added] = index_.try_emplace(b, mdp_.entries.size());
    if (added) mdp_.entries.push_back({b, {}});
    return at->second;
  }

  bool Applicable(BeliefId b, const GuardedMove& move) const {
    return graph_.problem().workspace.Contains(graph_.robot(b) + move.cells * UnitCell(move.direction));
  }

  /// Adds the transition if it is an action of the belief, that is not without effect. Returns its outcomes. The move
  /// must be applicable.
  std::vector<BeliefOutcome> AddTransition(BeliefId b, const GuardedMove& move) {
    std::vector<BeliefOutcome> outcomes = graph_.Outcomes(b, move);
    const std::size_t entry = Entry(b);
    if (outcomes.size() == 1 && outcomes.front().next == b) return outcomes;
    const auto& known = mdp_.entries[entry].transitions;
    if (std::ranges::find(known, move, &ExperienceMdp::Transition::move) != known.end()) return outcomes;
    ExperienceMdp::Transition transition{move, 0.0, {}};
    for (const BeliefOutcome& outcome : outcomes) {
      const double probability = outcome.weight / graph_.Weight(b);
      transition.cost += probability * graph_.problem().cost.Of(outcome.outcome, move.direction);
      if (outcome.next != kNoBelief) transition.branches.emplace_back(Entry(outcome.next), probability);
    }
    mdp_.entries[entry].transitions.push_back(std::move(transition));
    return outcomes;
  }

  ExperienceMdp Take() { return std::move(mdp_); }

 private:
  BeliefGraph& graph_;
  ExperienceMdp mdp_;
  std::unordered_map<BeliefId, std::size_t> index_;
};

double NormalisedHeuristic(const BeliefGraph& graph, BeliefId b) { return graph.Heuristic(b) / graph.Weight(b); }

}  // namespace

ExperienceMdp RollOut(BeliefGraph& graph, const PolicyGraph& policy) {
  Builder builder(graph);
  using History = std::pair<std::uint32_t, BeliefId>;  // as far as it matters: where the policy is, and what it led to
  std::deque<History> open;
  std::set<History> seen;
  if (const BeliefId start = graph.Start(); start != kNoBelief) open.emplace_back(policy.root, start);
  while (!open.empty()) {
    const auto [index, b] = open.front();
    open.pop_front();
    if (!seen.emplace(index, b).second) continue;
    builder.Entry(b);
    const PolicyNode& node = policy.nodes[index];
    if (node.is_leaf() || !builder.Applicable(b, node.move)) continue;
    for (const BeliefOutcome& outcome : builder.AddTransition(b, node.move)) {
      if (outcome.next == kNoBelief) continue;
      const auto branch = std::ranges::find(node.branches, outcome.outcome, &PolicyBranch::outcome);
      if (branch != node.branches.end()) open.emplace_back(branch->next, outcome.next);
    }
  }
  return builder.Take();
}

ExperienceMdp Transplant(BeliefGraph& graph, const Problem& problem_of_policy, const PolicyGraph& policy) {
  Builder builder(graph);
  const Cell shift = graph.problem().start - problem_of_policy.start;
  for (const ExpandedNode& node : ExpandPolicy(problem_of_policy, policy).nodes) {
    if (node.is_leaf()) continue;
    std::vector<Hypothesis> hypotheses;
    for (const int i : node.hypotheses) {
      hypotheses.push_back(problem_of_policy.hypotheses[static_cast<std::size_t>(i)]);
      hypotheses.back().offset += shift;
    }
    const std::optional<SetId> set = graph.sets().Find(hypotheses);
    if (!set || graph.sets().info(*set).goal || !graph.problem().workspace.Contains(node.robot + shift)) continue;
    const BeliefId b = graph.Intern(*set, node.robot + shift);
    if (builder.Applicable(b, node.move)) builder.AddTransition(b, node.move);
  }
  return builder.Take();
}

double JumpHeuristic(const BeliefGraph& graph, BeliefId from, BeliefId to, JumpKind jumps) {
  const bool possible = jumps == JumpKind::kSameHypotheses
                            ? graph.set(to) == graph.set(from)
                            : graph.sets().IsSubset(graph.set(to), graph.set(from), Cell::Zero());
  if (!possible) return std::numeric_limits<double>::infinity();
  const double distance = graph.problem().cost.per_cell * (graph.robot(from) - graph.robot(to)).cwiseAbs().sum();
  return std::max(distance, NormalisedHeuristic(graph, from) - NormalisedHeuristic(graph, to));
}

ExperienceHeuristic::ExperienceHeuristic(const BeliefGraph& graph, ExperienceMdp experience, double epsilon,
                                         JumpKind jumps)
    : graph_(graph), experience_(std::move(experience)), epsilon_(epsilon), jumps_(jumps) {
  const std::vector<ExperienceMdp::Entry>& entries = experience_.entries;
  values_.resize(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {  // Algorithm 2, lines 2-4
    const BeliefId b = entries[i].belief;
    if (b >= entry_of_.size()) entry_of_.resize(b + std::size_t{1}, 0);
    entry_of_[b] = static_cast<std::uint32_t>(i + 1);
    values_[i] = epsilon_ * NormalisedHeuristic(graph_, b);
  }
  bool converged = false;
  while (!converged) {  // lines 5-9; successors first, so that one sweep carries values all the way up
    converged = true;
    ++sweeps_;
    ListTargets();
    for (std::size_t i = entries.size(); i-- > 0;) {
      const ExperienceMdp::Entry& entry = entries[i];
      double value = values_[i];
      for (const ExperienceMdp::Transition& transition : entry.transitions) {  // equation 6, second case
        double followed = transition.cost;
        for (const auto& [next, probability] : transition.branches) followed += probability * values_[next];
        value = std::min(value, followed);
      }
      value = BestJump(entry.belief, value);  // equation 6, first case
      if (value < values_[i] - 1e-12 * std::max(1.0, values_[i])) converged = false;
      values_[i] = std::min(values_[i], value);
    }
  }
  ListTargets();
}

void ExperienceHeuristic::ListTargets() {
  targets_.clear();
  targets_of_.clear();
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const BeliefId b = experience_.entries[i].belief;
    const double heuristic = NormalisedHeuristic(graph_, b);
    // epsilon heur(b'') <= epsilon heur(b'',b) + epsilon heur(b): with no gain at b a jump there gains nothing.
    if (values_[i] >= epsilon_ * heuristic) continue;
    targets_.push_back({graph_.set(b), graph_.robot(b), values_[i], heuristic});
  }
  std::ranges::stable_sort(targets_, {}, &Target::value);
  if (jumps_ != JumpKind::kSameHypotheses) return;
  for (const Target& target : targets_) targets_of_[target.set].push_back(target);
}

std::span<const ExperienceHeuristic::Target> ExperienceHeuristic::TargetsOf(SetId set) {
  if (jumps_ == JumpKind::kSameHypotheses) {
    const auto at = targets_of_.find(set);
    return at != targets_of_.end() ? std::span<const Target>(at->second) : std::span<const Target>();
  }
  const auto [at, added] = targets_of_.try_emplace(set);
  if (added) {
    std::ranges::copy_if(targets_, std::back_inserter(at->second),
                         [&](const Target& target) { return graph_.sets().IsSubset(target.set, set, Cell::Zero()); });
  }
  return at->second;
}

double ExperienceHeuristic::BestJump(BeliefId b, double best) {
  const std::span<const Target> targets = TargetsOf(graph_.set(b));
  if (targets.empty()) return best;
  const Cell robot = graph_.robot(b);
  const double heuristic = NormalisedHeuristic(graph_, b);
  for (const Target& target : targets) {
    if (target.value >= best) break;
    ++looks_;
    const double distance = graph_.problem().cost.per_cell * (robot - target.robot).cwiseAbs().sum();
    best = std::min(best, epsilon_ * std::max(distance, heuristic - target.heuristic) + target.value);
  }
  return best;
}

double ExperienceHeuristic::operator()(BeliefId b) {
  if (b < entry_of_.size() && entry_of_[b] != 0) return values_[entry_of_[b] - 1];
  return BestJump(b, epsilon_ * NormalisedHeuristic(graph_, b));
}

}  // namespace feeler::planner
