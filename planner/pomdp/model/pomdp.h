#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace feeler::planner {

/// A nonzero of a sparse vector.
struct SparseEntry {
  std::uint32_t index = 0;
  double value = 0.0;
};

/// Sparse rows, one after the other; within a row by ascending index.
struct SparseRows {
  std::vector<std::size_t> begin = {0};  ///< of row i; one more than there are rows
  std::vector<SparseEntry> entries;

  std::size_t size() const { return begin.size() - 1; }
  std::span<const SparseEntry> Row(std::size_t i) const { return {entries.data() + begin[i], begin[i + 1] - begin[i]}; }
  void Append(std::span<const SparseEntry> row) {
    entries.insert(entries.end(), row.begin(), row.end());
    begin.push_back(entries.size());
  }
};

/// A finite POMDP (states S, actions A, observations O), sparse. Rewards are maximised; a file's costs are negated
/// rewards. Every row of probabilities sums to 1 up to rounding.
struct Pomdp {
  std::string name;
  double discount = 1.0;          ///< in (0, 1]
  bool values_are_costs = false;  ///< what the file called them; here they are rewards all the same
  std::vector<std::string> states, actions, observations;
  SparseRows transitions;          ///< row At(a, s): P(s' | s, a)
  SparseRows observation_rows;     ///< row At(a, s'): P(o | a, s')
  std::vector<double> reward;      ///< At(a, s): expected over s' and o
  std::vector<SparseEntry> start;  ///< the initial belief

  std::size_t state_count() const { return states.size(); }
  std::size_t action_count() const { return actions.size(); }
  std::size_t observation_count() const { return observations.size(); }
  std::size_t At(std::size_t action, std::size_t state) const { return action * states.size() + state; }
  std::size_t bytes() const;
};

/// Largest tables that a reader builds.
inline constexpr double kPomdpMemoryLimitBytes = 2147483648.0;

/// Throws InputError at `where` if the tables of such a model, with `entries` nonzeros, would take more than the limit.
/// Called before anything of the size is allocated.
void RequireFits(const std::string& where, double states, double actions, double entries);

/// States that no action leaves and no action earns or costs anything in.
std::vector<std::uint8_t> AbsorbingStates(const Pomdp& pomdp);

/// The states from which a policy that sees the state comes to an absorbing one for certain. All, if `stop` (asked now
/// and then) cuts it short.
std::vector<std::uint8_t> SurelyEnding(const Pomdp& pomdp, const std::function<bool()>& stop);

/// The states that can be met from the initial belief, ascending.
std::vector<std::uint32_t> ReachableStates(const Pomdp& pomdp);
/// These states alone, renumbered in their order; nothing may lead out of them.
Pomdp Restrict(const Pomdp& pomdp, std::span<const std::uint32_t> states);

/// Throws InputError if the model cannot be solved: a discount of 1 without goals, or with rewards. (With a discount of
/// 1 the model is a goal POMDP: absorbing states of no reward are its goals, and nothing may be earned on the way.)
void RequireSolvable(const Pomdp& pomdp);

}  // namespace feeler::planner
