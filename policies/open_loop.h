#pragma once

#include <string_view>

#include "feeler/policies/policy.h"

namespace feeler::policies {

/// Inserts at the mean of the hypotheses, without touching: what industry does where parts lie in fixtures. The floor
/// for every comparison.
class OpenLoopPolicy final : public Policy {
 public:
  std::string_view name() const override { return "open-loop"; }
  bool reads_hypotheses() const override { return false; }
  void Begin(const planner::Problem& /*problem*/) override {}
  Decision Next(const Belief& /*belief*/) override { return Insert{.confirm = false}; }
  bool Observe(const Outcome& /*outcome*/) override { return false; }
};

}  // namespace feeler::policies
