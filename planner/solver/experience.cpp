#include "planner/solver/experience.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <utility>

#include "planner/solver/expand_policy.h"

namespace feeler::planner {
namespace {

/// Collects beliefs and transitions; each belief keeps the first transition it is given.
class Builder {
 public:
  explicit Builder(BeliefGraph& graph) : graph_(graph) {}

  std::size_t Entry(BeliefId b) {
    const auto [at, added] = index_.try_emplace(b, mdp_.entries.size());
    if (added) mdp_.entries.push_back({b, false, 0.0, {}});
    return at->second;
  }

  /// Adds the transition if it is an action of the belief: applicable, and not without effect. Returns its outcomes.
  std::vector<BeliefOutcome> AddTransition(BeliefId b, const GuardedMove& move) {
    if (!graph_.problem().workspace.Contains(graph_.robot(b) + move.cells * UnitCell(move.direction))) return {};
    std::vector<BeliefOutcome> outcomes = graph_.Outcomes(b, move);
    if (outcomes.size() == 1 && outcomes.front().next == b) return {};
    const std::size_t entry = Entry(b);
    double cost = 0.0;
    std::vector<std::pair<std::size_t, double>> branches;
    for (const BeliefOutcome& outcome : outcomes) {
      const double probability = outcome.weight / graph_.Weight(b);
      cost += probability * graph_.problem().cost.Of(outcome.outcome);
      if (outcome.next != kNoBelief) branches.emplace_back(Entry(outcome.next), probability);
    }
    mdp_.entries[entry].has_action = true;
    mdp_.entries[entry].cost = cost;
    mdp_.entries[entry].branches = std::move(branches);
    return outcomes;
  }

  bool HasAction(BeliefId b) const {
    const auto at = index_.find(b);
    return at != index_.end() && mdp_.entries[at->second].has_action;
  }

  ExperienceMdp Take() { return std::move(mdp_); }

 private:
  BeliefGraph& graph_;
  ExperienceMdp mdp_;
  std::unordered_map<BeliefId, std::size_t> index_;
};

double NormalisedHeuristic(const BeliefGraph& graph, BeliefId b) { return graph.Heuristic(b) / graph.Weight(b); }

}  // namespace

ExperienceMdp RollOut(BeliefGraph& graph, const Policy& policy) {
  Builder builder(graph);
  std::deque<std::pair<std::uint32_t, BeliefId>> open;
  if (const BeliefId start = graph.Start(); start != kNoBelief) open.emplace_back(policy.root, start);
  while (!open.empty()) {
    const auto [index, b] = open.front();
    open.pop_front();
    if (builder.HasAction(b)) continue;
    builder.Entry(b);
    const PolicyNode& node = policy.nodes[index];
    if (node.is_leaf()) continue;
    for (const BeliefOutcome& outcome : builder.AddTransition(b, node.move)) {
      if (outcome.next == kNoBelief) continue;
      const auto branch = std::ranges::find(node.branches, outcome.outcome, &PolicyBranch::outcome);
      if (branch != node.branches.end()) open.emplace_back(branch->next, outcome.next);
    }
  }
  return builder.Take();
}

ExperienceMdp Transplant(BeliefGraph& graph, const Problem& problem_of_policy, const Policy& policy) {
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
    if (!builder.HasAction(b)) builder.AddTransition(b, node.move);
  }
  return builder.Take();
}

double JumpHeuristic(const BeliefGraph& graph, BeliefId from, BeliefId to) {
  if (!graph.sets().IsSubset(graph.set(to), graph.set(from), Cell::Zero())) {
    return std::numeric_limits<double>::infinity();
  }
  const double distance = graph.problem().cost.per_cell * (graph.robot(from) - graph.robot(to)).cwiseAbs().sum();
  return std::max(distance, NormalisedHeuristic(graph, from) - NormalisedHeuristic(graph, to));
}

ExperienceHeuristic::ExperienceHeuristic(const BeliefGraph& graph, ExperienceMdp experience, double epsilon)
    : graph_(graph), experience_(std::move(experience)), epsilon_(epsilon) {
  const std::vector<ExperienceMdp::Entry>& entries = experience_.entries;
  values_.resize(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {  // Algorithm 2, lines 2-4
    entry_of_[entries[i].belief] = i;
    values_[i] = epsilon_ * NormalisedHeuristic(graph_, entries[i].belief);
  }
  bool converged = false;
  while (!converged) {  // lines 5-9; successors first, so that one sweep carries values all the way up
    converged = true;
    ++sweeps_;
    ListTargets();
    for (std::size_t i = entries.size(); i-- > 0;) {
      const ExperienceMdp::Entry& entry = entries[i];
      double value = values_[i];
      if (entry.has_action) {  // equation 6, second case
        double followed = entry.cost;
        for (const auto& [next, probability] : entry.branches) followed += probability * values_[next];
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
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const BeliefId b = experience_.entries[i].belief;
    const double heuristic = NormalisedHeuristic(graph_, b);
    // epsilon heur(b'') <= epsilon heur(b'',b) + epsilon heur(b): with no gain at b a jump there gains nothing.
    if (values_[i] >= epsilon_ * heuristic) continue;
    targets_.push_back({b, graph_.set(b), graph_.robot(b), values_[i], heuristic});
  }
  std::ranges::stable_sort(targets_, {}, &Target::value);
}

double ExperienceHeuristic::BestJump(BeliefId b, double best) const {
  const SetId set = graph_.set(b);
  const Cell robot = graph_.robot(b);
  const double heuristic = NormalisedHeuristic(graph_, b);
  for (const Target& target : targets_) {
    if (target.value >= best) break;
    const double distance = graph_.problem().cost.per_cell * (robot - target.robot).cwiseAbs().sum();
    const double value = epsilon_ * std::max(distance, heuristic - target.heuristic) + target.value;
    if (value < best && graph_.sets().IsSubset(target.set, set, Cell::Zero())) best = value;
  }
  return best;
}

double ExperienceHeuristic::operator()(BeliefId b) const {
  const auto known = entry_of_.find(b);
  if (known != entry_of_.end()) return values_[known->second];
  return BestJump(b, epsilon_ * NormalisedHeuristic(graph_, b));
}

}  // namespace feeler::planner
