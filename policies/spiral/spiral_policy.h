#pragma once

#include <string_view>

#include "feeler/core/direction.h"
#include "feeler/policies/policy.h"

namespace feeler::policies {

/// What a spiral search is tuned by; its extent follows from the uncertainty.
struct SpiralTuning {
  double pitch_m = 0.0015;
  double speed_m_s = 0.02;
  double press_n = 10.0;
  bool operator==(const SpiralTuning&) const = default;
};

/// Blind search, as industry does it: comes down at the mean of the hypotheses, and slides on the face around the
/// opening along an Archimedean spiral that covers every hypothesis. Makes no use of what is felt on the way.
class SpiralPolicy final : public Policy {
 public:
  /// `insertion`: the direction of the insertion; `cell_m` the lattice spacing of the problems. Throws InputError for
  /// a tuning that is not positive.
  SpiralPolicy(Direction insertion, double cell_m, const SpiralTuning& tuning);

  std::string_view name() const override { return "spiral"; }
  void Begin(const planner::Problem& problem) override;
  Decision Next(const Belief& belief) override;
  bool Observe(const Outcome& outcome) override;

 private:
  Direction insertion_;
  double cell_m_;
  SpiralTuning tuning_;
};

/// Half widths of the box where the target may be, m: half the span of the hypotheses, and half a cell.
Eigen::Vector3d HalfWidths(const std::vector<Hypothesis>& hypotheses, double cell_m);

}  // namespace feeler::policies
