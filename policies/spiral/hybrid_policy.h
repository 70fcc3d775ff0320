#pragma once

#include <memory>
#include <string_view>

#include "feeler/core/direction.h"
#include "feeler/policies/policy.h"

namespace feeler::policies {

/// Spiral search where the uncertainty is small, touch where it is not: the choice is made once, at the start, by the
/// largest half width of the box of possible positions across the insertion.
class HybridPolicy final : public Policy {
 public:
  /// `touch` is asked from `threshold_m` on. Neither policy may be null.
  HybridPolicy(std::unique_ptr<Policy> spiral, std::unique_ptr<Policy> touch, Direction insertion, double cell_m,
               double threshold_m);

  std::string_view name() const override { return "hybrid"; }
  void Begin(const planner::Problem& problem) override;
  Decision Next(const Belief& belief) override { return chosen_->Next(belief); }
  bool reads_hypotheses() const override { return chosen_->reads_hypotheses(); }
  bool Observe(const Outcome& outcome) override { return chosen_->Observe(outcome); }

  /// Name of the policy that the present episode goes by.
  std::string_view chosen() const { return chosen_->name(); }

 private:
  std::unique_ptr<Policy> spiral_;
  std::unique_ptr<Policy> touch_;
  Direction insertion_;
  double cell_m_;
  double threshold_m_;
  Policy* chosen_;
};

}  // namespace feeler::policies
