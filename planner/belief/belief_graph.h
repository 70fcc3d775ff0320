#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/belief/contact_masks.h"
#include "feeler/planner/belief/hypothesis_sets.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

using BeliefId = std::uint32_t;
inline constexpr BeliefId kNoBelief = ~BeliefId{0};

/// An action of a belief, as `BeliefGraph::Actions` lists it. Outcomes that are goals have value zero and do not appear
/// among the successors.
struct BeliefAction {
  double cost = 0.0;                ///< expected cost times the weight of the belief
  BeliefId free = kNoBelief;        ///< after the whole move without contact
  std::uint32_t first_contact = 0;  ///< after contacts, nearest first: shared between moves of one direction
  std::uint16_t contacts = 0;
  std::uint16_t cells = 0;
  Direction direction = Direction::kPlusX;
};

/// One outcome of an action in full, for policies.
struct BeliefOutcome {
  Outcome outcome;
  BeliefId next = kNoBelief;  ///< kNoBelief at a goal
  SetId set = 0;
  Cell shift = Cell::Zero();  ///< of the successor's frame in this belief's frame
  double weight = 0.0;
};

/// The belief MDP of a problem, grown on demand: beliefs (robot cell, set of hypotheses) with their actions, successors
/// and heuristic values, each stored once. The model that the solvers work on (see solver/belief_model.h).
///
/// With `canonical`, translates are one belief: contact depends on r - h alone, so robot cells are relative to the
/// frame of the set, and the workspace is taken to be unbounded (see Problem::generous_workspace). Without, all
/// coordinates are the problem's and moves are confined to the workspace.
class BeliefGraph {
 public:
  /// `heuristic` may be null (all zero). `canonical` is ignored where hypothesis sets are not shiftable.
  BeliefGraph(const Problem& problem, const ContactMasks& masks, bool canonical);
  void SetHeuristic(BeliefHeuristic* heuristic) { heuristic_ = heuristic; }

  const Problem& problem() const { return problem_; }
  HypothesisSets& sets() { return sets_; }
  const HypothesisSets& sets() const { return sets_; }
  bool canonical() const { return sets_.shiftable(); }

  /// The start belief; kNoBelief if it is a goal already. Needs the heuristic.
  BeliefId Start();
  std::size_t size() const { return beliefs_.size(); }
  double Weight(BeliefId b) const { return sets_.info(beliefs_[b].set).weight; }
  /// Lower bound on the optimal expected cost, times the weight of the belief.
  double Heuristic(BeliefId b) const { return beliefs_[b].heuristic; }
  bool expanded(BeliefId b) const { return beliefs_[b].first_action != kUnexpanded; }
  /// All actions; finds them on the first call. The span holds until the next belief is expanded.
  std::span<const BeliefAction> Actions(BeliefId b) {
    if (!expanded(b)) Expand(b);
    return {actions_.data() + beliefs_[b].first_action, beliefs_[b].action_count};
  }
  /// The action that a move comes to: an index into Actions. The longest listed one in its direction that is no longer
  /// than it, since what is blocked before returns the same; -1 if there is none.
  int ActionOf(BeliefId b, const GuardedMove& move);
  /// Calls f(successor) for each outcome that is not a goal.
  template <class F>
  void ForEachSuccessor(const BeliefAction& action, F f) const {
    for (std::uint32_t i = 0; i < action.contacts; ++i) f(contacts_[action.first_contact + i]);
    if (action.free != kNoBelief) f(action.free);
  }

  SetId set(BeliefId b) const { return beliefs_[b].set; }
  Cell robot(BeliefId b) const { return Unpack(beliefs_[b].robot); }  ///< relative to the frame
  /// All outcomes of a move, goals included.
  std::vector<BeliefOutcome> Outcomes(BeliefId b, const GuardedMove& move);
  /// The belief of a set with the robot at a cell relative to its frame.
  BeliefId Intern(SetId set, const Cell& robot);
  std::size_t bytes() const;

 private:
  static constexpr std::uint32_t kUnexpanded = ~std::uint32_t{0};
  struct Belief {
    std::uint64_t robot = 0;  ///< packed cell
    SetId set = 0;
    std::uint32_t first_action = kUnexpanded;
    std::uint32_t action_count = 0;
    double heuristic = 0.0;
  };
  struct Slot {
    BeliefId belief = kNoBelief;
    std::uint32_t tag = 0;  ///< high bits of the hash
  };
  /// 21 bits a coordinate.
  static std::uint64_t Pack(const Cell& c) {
    const auto bits = [](int x) { return static_cast<std::uint64_t>(x + (1 << 20)); };
    return bits(c.x()) | bits(c.y()) << 21 | bits(c.z()) << 42;
  }
  static Cell Unpack(std::uint64_t packed) {
    const auto coordinate = [](std::uint64_t bits) { return static_cast<int>(bits & 0x1FFFFF) - (1 << 20); };
    return {coordinate(packed), coordinate(packed >> 21), coordinate(packed >> 42)};
  }
  static std::uint64_t Hash(SetId set, std::uint64_t robot) {
    std::uint64_t hash = (robot ^ std::uint64_t{set} << 40 ^ set) * 0xFF51AFD7ED558CCD;
    hash = (hash ^ hash >> 32) * 0xC4CEB9FE1A85EC53;
    return hash ^ hash >> 29;
  }

  void Expand(BeliefId b);
  /// Walks a belief in one direction, splitting it where steps are blocked. Calls on_contact(cells, set, shift) for
  /// each contact and on_free(cells, set, shift) at each listed length that some hypotheses reach; on_blocked(next
  /// length) when none is left.
  template <class OnContact, class OnFree, class OnBlocked>
  void Walk(BeliefId b, Direction d, int longest, OnContact on_contact, OnFree on_free, OnBlocked on_blocked);
  int LongestApplicable(BeliefId b, Direction d) const;
  void Grow();

  const Problem& problem_;
  const ContactMasks& masks_;
  HypothesisSets sets_;
  BeliefHeuristic* heuristic_ = nullptr;
  std::vector<Belief> beliefs_;
  std::vector<BeliefAction> actions_;
  std::vector<BeliefId> contacts_;
  std::vector<Slot> table_;  ///< open addressing
  std::vector<Slab> alive_, hit_, scratch_;
};

}  // namespace feeler::planner
