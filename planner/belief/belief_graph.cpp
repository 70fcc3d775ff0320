#include "feeler/planner/belief/belief_graph.h"

#include <algorithm>
#include <cassert>

namespace feeler::planner {

BeliefGraph::BeliefGraph(const Problem& problem, const ContactMasks& masks, bool canonical)
    : problem_(problem), masks_(masks), sets_(problem, canonical) {
  table_.assign(1024, Slot());
}

BeliefId BeliefGraph::Start() {
  if (sets_.info(sets_.start()).goal) return kNoBelief;
  return Intern(sets_.start(), problem_.start - sets_.start_frame());
}

BeliefId BeliefGraph::Intern(SetId set, const Cell& robot) {
  const std::uint64_t packed = Pack(robot);
  const std::size_t mask = table_.size() - 1;
  const std::uint64_t hash = Hash(set, packed);
  const auto tag = static_cast<std::uint32_t>(hash >> 32);
  std::size_t at = hash & mask;
  for (; table_[at].belief != kNoBelief; at = (at + 1) & mask) {
    if (table_[at].tag != tag) continue;  // spares a look at the belief, which is not in the cache
    const Belief& known = beliefs_[table_[at].belief];
    if (known.set == set && known.robot == packed) return table_[at].belief;
  }
  const auto b = static_cast<BeliefId>(beliefs_.size());
  Belief belief{packed, set, kUnexpanded, 0, 0.0};
  if (heuristic_ != nullptr) belief.heuristic = heuristic_->Weighted(set, robot);
  beliefs_.push_back(belief);
  table_[at] = {b, tag};
  if (beliefs_.size() * 2 > table_.size()) Grow();
  return b;
}

void BeliefGraph::Grow() {
  std::vector<Slot> table(table_.size() * 2);
  const std::size_t mask = table.size() - 1;
  for (BeliefId b = 0; b < beliefs_.size(); ++b) {
    const std::uint64_t hash = Hash(beliefs_[b].set, beliefs_[b].robot);
    std::size_t at = hash & mask;
    while (table[at].belief != kNoBelief) at = (at + 1) & mask;
    table[at] = {b, static_cast<std::uint32_t>(hash >> 32)};
  }
  table_ = std::move(table);
}

int BeliefGraph::LongestApplicable(BeliefId b, Direction d) const {
  if (canonical()) return problem_.move_lengths.back();
  const int axis = AxisOf(d);
  const int here = robot(b)[axis];
  const int room = SignOf(d) > 0 ? problem_.workspace.max[axis] - here : here - problem_.workspace.min[axis];
  int longest = 0;
  for (const int length : problem_.move_lengths) {
    if (length <= room) longest = length;
  }
  return longest;
}

template <class OnContact, class OnFree, class OnBlocked>
void BeliefGraph::Walk(BeliefId b, Direction d, int longest, OnContact on_contact, OnFree on_free,
                       OnBlocked on_blocked) {
  const SetId set = beliefs_[b].set;
  const auto slabs = sets_.slabs(set);
  alive_.assign(slabs.begin(), slabs.end());
  SetId alive_set = set;
  Cell alive_shift = Cell::Zero();
  bool alive_known = true;
  Cell place = robot(b);
  const Cell step = UnitCell(d);
  auto next_length = problem_.move_lengths.begin();
  for (int cells = 0; cells < longest; ++cells) {
    hit_.clear();
    for (Slab& slab : alive_) {
      const std::uint32_t index = masks_.Index(place - sets_.Corner(slab.layer), d, sets_.Orientation(slab.layer));
      if (index == 0) continue;
      const Bits256& mask = masks_.Mask(index);
      const Bits256 hit = slab.bits & mask;
      if (!hit.Any()) continue;
      hit_.push_back({slab.layer, hit});
      slab.bits = slab.bits.Without(mask);
    }
    if (!hit_.empty()) {
      std::erase_if(alive_, [](const Slab& slab) { return !slab.bits.Any(); });
      Cell shift = Cell::Zero();
      SetId hit_set = alive_set;
      if (alive_.empty() && alive_known) {
        shift = alive_shift;
      } else {
        scratch_ = hit_;
        hit_set = sets_.Intern(scratch_, shift);
      }
      on_contact(cells, hit_set, shift);
      alive_known = false;
      if (alive_.empty()) {
        on_blocked(cells, *next_length);
        return;
      }
    }
    place += step;
    if (cells + 1 == *next_length) {
      if (!alive_known) {
        scratch_ = alive_;
        alive_set = sets_.Intern(scratch_, alive_shift);
        alive_known = true;
      }
      on_free(cells + 1, alive_set, alive_shift);
      ++next_length;
    }
  }
}

void BeliefGraph::Expand(BeliefId b) {
  const auto first_action = static_cast<std::uint32_t>(actions_.size());
  const SetId here = beliefs_[b].set;
  const Cell robot_here = robot(b);
  const CostWeights& cost = problem_.cost;
  for (const Direction d : kDirections) {
    const int longest = LongestApplicable(b, d);
    if (longest == 0) continue;
    const Cell step = UnitCell(d);
    const auto first_contact = static_cast<std::uint32_t>(contacts_.size());
    double contact_cost = 0.0;
    const auto successor = [&](int cells, SetId set, const Cell& shift) {
      if (sets_.info(set).goal) return kNoBelief;
      return Intern(set, robot_here + cells * step - shift);
    };
    bool only_bump = false;
    Walk(
        b, d, longest,
        [&](int cells, SetId set, const Cell& shift) {
          if (cells == 0 && set == here) {
            only_bump = true;  // a known wall: nothing changes
            return;
          }
          contact_cost += sets_.info(set).weight * cost.Of({cells, true}, d);
          const BeliefId next = successor(cells, set, shift);
          if (next != kNoBelief) contacts_.push_back(next);
        },
        [&](int cells, SetId set, const Cell& shift) {
          BeliefAction action;
          action.cost = contact_cost + sets_.info(set).weight * cost.Of({cells, false}, d);
          action.free = successor(cells, set, shift);
          action.first_contact = first_contact;
          action.contacts = static_cast<std::uint16_t>(contacts_.size() - first_contact);
          action.cells = static_cast<std::uint16_t>(cells);
          action.direction = d;
          actions_.push_back(action);
        },
        [&](int, int length) {
          if (only_bump) return;
          // Every hypothesis has met contact: all longer moves return the same.
          BeliefAction action;
          action.cost = contact_cost;
          action.first_contact = first_contact;
          action.contacts = static_cast<std::uint16_t>(contacts_.size() - first_contact);
          action.cells = static_cast<std::uint16_t>(length);
          action.direction = d;
          actions_.push_back(action);
        });
  }
  beliefs_[b].first_action = first_action;
  beliefs_[b].action_count = static_cast<std::uint32_t>(actions_.size()) - first_action;
}

int BeliefGraph::ActionOf(BeliefId b, const GuardedMove& move) {
  int action = -1;
  int index = 0;
  int cells = 0;
  for (const BeliefAction& listed : Actions(b)) {
    if (listed.direction == move.direction && listed.cells <= move.cells && listed.cells > cells) {
      action = index;
      cells = listed.cells;
    }
    ++index;
  }
  return action;
}

std::vector<BeliefOutcome> BeliefGraph::Outcomes(BeliefId b, const GuardedMove& move) {
  std::vector<BeliefOutcome> outcomes;
  const Cell robot_here = robot(b);
  const Cell step = UnitCell(move.direction);
  const auto add = [&](int cells, bool contact, SetId set, const Cell& shift) {
    BeliefOutcome outcome{{cells, contact}, kNoBelief, set, shift, sets_.info(set).weight};
    if (!sets_.info(set).goal) {
      outcome.next = Intern(set, robot_here + cells * step - shift);
    }
    outcomes.push_back(outcome);
  };
  Walk(
      b, move.direction, move.cells, [&](int cells, SetId set, const Cell& shift) { add(cells, true, set, shift); },
      [&](int cells, SetId set, const Cell& shift) {
        if (cells == move.cells) add(cells, false, set, shift);
      },
      [](int, int) {});
  return outcomes;
}

std::size_t BeliefGraph::bytes() const {
  return beliefs_.capacity() * sizeof(Belief) + actions_.capacity() * sizeof(BeliefAction) +
         contacts_.capacity() * sizeof(BeliefId) + table_.capacity() * sizeof(Slot) + sets_.bytes();
}

}  // namespace feeler::planner
