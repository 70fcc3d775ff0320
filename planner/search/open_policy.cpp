#include "feeler/planner/search/open_policy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <tuple>
#include <utility>

namespace feeler::planner {
namespace {

/// Tours consider leaving for the filled map's policy at so many places at most.
constexpr std::size_t kMostExits = 32;

}  // namespace

OpenPolicy::OpenPolicy(BeliefGraph& graph, BeliefGraph& filled, const Openings& openings,
                       GreedyCompletion<BeliefGraph>& completion)
    : graph_(graph), filled_(filled), openings_(openings), completion_(completion), filled_policy_(filled) {}

std::optional<SolverStatus> OpenPolicy::Run(BeliefId start, StopCondition stop) {
  stop_ = std::move(stop);
  try {
    Find(start, true);
  } catch (const Stopped& stopped) {
    return stopped.why;
  }
  return std::nullopt;
}

void OpenPolicy::CheckStop() const {
  if (const std::optional<SolverStatus> why = stop_(expansions())) throw Stopped{*why};
}

double OpenPolicy::Complete(BeliefId b) {
  completion_.Run(b, [&](std::int64_t) { return stop_(expansions()); });
  CheckStop();
  return completion_.Solved(b) ? completion_.Value(b) : kInfinity;
}

std::optional<BeliefId> OpenPolicy::Filled(BeliefId b) {
  const SetId set = graph_.set(b);
  const Cell robot = graph_.robot(b);
  const ContactMap& map = *filled_.problem().map;
  std::vector<Slab> copy;
  graph_.sets().ForEach(set, [&](const Cell& h, int orientation, std::uint32_t layer, int bit) {
    if (map.Blocked(robot - h, orientation)) return;
    if (copy.empty() || copy.back().layer != layer) copy.push_back({layer, {}});
    copy.back().bits.Set(bit);
  });
  if (copy.empty()) return std::nullopt;
  Cell shift;
  const SetId there = filled_.sets().Intern(copy, shift);
  if (filled_.sets().info(there).goal) return std::nullopt;
  return filled_.Intern(there, robot - shift);
}

double OpenPolicy::FilledValue(BeliefId b) {
  const std::optional<BeliefId> there = Filled(b);
  if (!there || std::isinf(filled_.Heuristic(*there))) return kInfinity;
  filled_policy_.Run(*there, [&](std::int64_t) { return stop_(expansions()); });
  CheckStop();
  return filled_policy_.Solved(*there) ? filled_policy_.Value(*there) : kInfinity;
}

double OpenPolicy::Record(BeliefId b, const GuardedMove& move, const std::vector<BeliefOutcome>& outcomes) {
  if (!graph_.expanded(b)) ++expansions_;
  const int action = graph_.ActionOf(b, move);
  if (action < 0) return kInfinity;
  double value = 0.0;
  for (const BeliefOutcome& outcome : outcomes) {
    value += outcome.weight * graph_.problem().cost.Of(outcome.outcome, move.direction);
    if (outcome.next != kNoBelief) value += Solved(outcome.next) ? Value(outcome.next) : kInfinity;
  }
  if (b >= nodes_.size()) nodes_.resize(std::max<std::size_t>(graph_.size(), b + std::size_t{1}));
  if (value < nodes_[b].value) nodes_[b] = {value, action};
  return nodes_[b].value;
}

GuardedMove OpenPolicy::WithLooks(BeliefId b, const GuardedMove& move, double value) const {
  // The first opening of a hypothesis that the move passes, its far end left out.
  const Cell robot = graph_.robot(b);
  const Cell step = UnitCell(move.direction);
  int nearest = move.cells;
  GuardedMove look = move;
  double weight = 0.0;
  graph_.sets().ForEach(graph_.set(b), [&](const Cell& h, int, std::uint32_t layer, int bit) {
    for (std::size_t i = 0; i < openings_.mouths.size(); ++i) {
      const Cell way = h + openings_.mouths[i] - robot;
      const int ahead = way.dot(step);
      if (ahead < 0 || ahead >= nearest || way != ahead * step) continue;
      if (openings_.directions[i] == move.direction) continue;  // looked into by the move itself
      nearest = ahead;
      look = {openings_.directions[i], 1};
      weight = graph_.sets().Weight(layer, bit);
    }
  });
  if (nearest == move.cells) return move;
  const CostWeights& cost = graph_.problem().cost;
  const double all = graph_.Weight(b);
  const double looking = all * (cost.per_contact + cost.per_action) + (nearest > 0 ? all * cost.per_action : 0.0);
  if (looking > weight / all * value) return move;
  if (nearest == 0) return look;
  int cells = 1;
  for (const int listed : graph_.problem().move_lengths) {
    if (listed <= nearest) cells = listed;
  }
  return {move.direction, cells};
}

double OpenPolicy::Find(BeliefId b, bool tours) {
  CheckStop();
  if (b >= found_.size()) found_.resize(std::max<std::size_t>(graph_.size(), b + std::size_t{1}), 0);
  if (found_[b] >= (tours ? 2 : 1)) return Solved(b) ? Value(b) : kInfinity;
  if (tours && graph_.sets().info(graph_.set(b)).slab_count == 1) {
    Find(b, false);
    found_[b] = 2;
    if (!Filled(b)) return Value(b);
    Tour(b, TourKind::kSpiral);
    Tour(b, TourKind::kSweep);
    return Value(b);
  }
  found_[b] = tours ? 2 : 1;
  const std::optional<BeliefId> there = Filled(b);
  const double estimate = there ? FilledValue(b) : kInfinity;
  if (std::isinf(estimate)) return Complete(b);
  const BeliefAction& action = filled_.Actions(*there)[static_cast<std::size_t>(filled_policy_.Action(*there))];
  const GuardedMove planned{action.direction, action.cells};
  const GuardedMove looking = WithLooks(b, planned, estimate);
  for (const GuardedMove& move : {looking, planned}) {
    const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(b, move);
    if (outcomes.front().next == b) continue;  // a bump: the move was for the filled map only
    if (outcomes.size() == 1 && move != planned) {
      // Part of the way. From there the plan must be as good, or ties would lead to and fro.
      const double way = outcomes.front().weight * graph_.problem().cost.Of(outcomes.front().outcome, move.direction);
      if (way + FilledValue(outcomes.front().next) > estimate * (1.0 + 1e-9)) continue;
    }
    for (const BeliefOutcome& outcome : outcomes) {
      if (outcome.next != kNoBelief) Find(outcome.next, tours);
    }
    if (!std::isinf(Record(b, move, outcomes))) return Value(b);
  }
  return Complete(b);
}

std::vector<std::pair<Cell, Direction>> OpenPolicy::Order(BeliefId b, TourKind kind) const {
  std::map<std::tuple<int, int, int>, Direction> open;
  graph_.sets().ForEach(graph_.set(b), [&](const Cell& h, int, std::uint32_t, int) {
    if (openings_.mouths.empty()) return;
    const Cell mouth = h + openings_.mouths.front();
    open.emplace(std::make_tuple(mouth.x(), mouth.y(), mouth.z()), openings_.directions.front());
  });
  std::vector<std::pair<Cell, Direction>> order;
  const Cell start = graph_.robot(b);
  Cell here = start;
  while (!open.empty()) {
    // The nearest; of these, for a spiral, the nearest to the start, and the one with fewest neighbours left.
    std::tuple<int, int, int> best_key{};
    auto best = open.end();
    for (auto at = open.begin(); at != open.end(); ++at) {
      const Cell cell(std::get<0>(at->first), std::get<1>(at->first), std::get<2>(at->first));
      int neighbours = 0;
      for (const Direction d : kDirections) {
        const Cell next = cell + UnitCell(d);
        neighbours += open.contains({next.x(), next.y(), next.z()}) ? 1 : 0;
      }
      const int ring = (cell - start).cwiseAbs().maxCoeff();
      const std::tuple<int, int, int> key{(cell - here).cwiseAbs().sum(), kind == TourKind::kSpiral ? ring : neighbours,
                                          kind == TourKind::kSpiral ? neighbours : ring};
      if (best == open.end() || key < best_key) {
        best = at;
        best_key = key;
      }
    }
    here = Cell(std::get<0>(best->first), std::get<1>(best->first), std::get<2>(best->first));
    order.emplace_back(here, best->second);
    open.erase(best);
  }
  return order;
}

/// What is made of a tour while nothing is found.
struct OpenPolicy::Walk {
  std::vector<Stop> stops;
  std::vector<std::size_t> looks;  ///< stops after which an opening has just been looked into
  BeliefId end = kNoBelief;
  // Canonical frames move as hypotheses go: places are kept relative to the tool's first.
  Cell from_start = Cell::Zero();
  bool going = true;
  bool complete = false;  ///< all that were left are told apart at the last stop
};

bool OpenPolicy::Make(const GuardedMove& move, Walk& walk) {
  const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(walk.end, move);
  const BeliefOutcome* main = nullptr;
  for (const BeliefOutcome& outcome : outcomes) {
    if (outcome.next == kNoBelief || outcome.next == walk.end) continue;
    if (main == nullptr || outcome.weight > main->weight) main = &outcome;
  }
  if (main == nullptr) {
    walk.complete = outcomes.size() > 1;
    if (walk.complete) walk.stops.push_back({walk.end, move});
    return false;
  }
  walk.stops.push_back({walk.end, move});
  walk.end = main->next;
  walk.from_start += main->outcome.cells * UnitCell(move.direction);
  return true;
}

OpenPolicy::Walk OpenPolicy::WalkThroughOpenings(BeliefId start, TourKind kind) {
  Walk walk;
  walk.end = start;
  const Cell origin = graph_.robot(start);
  for (const auto& [mouth, direction] : Order(start, kind)) {
    const Cell target = mouth - origin;
    for (const int axis : {2, 0, 1}) {
      while (walk.going && walk.from_start[axis] != target[axis]) {
        const int way = target[axis] - walk.from_start[axis];
        int cells = 1;
        for (const int listed : graph_.problem().move_lengths) {
          if (listed <= std::abs(way)) cells = listed;
        }
        const Cell before = walk.from_start;
        walk.going = Make({MakeDirection(axis, way), cells}, walk);
        if (walk.from_start == before) walk.going = false;  // in the way of something
      }
    }
    if (!walk.going) break;
    walk.going = Make({direction, 1}, walk);
    if (!walk.going) break;
    walk.looks.push_back(walk.stops.size());
    if (walk.from_start != target) break;  // found, with others left
  }
  return walk;
}

std::optional<OpenPolicy::Exit> OpenPolicy::BestExit(const Walk& walk) {
  // Where it may be left: after some of the looks, and after the last.
  const std::size_t stride = walk.looks.size() / kMostExits + 1;
  std::vector<Exit> exits;
  for (std::size_t i = stride - 1; i < walk.looks.size(); i += stride) {
    const std::size_t at = walk.looks[i];
    exits.push_back({at, at < walk.stops.size() ? walk.stops[at].belief : walk.end});
  }
  if (!walk.looks.empty() && (exits.empty() || exits.back().stop != walk.looks.back()) && walk.going) {
    exits.push_back({walk.looks.back(), walk.end});
  }
  // Cost of the tour from its start to each of them, and of the cheapest way to leave it.
  std::optional<Exit> best;
  double best_cost = kInfinity;
  double spent = 0.0;
  std::size_t stop = 0;
  const auto spend_to = [&](std::size_t end) {
    for (; stop < end; ++stop) {
      for (const BeliefOutcome& outcome : graph_.Outcomes(walk.stops[stop].belief, walk.stops[stop].move)) {
        spent += outcome.weight * graph_.problem().cost.Of(outcome.outcome, walk.stops[stop].move.direction);
      }
    }
  };
  for (const Exit& exit : exits) {
    spend_to(exit.stop);
    if (spent >= best_cost) break;
    const double rest = FilledValue(exit.belief);
    if (spent + rest < best_cost) {
      best_cost = spent + rest;
      best = exit;
    }
  }
  spend_to(walk.stops.size());
  if (walk.complete && spent <= best_cost) best = Exit{walk.stops.size(), kNoBelief};
  return best;
}

void OpenPolicy::Tour(BeliefId start, TourKind kind) {
  const Walk walk = WalkThroughOpenings(start, kind);
  const std::optional<Exit> exit = BestExit(walk);
  if (!exit) return;
  if (exit->belief != kNoBelief) Find(exit->belief, false);
  for (std::size_t i = exit->stop; i-- > 0;) {
    const Stop& stop = walk.stops[i];
    const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(stop.belief, stop.move);
    for (const BeliefOutcome& outcome : outcomes) {
      if (outcome.next != kNoBelief && !Solved(outcome.next)) Find(outcome.next, false);
    }
    Record(stop.belief, stop.move, outcomes);
  }
}

}  // namespace feeler::planner
