#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {

/// The belief after an action, by observation: f(observation, probability, belief), in the order of observations.
/// Impossible ones are left out.
class BeliefUpdate {
 public:
  /// `pulse` (may be null) may interrupt an update; the object is of no use then.
  explicit BeliefUpdate(const Pomdp& pomdp, Pulse* pulse = nullptr)
      : pomdp_(pomdp), pulse_(pulse), parts_(pomdp.observation_count()) {}

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
  Pulse* pulse_;
  std::vector<std::vector<SparseEntry>> parts_;
  std::vector<std::uint32_t> seen_;
  std::vector<SparseEntry> moved_;
};

}  // namespace feeler::planner
