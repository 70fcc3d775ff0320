#include "feeler/execution/pose/touch_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "feeler/core/random.h"

namespace feeler::execution {
namespace {

using planner::ToolMotion;

/// A probe sets out this far from the nearest place where a candidate would be met.
constexpr double kRunUp_m = 5e-3;
/// Beside a touch the same wall must be met this near, this far to the sides.
constexpr double kSide_m = 8e-4;
constexpr double kEven_m = 1.5e-3;

struct Probe {
  ToolMotion motion;
  ToolMotion way;  ///< from the clear height to where the motion begins
  double way_m = 0.0;
  double limit_m = 0.0;  ///< to the end of the space
};

class Choice {
 public:
  Choice(planner::TravelModel& model, const std::vector<PoseCandidate>& candidates, const TouchSpace& space,
         const TouchChoiceOptions& options, std::uint64_t draw)
      : model_(model),
        candidates_(candidates),
        space_(space),
        options_(options),
        random_(0, draw, "touches"),
        along_(AxisOf(space.insertion)) {}

  std::optional<TouchPlan> Run(const Eigen::Vector3d& tool_m) {
    std::vector<Probe> probes = Draw();
    SetOut(probes);
    const std::vector<std::vector<double>> travel = TravelOf(probes);
    std::optional<TouchPlan> best;
    for (std::size_t i = 0; i < probes.size(); ++i) {
      std::optional<TouchPlan> plan = Judge(probes[i], i, travel, tool_m);
      if (plan && (!best || plan->gain > best->gain) && IsEven(probes[i].motion)) best = plan;
    }
    return best;
  }

 private:
  double Within(int axis) { return random_.Uniform(space_.lower_m[axis], space_.upper_m[axis]); }

  /// Half along the insertion from above, half from the sides of the space.
  std::vector<Probe> Draw() {
    std::vector<Probe> probes;
    const int u = (along_ + 1) % 3;
    const int v = (along_ + 2) % 3;
    for (int i = 0; i < options_.probes; ++i) {
      Probe probe;
      Eigen::Vector3d& from = probe.motion.from_m;
      from[u] = Within(u);
      from[v] = Within(v);
      from[along_] = space_.clear_m;
      probe.motion.direction = space_.insertion;
      const auto kind = random_.Index(6);
      if (kind >= 2) {
        const int axis = kind < 4 ? u : v;
        const int sign = kind % 2 == 0 ? 1 : -1;
        probe.motion.direction = MakeDirection(axis, sign);
        from[along_] = Within(along_);
        from[axis] = sign > 0 ? space_.lower_m[axis] : space_.upper_m[axis];
      }
      const int axis = AxisOf(probe.motion.direction);
      const double end = SignOf(probe.motion.direction) > 0 ? space_.upper_m[axis] : space_.lower_m[axis];
      probe.limit_m = std::abs(end - from[axis]);
      probes.push_back(probe);
    }
    return probes;
  }

  /// Motions of all probes under all candidates: [candidate][probe].
  std::vector<std::vector<double>> TravelUnderAll(const std::vector<ToolMotion>& motions) {
    std::vector<std::vector<double>> travel;
    for (const PoseCandidate& candidate : candidates_) travel.push_back(model_.Travel(ToPose(candidate.pose), motions));
    return travel;
  }

  /// Moves the beginning of every probe to shortly before the first candidate; drops those that meet none, or begin in
  /// one.
  void SetOut(std::vector<Probe>& probes) {
    std::vector<ToolMotion> motions;
    for (const Probe& probe : probes) motions.push_back(probe.motion);
    const auto travel = TravelUnderAll(motions);
    std::vector<Probe> kept;
    for (std::size_t i = 0; i < probes.size(); ++i) {
      double nearest = planner::TravelModel::kUnlimited_m;
      for (const auto& row : travel) nearest = std::min(nearest, row[i]);
      if (nearest < kRunUp_m || nearest >= probes[i].limit_m) continue;
      Probe probe = probes[i];
      const double ahead = nearest - kRunUp_m;
      probe.motion.from_m += ahead * UnitVector(probe.motion.direction);
      probe.limit_m -= ahead;
      probe.way.from_m = probe.motion.from_m;
      probe.way.from_m[along_] = space_.clear_m;
      probe.way.direction = space_.insertion;
      probe.way_m = std::abs(space_.clear_m - probe.motion.from_m[along_]);
      kept.push_back(probe);
    }
    probes = std::move(kept);
  }

  std::vector<std::vector<double>> TravelOf(const std::vector<Probe>& probes) {
    std::vector<ToolMotion> motions;
    for (const Probe& probe : probes) {
      motions.push_back(probe.motion);
      motions.push_back(probe.way);
    }
    return TravelUnderAll(motions);
  }

  std::optional<TouchPlan> Judge(const Probe& probe, std::size_t i, const std::vector<std::vector<double>>& travel,
                                 const Eigen::Vector3d& tool_m) const {
    TouchPlan plan;
    plan.motion = probe.motion;
    plan.nearest_m = probe.limit_m;
    double weight = 0.0;
    double mean = 0.0;
    PoseVector mean_pose = PoseVector::Zero();
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      const bool sideways = probe.motion.direction != space_.insertion;
      if (sideways && travel[k][2 * i + 1] < probe.way_m + options_.clearance_m) return std::nullopt;
      const double reading = std::min(travel[k][2 * i], probe.limit_m);
      plan.nearest_m = std::min(plan.nearest_m, reading);
      plan.farthest_m = std::max(plan.farthest_m, reading);
      weight += candidates_[k].weight;
      mean += candidates_[k].weight * reading;
      mean_pose += candidates_[k].weight * candidates_[k].pose;
    }
    mean /= weight;
    mean_pose /= weight;
    double variance = 0.0;
    PoseVector covariance = PoseVector::Zero();
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      const double off = std::min(travel[k][2 * i], probe.limit_m) - mean;
      variance += candidates_[k].weight / weight * off * off;
      covariance += candidates_[k].weight / weight * off * (candidates_[k].pose - mean_pose);
    }
    const double gain =
        covariance.cwiseQuotient(options_.scale).squaredNorm() / (variance + options_.noise_m * options_.noise_m);
    const Eigen::Vector3d way = probe.motion.from_m - tool_m;
    const double seconds = 0.6 + (way.norm() + 2.0 * probe.way_m) / options_.transfer_speed_m_s +
                           plan.farthest_m / options_.probe_speed_m_s;
    plan.gain = gain / seconds;
    if (!(gain > 0.0)) return std::nullopt;
    return plan;
  }

  /// The likeliest candidate is met at nearly the same place from beside.
  bool IsEven(const ToolMotion& motion) {
    const PoseCandidate& best =
        *std::max_element(candidates_.begin(), candidates_.end(),
                          [](const PoseCandidate& a, const PoseCandidate& b) { return a.weight < b.weight; });
    const int axis = AxisOf(motion.direction);
    std::vector<ToolMotion> beside(5, motion);
    beside[1].from_m[(axis + 1) % 3] += kSide_m;
    beside[2].from_m[(axis + 1) % 3] -= kSide_m;
    beside[3].from_m[(axis + 2) % 3] += kSide_m;
    beside[4].from_m[(axis + 2) % 3] -= kSide_m;
    const std::vector<double> travel = model_.Travel(ToPose(best.pose), beside);
    return std::all_of(travel.begin(), travel.end(),
                       [&](double other) { return std::abs(other - travel[0]) < kEven_m; });
  }

  planner::TravelModel& model_;
  const std::vector<PoseCandidate>& candidates_;
  const TouchSpace& space_;
  const TouchChoiceOptions& options_;
  RandomStream random_;
  int along_;
};

}  // namespace

std::optional<TouchPlan> ChooseTouch(planner::TravelModel& model, const std::vector<PoseCandidate>& candidates,
                                     const TouchSpace& space, const Eigen::Vector3d& tool_m, std::uint64_t draw,
                                     const TouchChoiceOptions& options) {
  return Choice(model, candidates, space, options, draw).Run(tool_m);
}

}  // namespace feeler::execution
