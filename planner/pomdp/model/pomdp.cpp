#include "feeler/planner/pomdp/model/pomdp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {
namespace {

/// Costs and sums of probabilities below this are rounding.
constexpr double kNegligible = 1e-12;

}  // namespace

std::size_t Pomdp::bytes() const {
  return (transitions.entries.size() + observation_rows.entries.size()) * sizeof(SparseEntry) +
         (transitions.begin.size() + observation_rows.begin.size() + reward.size()) * 8;
}

void RequireFits(const std::string& where, double states, double actions, double entries) {
  // A name and the values of the bounds a state; two rows while they are built, two rows in the end and a reward a pair
  // of state and action.
  const double bytes = states * (64.0 + 16.0 * actions) + states * actions * 96.0 + entries * 2.0 * sizeof(SparseEntry);
  if (bytes <= kPomdpMemoryLimitBytes) return;
  throw InputError(
      where,
      fmt::format("{:.4g} states, {:.4g} actions and {:.3g} probabilities would take {:.3g} GB, more than {:.3g}",
                  states, actions, entries, bytes / 1e9, kPomdpMemoryLimitBytes / 1e9),
      "make the model smaller");
}

std::vector<std::uint8_t> AbsorbingStates(const Pomdp& pomdp) {
  std::vector<std::uint8_t> absorbing(pomdp.state_count(), 1);
  for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
    for (std::size_t s = 0; s < pomdp.state_count(); ++s) {
      const auto row = pomdp.transitions.Row(pomdp.At(a, s));
      const bool stays = row.size() == 1 && row[0].index == s;
      if (!stays || std::abs(pomdp.reward[pomdp.At(a, s)]) > kNegligible) absorbing[s] = 0;
    }
  }
  return absorbing;
}

namespace {

/// SurelyEnding, interrupted by `pulse`.
std::vector<std::uint8_t> FindSurelyEnding(const Pomdp& pomdp, Pulse& pulse) {
  const std::size_t count = pomdp.state_count();
  const std::size_t rows = pomdp.transitions.size();
  std::vector<std::size_t> begin(count + 1, 0);  // of the rows that lead to a state
  for (const SparseEntry& next : pomdp.transitions.entries) ++begin[next.index + 1];
  for (std::size_t s = 0; s < count; ++s) begin[s + 1] += begin[s];
  std::vector<std::size_t> leading(begin[count]);
  std::vector<std::size_t> at(begin.begin(), begin.end() - 1);
  for (std::size_t row = 0; row < rows; ++row) {
    for (const SparseEntry& next : pomdp.transitions.Row(row)) leading[at[next.index]++] = row;
  }
  const std::vector<std::uint8_t> ends = AbsorbingStates(pomdp);
  // Keeps the states from which some action stays among the kept ones and may come nearer: the goal for certain.
  std::vector<std::uint8_t> kept(count, 1);
  std::vector<std::uint32_t> open;
  std::vector<std::uint8_t> stays(rows, 1);  // rows that lead to kept states alone
  for (bool changed = true; changed;) {
    std::vector<std::uint8_t> near = ends;
    for (std::uint32_t s = 0; s < count; ++s) {
      if (near[s] != 0) open.push_back(s);
    }
    while (!open.empty()) {
      const std::uint32_t to = open.back();
      open.pop_back();
      for (std::size_t k = begin[to]; k < begin[to + 1]; ++k) {
        const auto s = static_cast<std::uint32_t>(leading[k] % count);
        if (near[s] != 0 || kept[s] == 0 || stays[leading[k]] == 0) continue;
        near[s] = 1;
        open.push_back(s);
      }
      pulse(3 * (begin[to + 1] - begin[to]) + 10);
    }
    changed = near != kept;
    for (std::size_t s = 0; s < count; ++s) {
      if (near[s] != 0 || kept[s] == 0) continue;
      for (std::size_t k = begin[s]; k < begin[s + 1]; ++k) stays[leading[k]] = 0;
      pulse(begin[s + 1] - begin[s] + 1);
    }
    kept = std::move(near);
  }
  return kept;
}

}  // namespace

std::vector<std::uint8_t> SurelyEnding(const Pomdp& pomdp, const std::function<bool()>& stop) {
  Pulse pulse(stop);
  try {
    return FindSurelyEnding(pomdp, pulse);
  } catch (const Interrupted&) {
    return std::vector<std::uint8_t>(pomdp.state_count(), 1);
  }
}

std::vector<std::uint32_t> ReachableStates(const Pomdp& pomdp) {
  std::vector<std::uint8_t> met(pomdp.state_count(), 0);
  std::vector<std::uint32_t> open;
  const auto meet = [&](std::uint32_t s) {
    if (met[s] != 0) return;
    met[s] = 1;
    open.push_back(s);
  };
  for (const SparseEntry& s : pomdp.start) meet(s.index);
  while (!open.empty()) {
    const std::uint32_t s = open.back();
    open.pop_back();
    for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
      for (const SparseEntry& next : pomdp.transitions.Row(pomdp.At(a, s))) meet(next.index);
    }
  }
  std::vector<std::uint32_t> states;
  for (std::uint32_t s = 0; s < met.size(); ++s) {
    if (met[s] != 0) states.push_back(s);
  }
  return states;
}

Pomdp Restrict(const Pomdp& pomdp, std::span<const std::uint32_t> states) {
  Pomdp restricted;
  restricted.name = pomdp.name;
  restricted.discount = pomdp.discount;
  restricted.values_are_costs = pomdp.values_are_costs;
  restricted.actions = pomdp.actions;
  restricted.observations = pomdp.observations;
  std::vector<std::uint32_t> number(pomdp.state_count(), 0);
  for (const std::uint32_t s : states) {
    number[s] = static_cast<std::uint32_t>(restricted.states.size());
    restricted.states.push_back(pomdp.states[s]);
  }
  std::vector<SparseEntry> row;
  for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
    for (const std::uint32_t s : states) {
      row.clear();
      for (const SparseEntry& next : pomdp.transitions.Row(pomdp.At(a, s)))
        row.push_back({number[next.index], next.value});
      restricted.transitions.Append(row);
      restricted.observation_rows.Append(pomdp.observation_rows.Row(pomdp.At(a, s)));
      restricted.reward.push_back(pomdp.reward[pomdp.At(a, s)]);
    }
  }
  for (const SparseEntry& s : pomdp.start) restricted.start.push_back({number[s.index], s.value});
  return restricted;
}

void RequireSolvable(const Pomdp& pomdp) {
  if (pomdp.discount < 1.0) return;
  const std::vector<std::uint8_t> goals = AbsorbingStates(pomdp);
  if (std::ranges::count(goals, 1) == 0) {
    throw InputError(pomdp.name, "a discount of 1 without goals (absorbing states where nothing is earned or paid)",
                     "give a discount below 1, or add a goal");
  }
  for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
    for (std::size_t s = 0; s < pomdp.state_count(); ++s) {
      if (pomdp.reward[pomdp.At(a, s)] <= kNegligible) continue;
      throw InputError(
          pomdp.name,
          fmt::format("a discount of 1, and action \"{}\" in state \"{}\" earns {:g}: costs and rewards mixed",
                      pomdp.actions[a], pomdp.states[s], pomdp.reward[pomdp.At(a, s)]),
          "give a discount below 1, or costs alone");
    }
  }
}

}  // namespace feeler::planner
