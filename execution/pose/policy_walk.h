#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "feeler/execution/contact/execution_record.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/execution/pose/pose_fit.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// A motion in lattice coordinates, felt from `from` along `direction` to where it was reported to end.
FeltMotion FeltFrom(const LatticeFrame& frame, Direction direction, const Eigen::Vector3d& from,
                    const MotionReport& report, double sigma_m);

/// A reading at transfer speed is this uncertain, m.
inline constexpr double kFastSigma_m = 1e-3;
inline constexpr double kProbeSigma_m = 1e-4;

/// Follows a policy whose readings need not round to its outcomes: takes the branch of the hypothesis that explains all
/// readings so far best, and ends at a leaf, or where tool and policy part. What was felt is what counts.
class PolicyWalk {
 public:
  /// All arguments outlive the walk. The tool stands at the start cell of the problem.
  PolicyWalk(const planner::Problem& problem, policies::Policy& policy, Mover& mover, ExecutionRecord& record);

  /// Adds every motion to `felt`; asks `enough` after every contact whether the walk may end early. What the policy
  /// wants at the end: to insert with or without confirming touches; with, where tool and policy parted before a leaf.
  /// Throws ExecutionFailure if it wants what needs a known orientation.
  policies::Insert Run(std::vector<FeltMotion>& felt, const std::function<bool()>& enough);

  /// Weighted mean of the hypotheses left: `pose_of` turns one into a PoseVector.
  template <class PoseOf>
  PoseVector Mean(const PoseOf& pose_of) const {
    PoseVector sum = PoseVector::Zero();
    double weight = 0.0;
    for (const Tracked& t : tracked_) {
      sum += t.hypothesis.weight * pose_of(t.hypothesis);
      weight += t.hypothesis.weight;
    }
    return sum / weight;
  }

 private:
  struct Tracked {
    planner::Hypothesis hypothesis;
    int index = 0;
    double misfit = 0.0;  ///< sum of squares of its readings, cells
  };
  struct Reading {
    double travelled = 0.0;  ///< cells, from the lattice point of the robot cell
    bool contact = false;
  };
  /// Travel from the lattice point along the move, cells.
  double Predict(const Tracked& tracked, const GuardedMove& move) const;
  Reading Feel(const GuardedMove& move, double nearest, double farthest, std::vector<FeltMotion>& felt);
  /// Tells the policy the outcome that explains the reading best. False: it knows none.
  bool TakeOver(const GuardedMove& move, const Reading& reading);
  bool Flush(std::vector<FeltMotion>& felt);
  /// Fast along an axis; no faster than the budget allows past a place beside which a wall was met in this direction,
  /// as the edge may be farther off than the policy knows, and where one may come within kSure. `clear`: cells behind
  /// `target` that are free under every hypothesis left.
  MotionReport FastPast(const Eigen::Vector3d& target, Direction direction, double clear);
  Eigen::Vector3d Station() const { return robot_.cast<double>() + problem_.map->phase(); }

  const planner::Problem& problem_;
  policies::Policy& policy_;
  Mover& mover_;
  ExecutionRecord& record_;
  std::vector<Tracked> tracked_;
  Cell robot_;
  bool pending_ = false;  ///< the tool still has to go to Station()
  Direction pending_direction_ = Direction::kPlusX;
  double pending_clear_ = 0.0;  ///< cells behind Station() that are free under every hypothesis left
  std::array<std::optional<Eigen::Vector3d>, kDirectionCount> met_;  ///< where the tool last met a wall in a direction
};

}  // namespace feeler::execution
