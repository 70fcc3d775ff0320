#include "feeler/planner/search/fewest_moves.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <utility>
#include <vector>

namespace feeler::planner {
namespace {

/// What is known of a belief: how its policy goes on, the cost to go times its weight, and the least expected number of
/// moves, times its weight.
struct Known {
  GuardedMove move;
  double value = 0.0;
  double moves = std::numeric_limits<double>::infinity();
};

class Straightener {
 public:
  Straightener(BeliefGraph& graph, const std::function<GuardedMove(BeliefId)>& move_of)
      : graph_(graph), move_of_(move_of) {}

  MoveMap Run() {
    const BeliefId start = graph_.Start();
    if (start == kNoBelief) return {};
    Collect(start);
    std::vector<BeliefId> heads = {start};
    for (const BeliefId b : order_) {
      const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(b, known_.at(b).move);
      if (ShowsNothing(b, outcomes)) continue;
      for (const BeliefOutcome& outcome : outcomes) {
        if (outcome.next != kNoBelief) heads.push_back(outcome.next);
      }
    }
    for (const BeliefId head : heads) Straighten(head);
    ChooseMoves();
    MoveMap moves;
    for (const auto& [b, known] : known_) moves.emplace(b, known.move);
    return moves;
  }

 private:
  bool ShowsNothing(BeliefId b, const std::vector<BeliefOutcome>& outcomes) const {
    return outcomes.size() == 1 && outcomes.front().next != kNoBelief &&
           graph_.set(outcomes.front().next) == graph_.set(b);
  }

  bool Applicable(BeliefId b, const GuardedMove& move) const {
    return graph_.canonical() ||
           graph_.problem().workspace.Contains(graph_.robot(b) + move.cells * UnitCell(move.direction));
  }

  /// All beliefs of the policy, successors first in `order_`, with their values.
  void Collect(BeliefId start) {
    std::vector<std::pair<BeliefId, bool>> stack = {{start, false}};
    while (!stack.empty()) {
      const auto [b, successors_done] = stack.back();
      stack.pop_back();
      if (known_.contains(b)) continue;
      const GuardedMove move = move_of_(b);
      double value = 0.0;
      if (!successors_done) stack.emplace_back(b, true);
      for (const BeliefOutcome& outcome : graph_.Outcomes(b, move)) {
        value += outcome.weight * graph_.problem().cost.Of(outcome.outcome, move.direction);
        if (outcome.next == kNoBelief) continue;
        if (successors_done) {
          value += known_.at(outcome.next).value;
        } else {
          stack.emplace_back(outcome.next, false);
        }
      }
      if (!successors_done) continue;
      known_[b] = {move, value, std::numeric_limits<double>::infinity()};
      order_.push_back(b);
    }
  }

  /// Adds the straight walks from a belief to the place where its policy first learns something.
  void Straighten(BeliefId head) {
    BeliefId end = head;
    int walked = 0;
    while (true) {
      const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(end, known_.at(end).move);
      if (!ShowsNothing(end, outcomes)) break;
      end = outcomes.front().next;
      ++walked;
    }
    if (walked < 2) return;
    const Cell way = graph_.robot(end) - graph_.robot(head);
    std::array<int, 3> axes = {0, 1, 2};
    do {
      Walk(head, end, way, axes);
    } while (std::ranges::next_permutation(axes).found);
  }

  void Walk(BeliefId head, BeliefId end, const Cell& way, const std::array<int, 3>& axes) {
    const std::vector<int>& lengths = graph_.problem().move_lengths;
    std::vector<std::pair<BeliefId, GuardedMove>> path;
    BeliefId here = head;
    for (const int axis : axes) {
      int left = std::abs(way[axis]);
      while (left > 0) {
        const int cells = *std::ranges::find_if(lengths.rbegin(), lengths.rend(), [&](int n) { return n <= left; });
        const GuardedMove move{MakeDirection(axis, way[axis]), cells};
        if (!Applicable(here, move)) return;
        const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(here, move);
        if (!ShowsNothing(here, outcomes) || outcomes.front().outcome.contact) return;
        path.emplace_back(here, move);
        here = outcomes.front().next;
        left -= cells;
      }
    }
    assert(here == end);
    double value = known_.at(end).value;
    for (auto step = path.rbegin(); step != path.rend(); ++step) {
      value +=
          graph_.Weight(step->first) * graph_.problem().cost.Of({step->second.cells, false}, step->second.direction);
      const auto [at, added] = known_.try_emplace(step->first);
      if (added || value < at->second.value) at->second = {step->second, value, at->second.moves};
    }
  }

  /// From the leaves up: a successor weighs less or has a lower value, so it comes first in this order.
  void ChooseMoves() {
    std::vector<std::pair<std::pair<double, double>, BeliefId>> sorted;
    for (const auto& [b, known] : known_) sorted.push_back({{graph_.Weight(b), known.value}, b});
    std::ranges::sort(sorted);
    for (const auto& [key, b] : sorted) {
      Known& known = known_.at(b);
      const double limit = known.value * (1.0 + 1e-9) + 1e-12;
      // The policy's own move is always good; it comes first, so that what follows must be better.
      Try(b, known.move, known);
      for (const Direction d : kDirections) {
        for (const int cells : graph_.problem().move_lengths) {
          const GuardedMove move{d, cells};
          if (move == known.move || !WorthTrying(b, move, limit)) continue;
          Try(b, move, known);
        }
      }
    }
  }

  /// A cheap look before the outcomes are worked out: only actions of beliefs already expanded by the search, and moves
  /// in the policy's own direction.
  bool WorthTrying(BeliefId b, const GuardedMove& move, double limit) {
    if (!Applicable(b, move)) return false;
    if (!graph_.expanded(b)) return move.direction == known_.at(b).move.direction;
    for (const BeliefAction& action : graph_.Actions(b)) {
      if (action.direction != move.direction || action.cells != move.cells) continue;
      double value = action.cost;
      bool all_known = true;
      graph_.ForEachSuccessor(action, [&](BeliefId next) {
        const auto at = known_.find(next);
        all_known = all_known && at != known_.end();
        if (at != known_.end()) value += at->second.value;
      });
      return all_known && value <= limit;
    }
    return false;
  }

  void Try(BeliefId b, const GuardedMove& move, Known& known) {
    double value = 0.0;
    double moves = graph_.Weight(b);
    const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(b, move);
    for (const BeliefOutcome& outcome : outcomes) {
      value += outcome.weight * graph_.problem().cost.Of(outcome.outcome, move.direction);
      if (outcome.next == kNoBelief) continue;
      const auto at = known_.find(outcome.next);
      if (at == known_.end() || outcome.next == b || at->second.moves == std::numeric_limits<double>::infinity())
        return;
      value += at->second.value;
      moves += at->second.moves;
    }
    if (value > known.value * (1.0 + 1e-9) + 1e-12) return;
    if (moves < known.moves * (1.0 - 1e-12) || known.moves == std::numeric_limits<double>::infinity()) {
      known.moves = moves;
      known.move = move;
    }
  }

  BeliefGraph& graph_;
  const std::function<GuardedMove(BeliefId)>& move_of_;
  std::unordered_map<BeliefId, Known> known_;
  std::vector<BeliefId> order_;
};

}  // namespace

MoveMap FewestMoves(BeliefGraph& graph, const std::function<GuardedMove(BeliefId)>& move_of) {
  return Straightener(graph, move_of).Run();
}

}  // namespace feeler::planner
