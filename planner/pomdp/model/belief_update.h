#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// The belief after an action, by observation: f(observation, probability, belief), in the order of observations.
/// Impossible ones are left out.
class BeliefUpdate {
 public:
  explicit BeliefUpdate(const Pomdp& pomdp) : pomdp_(pomdp), parts_(pomdp.observation_count()) {}

  template <class F>
  void operator()(std::span<const SparseEntry> belief, std::size_t action, F f) {
    Collect(belief, action);
    for (const std::uint32_t o : seen_) {
      double probability = 0.0;
      for (const SparseEntry& s : parts_[o]) probability += s.value;
      if (probability > 1e-14) {
        for (SparseEntry& s : parts_[o]) s.value /= probability;
        f(o, probability, parts_[o]);
      }
      parts_[o].clear();
    }
  }

 private:
  /// P(s', o | b, a) into parts_[o], by ascending s'; the observations met into seen_.
  void Collect(std::span<const SparseEntry> belief, std::size_t action);

  const Pomdp& pomdp_;
  std::vector<std::vector<SparseEntry>> parts_;
  std::vector<std::uint32_t> seen_;
  std::vector<SparseEntry> moved_;
};

}  // namespace feeler::planner
