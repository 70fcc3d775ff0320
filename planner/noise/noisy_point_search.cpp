#include "feeler/planner/noise/noisy_point_search.h"

#include <algorithm>
#include <cmath>

#include "feeler/planner/noise/noisy_policy.h"

namespace feeler::planner {
namespace {

/// Trials close this share of the gap at the start, so that early ones stay short.
constexpr double kTrialShare = 0.9;
constexpr std::size_t kLongestTrial = 200;
/// Improvements below this share of the cost of being wrong are left out.
constexpr double kLeastChange = 1e-8;
/// The rest of a belief beside a point is bounded where the point alone gives this share of what is known.
constexpr double kWorthTheRest = 0.5;
/// Trials leave out hypotheses less likely than this while there is something to learn without them: beliefs that
/// differ in them alone share what is found, up to what they weigh times the cost of being wrong.
constexpr double kTiny = 1e-6;
/// Cells of so few vectors or points are not pruned.
constexpr std::size_t kFew = 16;

}  // namespace

NoisyPointSearch::NoisyPointSearch(NoisyBeliefGraph& graph, NoisyBound& bound)
    : graph_(graph),
      bound_(bound),
      moves_(graph.noisy().noise),
      wrong_cost_(graph.noisy().WrongCost()),
      dense_(graph.noisy().problem.hypotheses.size(), 0.0) {
  const Cell size = graph.noisy().problem.workspace.Size();
  cells_.resize(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) *
                static_cast<std::size_t>(size.z()));
}

NoisyPointSearch::CellBounds& NoisyPointSearch::At(const Cell& robot) {
  const CellBox& box = graph_.noisy().problem.workspace;
  const Cell at = robot - box.min;
  const Cell size = box.Size();
  return cells_[static_cast<std::size_t>((at.z() * size.y() + at.y()) * size.x() + at.x())];
}

NoisyPointSearch::State& NoisyPointSearch::Known(std::uint32_t b) {
  if (b >= states_.size()) states_.resize(std::max<std::size_t>(graph_.size(), b + std::size_t{1}));
  State& state = states_[b];
  if (state.lower < 0.0) {
    state.upper = wrong_cost_ * std::max(0.0, 1.0 - graph_.Confidence(b));
    state.lower = std::min(state.upper, graph_.Heuristic(b));
  }
  return state;
}

double NoisyPointSearch::ByPoint(const Point& point, const Cell& robot, std::span<const WeightedHypothesis> belief,
                                 double known) {
  const double least = kWorthTheRest * known;
  double lower = point.lower;
  for (const Share& h : point.shares) {
    lower = std::min(lower, point.lower * dense_[h.hypothesis] * h.inverse);
    if (lower <= least) return 0.0;
  }
  const double share = lower / point.lower;
  for (const Share& h : point.shares) dense_[h.hypothesis] -= share / h.inverse;
  rest_.clear();
  for (const WeightedHypothesis& h : belief) {
    if (dense_[h.hypothesis] > 0.0) rest_.push_back({h.hypothesis, dense_[h.hypothesis]});
    dense_[h.hypothesis] = h.weight;
  }
  return rest_.empty() ? lower : lower + bound_(robot, rest_);
}

NoisyPointSearch::State& NoisyPointSearch::Refreshed(std::uint32_t b) {
  State& state = Known(b);
  const CellBounds& cell = At(graph_.Robot(b));
  const std::span<const WeightedHypothesis> belief = graph_.Belief(b);
  for (auto at = std::ranges::lower_bound(cell.looked_vectors, state.vectors); at != cell.looked_vectors.end(); ++at) {
    const std::vector<double>& costs = cell.vectors[*at].costs;
    double sum = 0.0;
    for (const WeightedHypothesis& h : belief) sum += h.weight * costs[h.hypothesis];
    // Of equals the oldest: plans go on with older ones, so that following the best never goes round.
    if (!(sum < state.upper - kNothing)) continue;
    state.upper = sum;
    state.best = static_cast<std::int32_t>(*at);
  }
  state.vectors = static_cast<std::uint32_t>(cell.vectors.size());
  if (state.points < cell.points.size()) {
    for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = h.weight;
    for (auto at = std::ranges::lower_bound(cell.looked_points, state.points); at != cell.looked_points.end(); ++at) {
      const Point& point = cell.points[*at];
      if (point.belief == b) continue;
      state.lower = std::max(state.lower, ByPoint(point, graph_.Robot(b), belief, state.lower));
    }
    for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = 0.0;
    state.points = static_cast<std::uint32_t>(cell.points.size());
  }
  state.lower = std::min(state.lower, state.upper);
  return state;
}

double NoisyPointSearch::LowerOf(const Cell& robot, std::span<const WeightedHypothesis> belief) {
  double lower = 0.0;
  for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = h.weight;
  const CellBounds& cell = At(robot);
  for (const std::uint32_t at : cell.looked_points) {
    lower = std::max(lower, ByPoint(cell.points[at], robot, belief, lower));
  }
  for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = 0.0;
  return lower;
}

GuardedMove NoisyPointSearch::Move(std::uint32_t b) {
  std::int32_t best = Refreshed(b).best;
  while (best != kDeclares) {
    const Vector& vector = At(graph_.Robot(b)).vectors[static_cast<std::size_t>(best)];
    const std::vector<NoisyBeliefGraph::Branch> branches = graph_.Branches(b, vector.move, nullptr);
    const bool moves = branches.size() != 1 || branches[0].belief != b;
    best = kDeclares;
    // What the plan goes on with may have been pruned since.
    for (const NoisyBeliefGraph::Branch& branch : branches) {
      const auto next = std::ranges::find(vector.next, branch.outcome, &std::pair<Outcome, std::int32_t>::first);
      if (next == vector.next.end() || next->second == kDeclares) continue;
      if (!moves) best = next->second;
      if (branch.belief != b) Offer(branch.belief, next->second);
    }
    if (moves) return vector.move;
    // Made for another belief, the plan begins with a move that leaves this one as it is: it is left out.
  }
  return {Direction::kPlusX, 0};
}

void NoisyPointSearch::Offer(std::uint32_t b, std::int32_t vector) {
  double sum = 0.0;
  for (const WeightedHypothesis& h : graph_.Belief(b)) sum += h.weight * CostUnder(b, vector, h.hypothesis);
  State& state = Refreshed(b);
  if (sum < state.upper - kNothing) state.upper = sum, state.best = vector;
}

std::size_t NoisyPointSearch::Update(std::uint32_t b) {
  const std::span<const NoisyBeliefGraph::Action> actions = graph_.Actions(b);
  if (!Known(b).backed_up) {
    ++expansions_;
    states_[b].backed_up = true;
    At(graph_.Robot(b)).backed_up.push_back(b);
  }
  const auto sum = [&](std::size_t a, bool upper, bool refresh) {
    if (actions[a].ends()) return wrong_cost_ * std::max(0.0, 1.0 - graph_.Confidence(b));
    double q = actions[a].cost;
    graph_.ForEachShare(actions[a], [&](std::uint32_t next, double share) {
      const State& state = refresh ? Refreshed(next) : Known(next);
      q += share * (upper ? state.upper : state.lower);
    });
    return q;
  };
  q_lower_.resize(actions.size());
  fresh_.assign(actions.size(), 0);
  for (std::size_t a = 0; a < actions.size(); ++a) q_lower_[a] = sum(a, false, false);
  const auto least = [&] { return static_cast<std::size_t>(std::ranges::min_element(q_lower_) - q_lower_.begin()); };
  std::size_t chosen = least();
  for (; fresh_[chosen] == 0; chosen = least()) {
    q_lower_[chosen] = sum(chosen, false, true);
    fresh_[chosen] = 1;
  }
  if (q_lower_[chosen] > Refreshed(b).lower + kLeastChange * wrong_cost_) AddPoint(b, q_lower_[chosen]);
  // U of an action is no less than its L: only those that may be better than what is known are looked at.
  double best = states_[b].upper - kLeastChange * wrong_cost_;
  std::size_t best_action = actions.size();
  for (std::size_t a = 0; a < actions.size(); ++a) {
    if (q_lower_[a] >= best || actions[a].ends()) continue;
    const double q = sum(a, true, true);
    if (q < best) best = q, best_action = a;
  }
  if (best_action < actions.size()) AddVector(b, actions[best_action].move);
  return chosen;
}

double NoisyPointSearch::CostUnder(std::uint32_t b, std::int32_t vector, std::uint32_t hypothesis) {
  if (vector == kDeclares) {
    const std::vector<int>& set = graph_.goal_sets()[static_cast<std::size_t>(graph_.Likeliest(b))];
    return std::ranges::binary_search(set, static_cast<int>(hypothesis)) ? 0.0 : wrong_cost_;
  }
  return At(graph_.Robot(b)).vectors[static_cast<std::size_t>(vector)].costs[hypothesis];
}

void NoisyPointSearch::AddVector(std::uint32_t b, const GuardedMove& move) {
  const Problem& problem = graph_.noisy().problem;
  const Cell robot = graph_.Robot(b);
  const std::vector<NoisyBeliefGraph::Branch> branches = graph_.Branches(b, move, nullptr);
  Vector vector{move, {}, {}};
  double repeats = 1.0;
  for (const NoisyBeliefGraph::Branch& branch : branches) {
    if (branch.belief == b) repeats = MostRepeats(branch.probability);
  }
  for (const NoisyBeliefGraph::Branch& branch : branches) {
    if (branch.belief != b) vector.next.emplace_back(branch.outcome, Refreshed(branch.belief).best);
  }
  for (std::uint32_t h = 0; h < problem.hypotheses.size(); ++h) {
    if (Blocked(problem, robot, problem.hypotheses[h])) {
      vector.costs.push_back(0.0);  // no belief of this cell holds it
      continue;
    }
    const NoisyMove& does = moves_.Of(move.cells, Simulate(problem, robot, move, problem.hypotheses[h]).cells);
    double cost = does.Cost(problem.cost, move.direction);
    double stays = 0.0;
    for (const NoisyOutcome& o : does.outcomes) {
      const auto branch = std::ranges::find(branches, o.outcome, &NoisyBeliefGraph::Branch::outcome);
      if (branch == branches.end()) {
        cost += o.probability * wrong_cost_;  // what the belief excludes: the plan gives up
      } else if (branch->belief == b) {
        stays += o.probability;  // and the move is made again
      } else {
        cost += o.probability * CostUnder(branch->belief, Refreshed(branch->belief).best, h);
      }
    }
    // Repeated at most so often, then given up: under what the belief excludes it might go on for ever.
    const double left = std::pow(stays, repeats);
    const double times = stays < 1.0 ? (1.0 - left) / (1.0 - stays) : repeats;
    vector.costs.push_back(times * cost + left * wrong_cost_);
  }
  double value = 0.0;
  for (const WeightedHypothesis& h : graph_.Belief(b)) value += h.weight * vector.costs[h.hypothesis];
  if (!(value < states_[b].upper - kNothing)) return;
  CellBounds& cell = At(robot);
  std::erase_if(cell.looked_vectors, [&](std::uint32_t other) {
    const std::vector<double>& costs = cell.vectors[other].costs;
    for (std::size_t h = 0; h < costs.size(); ++h) {
      if (vector.costs[h] > costs[h]) return false;
    }
    return true;
  });
  bytes_ += sizeof(Vector) + vector.costs.size() * sizeof(double) + vector.next.size() * 16;
  cell.looked_vectors.push_back(static_cast<std::uint32_t>(cell.vectors.size()));
  cell.vectors.push_back(std::move(vector));
  ++changes_;
  Refreshed(b);
}

void NoisyPointSearch::AddPoint(std::uint32_t b, double lower) {
  CellBounds& cell = At(graph_.Robot(b));
  std::erase_if(cell.looked_points, [&](std::uint32_t other) { return cell.points[other].belief == b; });
  Point point{b, lower, {}};
  for (const WeightedHypothesis& h : graph_.Belief(b)) point.shares.push_back({h.hypothesis, 1.0 / h.weight});
  std::ranges::stable_sort(point.shares, {}, &Share::inverse);
  bytes_ += sizeof(Point) + point.shares.size() * sizeof(Share);
  cell.looked_points.push_back(static_cast<std::uint32_t>(cell.points.size()));
  cell.points.push_back(std::move(point));
  states_[b].lower = lower;
  ++changes_;
}

/// Keeps the vectors that are the best of a belief which was backed up, and the points that the others do not imply.
void NoisyPointSearch::Prune(CellBounds& cell) {
  if (cell.looked_vectors.size() > 2 * cell.kept_vectors + kFew) {
    std::vector<std::uint8_t> used(cell.vectors.size(), 0);
    for (const std::uint32_t b : cell.backed_up) {
      if (Refreshed(b).best != kDeclares) used[static_cast<std::size_t>(states_[b].best)] = 1;
    }
    std::erase_if(cell.looked_vectors, [&](std::uint32_t number) { return used[number] == 0; });
    cell.kept_vectors = cell.looked_vectors.size();
  }
  if (cell.looked_points.size() <= 2 * cell.kept_points + kFew) return;
  std::vector<std::uint32_t> kept;
  for (std::size_t i = cell.looked_points.size(); i-- > 0;) {  // newer ones know more
    const Point& point = cell.points[cell.looked_points[i]];
    const std::span<const WeightedHypothesis> belief = graph_.Belief(point.belief);
    for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = h.weight;
    const bool implied = std::ranges::any_of(kept, [&](std::uint32_t other) {
      return ByPoint(cell.points[other], graph_.Robot(point.belief), belief, point.lower) >= point.lower;
    });
    for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = 0.0;
    if (!implied) kept.push_back(cell.looked_points[i]);
  }
  std::ranges::reverse(kept);
  cell.looked_points = std::move(kept);
  cell.kept_points = cell.looked_points.size();
}

std::uint32_t NoisyPointSearch::WidestSuccessor(std::uint32_t b, std::size_t action, double width) {
  std::uint32_t widest = b;
  double most = 0.0;
  graph_.ForEachShare(graph_.Actions(b)[action], [&](std::uint32_t next, double share) {
    const State& state = Refreshed(next);
    const double excess = share * (state.upper - state.lower - width);
    if (excess <= most) return;
    most = excess;
    widest = next;
  });
  return widest;
}

bool NoisyPointSearch::Trial(double gap) {
  ++trials_;
  const std::int64_t changes = changes_;
  const std::uint32_t start = graph_.Start();
  const double target = (gap - 1.0) * Lower(start) + kNothing;
  const double width = std::max(target, kTrialShare * (Upper(start) - Lower(start)));
  std::vector<std::uint32_t> trial;
  std::uint32_t b = start;
  while (trial.size() < kLongestTrial && Upper(b) - Lower(b) > (b == start ? 0.0 : width)) {
    const std::size_t action = Update(b);
    trial.push_back(b);
    if (late_ && late_()) return changes_ > changes;
    const std::uint32_t next = WidestSuccessor(b, action, width);
    if (next == b) break;
    const std::uint32_t core = graph_.Core(next, kTiny);
    b = Upper(core) - Lower(core) > width ? core : next;
  }
  for (; !trial.empty() && !(late_ && late_()); trial.pop_back()) {
    Update(trial.back());
    Prune(At(graph_.Robot(trial.back())));
  }
  return changes_ > changes;
}

std::size_t NoisyPointSearch::bytes() const {
  return bytes_ + states_.capacity() * sizeof(State) + cells_.size() * sizeof(CellBounds);
}

}  // namespace feeler::planner
