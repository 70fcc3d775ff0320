#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace feeler::planner {

/// A Markov chain, built state by state. A state without steps is an end.
class MarkovChain {
 public:
  /// Starts the next state, numbered from 0.
  void AddState() { first_.push_back(steps_.size()); }
  /// A step of the state that was added last; states that it leads to may be added later.
  void AddStep(std::uint32_t next, double probability) { steps_.emplace_back(next, probability); }

  /// The expected sum of what is had at each state from there to the end, x = at + P x: by strongly connected
  /// components (Tarjan 1972), ends first, each a linear system of its own. What goes round without a way out comes to
  /// `endless`.
  std::vector<double> ExpectedSums(const std::vector<double>& at, double endless);

 private:
  std::size_t StepsEnd(std::uint32_t state) const {
    return state + std::size_t{1} < first_.size() ? first_[state + std::size_t{1}] : steps_.size();
  }
  /// States by component, ends first, and where each component ends among them.
  struct Components {
    std::vector<std::uint32_t> states;
    std::vector<std::size_t> ends;
  };
  void FindComponents();
  /// x of a state by those of the states that it leads to; of its own by what it stays with.
  double Alone(std::uint32_t state, double at, double endless, const std::vector<double>& x) const;
  void SolveComponent(std::span<const std::uint32_t> component, const std::vector<double>& at, double endless,
                      std::vector<double>& x);

  std::vector<std::size_t> first_;
  std::vector<std::pair<std::uint32_t, double>> steps_;
  Components components_;             ///< of so many states as `place_` has
  std::vector<std::uint32_t> place_;  ///< by state, in the component in work
};

}  // namespace feeler::planner
