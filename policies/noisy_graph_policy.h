#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "feeler/planner/noise/noisy_policy.h"
#include "feeler/policies/policy.h"

namespace feeler::policies {

/// A policy that was computed for readings that are wrong now and then: follows its graph, which may be cyclic (a wall
/// is felt for again), asks its executor to weigh hypotheses, inserts where the graph declares and gives up where that
/// does.
class NoisyGraphPolicy final : public Policy {
 public:
  /// Throws InputError for a graph that is not sound.
  NoisyGraphPolicy(std::shared_ptr<const planner::NoisyPolicy> policy, const Doubt& doubt);

  std::string_view name() const override { return "noisy"; }
  void Begin(const planner::Problem& problem) override;
  Decision Next(const Belief& belief) override;
  bool reads_hypotheses() const override { return false; }
  const Doubt* doubt() const override { return &doubt_; }
  bool Observe(const Outcome& outcome) override;

 private:
  std::shared_ptr<const planner::NoisyPolicy> policy_;
  Doubt doubt_;
  std::uint32_t node_ = 0;
};

}  // namespace feeler::policies
