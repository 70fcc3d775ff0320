#include "feeler/planner/pomdp/search/point_based_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace feeler::planner {
namespace {

/// Trials close this share of the gap at the start, so that early ones stay short.
constexpr double kTrialShare = 0.9;
constexpr std::size_t kLongestTrial = 2000;
/// Trials in a row that change nothing before the search gives up: what a belief has not looked at yet may still
/// differ.
constexpr int kIdleTrials = 100;
/// Outcomes less likely than this are left to rounding: they change no value by more than it.
constexpr double kImpossible = 1e-14;
/// Beliefs that agree to so many parts are the same up to rounding of the arithmetic.
constexpr double kBeliefUnit = 1e12;

std::uint64_t HashOf(std::uint32_t class_index, const std::vector<SparseEntry>& belief) {
  std::uint64_t hash = class_index + 0x9E3779B97F4A7C15;
  for (const SparseEntry& s : belief) {
    hash = (hash ^ (s.index + static_cast<std::uint64_t>(std::llround(s.value * kBeliefUnit)))) * 0xFF51AFD7ED558CCD;
    hash ^= hash >> 32;
  }
  return hash;
}

bool Same(const std::vector<SparseEntry>& a, const std::vector<SparseEntry>& b) {
  return std::ranges::equal(a, b, [](const SparseEntry& x, const SparseEntry& y) {
    return x.index == y.index && std::llround(x.value * kBeliefUnit) == std::llround(y.value * kBeliefUnit);
  });
}

}  // namespace

PointBasedSearch::PointBasedSearch(const Pomdp& pomdp, const ObservableClasses& classes, const StateBounds& bounds)
    : pomdp_(pomdp), classes_(classes), alphas_(classes.classes.size()) {
  const std::size_t actions = pomdp.action_count();
  std::size_t largest = 0;
  for (const double r : pomdp.reward) scale_ = std::max(scale_, std::abs(r));
  for (std::size_t c = 0; c < classes.classes.size(); ++c) {
    const std::vector<std::uint32_t>& states = classes.classes[c].states;
    largest = std::max(largest, states.size());
    std::vector<std::vector<double>> rows(actions);
    for (std::size_t a = 0; a < actions; ++a) {
      // Going on with the same action: its vector has the same number in every class.
      AlphaVector blind{static_cast<std::uint32_t>(a), {}, {}, kNone};
      blind.next.assign(classes.classes[c].outcomes[a].size(), static_cast<std::uint32_t>(a));
      for (const std::uint32_t s : states) {
        blind.values.push_back(bounds.blind[a][s]);
        rows[a].push_back(bounds.informed[a][s]);
      }
      alphas_[c].Add(std::move(blind));
    }
    uppers_.emplace_back(std::move(rows));
  }
  dense_.assign(largest, 0.0);
  next_dense_.assign(largest, 0.0);
  Intern(classes.start_class, classes.start);
}

std::uint32_t PointBasedSearch::Intern(std::uint32_t class_index, std::vector<SparseEntry> belief) {
  const std::uint64_t hash = HashOf(class_index, belief);
  const auto [begin, end] = index_.equal_range(hash);
  for (auto it = begin; it != end; ++it) {
    const Node& node = nodes_[it->second];
    if (node.class_index == class_index && Same(node.belief, belief)) return it->second;
  }
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  ++changes_;
  node_bytes_ += sizeof(Node) + 64 + belief.size() * sizeof(SparseEntry);
  nodes_.push_back({class_index, std::move(belief), {}, {}, {}, {}});
  index_.emplace(hash, number);
  Refresh(class_index, nodes_.back().belief, nodes_.back().bound);
  return number;
}

void PointBasedSearch::Refresh(std::uint32_t class_index, std::span<const SparseEntry> belief, Bound& bound) {
  pulse_(belief.size() * alphas_[class_index].Unseen(bound.alphas) + 10 * uppers_[class_index].Unseen(bound.points));
  bound.lower = std::max(bound.lower, alphas_[class_index].Advance(belief, bound.alphas));
  for (const SparseEntry& s : belief) dense_[s.index] = s.value;
  bound.upper = std::min(bound.upper, uppers_[class_index].Advance(belief, dense_.data(), bound.upper, bound.points));
  for (const SparseEntry& s : belief) dense_[s.index] = 0.0;
}

void PointBasedSearch::Successor(const Node& node, const ClassOutcome& outcome) {
  pulse_(2 * outcome.steps.size() + classes_.classes[outcome.next].states.size());
  for (const SparseEntry& s : node.belief) dense_[s.index] = s.value;
  double sum = 0.0;
  for (const ClassOutcome::Step& step : outcome.steps) {
    const double p = dense_[step.from] * step.probability;
    next_dense_[step.to] += p;
    sum += p;
  }
  for (const SparseEntry& s : node.belief) dense_[s.index] = 0.0;
  belief_.clear();
  const std::size_t count = classes_.classes[outcome.next].states.size();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (next_dense_[i] == 0.0) continue;
    belief_.push_back({i, next_dense_[i] / sum});
    next_dense_[i] = 0.0;
  }
}

void PointBasedSearch::Expand(std::uint32_t number) {
  Node& node = nodes_[number];
  if (!node.first_child.empty()) return;
  ++expansions_;
  const ObservableClasses::Class& c = classes_.classes[node.class_index];
  for (const SparseEntry& s : node.belief) dense_[s.index] = s.value;
  for (std::size_t a = 0; a < pomdp_.action_count(); ++a) {
    node.first_child.push_back(static_cast<std::uint32_t>(node.children.size()));
    double reward = 0.0;
    for (const SparseEntry& s : node.belief) reward += s.value * pomdp_.reward[pomdp_.At(a, c.states[s.index])];
    node.reward.push_back(reward);
    for (std::uint32_t o = 0; o < c.outcomes[a].size(); ++o) {
      double probability = 0.0;
      pulse_(c.outcomes[a][o].steps.size());
      for (const ClassOutcome::Step& step : c.outcomes[a][o].steps) probability += dense_[step.from] * step.probability;
      if (probability > kImpossible) node.children.push_back({probability, o, kNone, {}});
    }
  }
  node.first_child.push_back(static_cast<std::uint32_t>(node.children.size()));
  node.children.shrink_to_fit();
  for (const SparseEntry& s : node.belief) dense_[s.index] = 0.0;
  node_bytes_ += node.children.size() * sizeof(Child) + node.reward.size() * 12;
  // Bounds to begin with; later looked at as far as they matter.
  for (std::size_t a = 0; a < pomdp_.action_count(); ++a) RefreshAction(number, a);
}

void PointBasedSearch::RefreshAction(std::uint32_t number, std::size_t action) {
  Node& node = nodes_[number];
  const std::vector<ClassOutcome>& outcomes = classes_.classes[node.class_index].outcomes[action];
  for (std::uint32_t i = node.first_child[action]; i < node.first_child[action + 1]; ++i) {
    Child& child = node.children[i];
    const std::uint32_t next = outcomes[child.outcome].next;
    if (child.node != kNone) {
      Refresh(next, nodes_[child.node].belief, nodes_[child.node].bound);
      continue;
    }
    Successor(node, outcomes[child.outcome]);
    Refresh(next, belief_, child.bound);
  }
}

double PointBasedSearch::ActionUpper(std::uint32_t number, std::size_t action) {
  Node& node = nodes_[number];
  double sum = 0.0;
  for (std::uint32_t i = node.first_child[action]; i < node.first_child[action + 1]; ++i) {
    sum += node.children[i].probability * BoundOf(node.children[i]).upper;
  }
  return node.reward[action] + pomdp_.discount * sum;
}

double PointBasedSearch::ActionLower(std::uint32_t number, std::size_t action) {
  Node& node = nodes_[number];
  double sum = 0.0;
  for (std::uint32_t i = node.first_child[action]; i < node.first_child[action + 1]; ++i) {
    sum += node.children[i].probability * BoundOf(node.children[i]).lower;
  }
  return node.reward[action] + pomdp_.discount * sum;
}

std::size_t PointBasedSearch::Update(std::uint32_t number) {
  Expand(number);
  const std::size_t actions = pomdp_.action_count();
  q_upper_.resize(actions);
  refreshed_.assign(actions, 0);
  for (std::size_t a = 0; a < actions; ++a) q_upper_[a] = ActionUpper(number, a);
  const auto refresh = [&](std::size_t a) {
    RefreshAction(number, a);
    refreshed_[a] = 1;
    q_upper_[a] = ActionUpper(number, a);
  };
  const auto greatest = [&] { return static_cast<std::size_t>(std::ranges::max_element(q_upper_) - q_upper_.begin()); };
  std::size_t chosen = greatest();
  for (; refreshed_[chosen] == 0; chosen = greatest()) refresh(chosen);
  Bound& bound = nodes_[number].bound;
  if (q_upper_[chosen] < bound.upper - least_change_) {
    bound.upper = q_upper_[chosen];
    ++changes_;
    uppers_[nodes_[number].class_index].Add(number, nodes_[number].belief, bound.upper);
  }

  double best = -std::numeric_limits<double>::infinity();
  std::size_t best_action = 0;
  for (std::vector<double> left = q_upper_;;) {
    const auto a = static_cast<std::size_t>(std::ranges::max_element(left) - left.begin());
    if (!(left[a] > best)) break;
    left[a] = -std::numeric_limits<double>::infinity();
    if (refreshed_[a] == 0) refresh(a);
    const double lower = ActionLower(number, a);
    if (lower <= best) continue;
    best = lower;
    best_action = a;
  }
  if (best > bound.lower + least_change_) AddAlpha(number, best_action);
  return chosen;
}

void PointBasedSearch::AddAlpha(std::uint32_t number, std::size_t action) {
  Node& node = nodes_[number];
  const ObservableClasses::Class& c = classes_.classes[node.class_index];
  AlphaVector vector{static_cast<std::uint32_t>(action), {}, {}, number};
  const std::vector<ClassOutcome>& outcomes = c.outcomes[action];
  vector.next.resize(outcomes.size(), kNone);
  for (std::uint32_t i = node.first_child[action]; i < node.first_child[action + 1]; ++i) {
    vector.next[node.children[i].outcome] = BoundOf(node.children[i]).alphas.best;
  }
  std::vector<double>& values = vector.values;
  values.assign(c.states.size(), 0.0);
  for (std::size_t o = 0; o < outcomes.size(); ++o) {
    const AlphaStore& store = alphas_[outcomes[o].next];
    if (vector.next[o] == kNone) vector.next[o] = store.fallback();
    const std::vector<double>& next = store[vector.next[o]].values;
    pulse_(outcomes[o].steps.size());
    for (const ClassOutcome::Step& step : outcomes[o].steps) values[step.from] += step.probability * next[step.to];
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = pomdp_.reward[pomdp_.At(action, c.states[i])] + pomdp_.discount * values[i];
  }
  double value = 0.0;
  for (const SparseEntry& s : node.belief) value += s.value * values[s.index];
  if (value <= node.bound.lower + least_change_) return;
  const std::uint32_t added = alphas_[node.class_index].Add(std::move(vector));
  ++changes_;
  node.bound.lower = value;
  node.bound.alphas.best = added;
}

std::uint32_t PointBasedSearch::WidestSuccessor(std::uint32_t number, std::size_t action, double width) {
  Node& node = nodes_[number];
  std::uint32_t widest = kNone;
  double most = 0.0;
  for (std::uint32_t i = node.first_child[action]; i < node.first_child[action + 1]; ++i) {
    const Bound& bound = BoundOf(node.children[i]);
    const double excess = node.children[i].probability * (bound.upper - bound.lower - width);
    if (excess <= most) continue;
    most = excess;
    widest = i;
  }
  if (widest == kNone) return kNone;
  if (node.children[widest].node != kNone) return node.children[widest].node;
  const ClassOutcome& outcome = classes_.classes[node.class_index].outcomes[action][node.children[widest].outcome];
  Successor(node, outcome);
  const std::uint32_t next = Intern(outcome.next, belief_);  // may move the nodes
  Child& child = nodes_[number].children[widest];
  Bound& bound = nodes_[next].bound;
  bound.lower = std::max(bound.lower, child.bound.lower);
  bound.upper = std::min(bound.upper, child.bound.upper);
  child.node = next;
  return next;
}

std::optional<SolverStatus> PointBasedSearch::Run(
    double precision, const std::function<std::optional<SolverStatus>(std::int64_t)>& stop) {
  std::optional<SolverStatus> why;
  pulse_ = Pulse([&] { return (why = stop(expansions_)).has_value(); });
  try {
    why = RunTrials(precision, stop);
  } catch (const Interrupted&) {
  }
  pulse_ = Pulse();
  return why;
}

std::optional<SolverStatus> PointBasedSearch::RunTrials(
    double precision, const std::function<std::optional<SolverStatus>(std::int64_t)>& stop) {
  // Where rewards are large, what matters may be less than a usual part of them.
  least_change_ = scale_ * std::clamp(1e-2 * precision / scale_, 1e-14, 1e-10);
  std::vector<std::uint32_t> trial;
  int idle = 0;
  while (upper() - lower() > precision) {
    ++trials_;
    const std::int64_t changes = changes_;
    trial.clear();
    double width = std::max(precision, kTrialShare * (upper() - lower()));
    std::uint32_t node = 0;
    while (node != kNone && trial.size() < kLongestTrial &&
           nodes_[node].bound.upper - nodes_[node].bound.lower > width) {
      if (const auto why = stop(expansions_)) return why;
      const std::size_t action = Update(node);
      trial.push_back(node);
      width /= pomdp_.discount;
      node = WidestSuccessor(node, action, width);
    }
    for (; !trial.empty(); trial.pop_back()) {
      if (const auto why = stop(expansions_)) return why;
      Update(trial.back());
    }
    Prune();
    idle = changes_ == changes ? idle + 1 : 0;
    if (idle == kIdleTrials) return SolverStatus::kRounding;
  }
  return std::nullopt;
}

void PointBasedSearch::Prune() {
  for (std::size_t c = 0; c < classes_.classes.size(); ++c) {
    if (uppers_[c].Crowded()) uppers_[c].Rebase(dense_, pulse_);
    if (!alphas_[c].Crowded()) continue;
    std::vector<std::uint8_t> marked(alphas_[c].size(), 0);
    for (Node& node : nodes_) {
      if (node.class_index != c) continue;
      Refresh(node.class_index, node.belief, node.bound);
      if (node.bound.alphas.best != kNone) marked[node.bound.alphas.best] = 1;
    }
    alphas_[c].Keep(marked);
  }
}

PointBasedPlan PointBasedSearch::Plan(bool relinked) const {
  PointBasedPlan plan;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> number;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> vectors;  // class and vector of each node
  const auto of = [&](std::uint32_t c, std::uint32_t vector) {
    const auto [found, added] = number.try_emplace({c, vector}, static_cast<std::uint32_t>(vectors.size()));
    if (added) vectors.emplace_back(c, vector);
    return found->second;
  };
  of(nodes_[0].class_index, nodes_[0].bound.alphas.best);
  for (std::uint32_t i = 0; i < vectors.size(); ++i) {
    const auto [c, v] = vectors[i];
    const AlphaVector& vector = alphas_[c][v];
    std::vector<std::uint32_t> next = vector.next;
    if (relinked && vector.born != kNone) {
      // The best that is known by now for the beliefs after the one that the vector was made at.
      const Node& node = nodes_[vector.born];
      for (std::uint32_t k = node.first_child[vector.action]; k < node.first_child[vector.action + 1]; ++k) {
        const Child& child = node.children[k];
        const Bound& bound = child.node == kNone ? child.bound : nodes_[child.node].bound;
        if (bound.alphas.best != kNone) next[child.outcome] = bound.alphas.best;
      }
    }
    PomdpController::Node step;
    step.action = vector.action;
    const std::vector<ClassOutcome>& outcomes = classes_.classes[c].outcomes[vector.action];
    for (std::size_t o = 0; o < outcomes.size(); ++o) {
      step.branches.push_back({outcomes[o].observation, of(outcomes[o].next, next[o])});
    }
    step.otherwise = i;
    plan.controller.nodes.push_back(std::move(step));
    plan.largest_class = std::max(plan.largest_class, vector.values.size());
  }
  plan.vectors = std::move(vectors);
  return plan;
}

std::size_t PointBasedSearch::bytes() const {
  std::size_t total = node_bytes_;
  for (const AlphaStore& store : alphas_) total += store.bytes();
  for (const Sawtooth& store : uppers_) total += store.bytes();
  return total;
}

}  // namespace feeler::planner
