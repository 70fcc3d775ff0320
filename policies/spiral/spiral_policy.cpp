#include "feeler/policies/spiral/spiral_policy.h"

#include <cmath>
#include <string>

#include "feeler/core/error.h"
#include "feeler/planner/belief/hull.h"

namespace feeler::policies {
namespace {

/// Beyond the box where the target may be: the tool drops in before it stands exactly over the opening.
constexpr double kFaceMargin_m = 0.002;
/// A tool that is pressed by 1 N lags behind the spiral by this: friction of 0.3 against a lateral stiffness of 1000
/// N/m.
constexpr double kLag_m_per_n = 0.0003;

void RequirePositive(const char* what, double value) {
  if (!(std::isfinite(value) && value > 0.0)) {
    throw InputError("spiral", std::string(what) + " is " + std::to_string(value), "give a positive finite number");
  }
}

}  // namespace

Eigen::Vector3d HalfWidths(const std::vector<Hypothesis>& hypotheses, double cell_m) {
  if (hypotheses.empty()) return Eigen::Vector3d::Zero();
  return 0.5 * cell_m * planner::HullOf(hypotheses).Size().cast<double>();
}

SpiralPolicy::SpiralPolicy(Direction insertion, double cell_m, const SpiralTuning& tuning)
    : insertion_(insertion), cell_m_(cell_m), tuning_(tuning) {
  RequirePositive("the cell size", cell_m);
  RequirePositive("the pitch", tuning.pitch_m);
  RequirePositive("the speed", tuning.speed_m_s);
  RequirePositive("the force", tuning.press_n);
}

void SpiralPolicy::Begin(const planner::Problem& problem) {
  for (const planner::Hypothesis& h : problem.hypotheses) {
    if (h.orientation != problem.hypotheses.front().orientation) {
      throw InputError("spiral", "the orientation of the target is uncertain", "choose a policy that localizes");
    }
  }
}

Decision SpiralPolicy::Next(const Belief& belief) {
  const Eigen::Vector3d half_m = HalfWidths(belief.hypotheses, cell_m_);
  const int axis = AxisOf(insertion_);
  Eigen::Vector3d across_m = half_m;
  across_m[axis] = 0.0;
  SpiralSearch search;
  // To the corners, a turn more, so that the last turn lies outside, and what the tool lags behind.
  search.radius_m = across_m.norm() + tuning_.pitch_m + kLag_m_per_n * tuning_.press_n;
  search.pitch_m = tuning_.pitch_m;
  search.speed_m_s = tuning_.speed_m_s;
  search.press_n = tuning_.press_n;
  search.face_range_m = half_m[axis] + kFaceMargin_m;
  return search;
}

bool SpiralPolicy::Observe(const Outcome& /*outcome*/) { return false; }

}  // namespace feeler::policies
