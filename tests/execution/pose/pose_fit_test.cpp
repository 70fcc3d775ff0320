// From touches to a continuous pose, on a target whose travel is known in closed form (a union of two boxes, felt by a
// point). Laws:
//   from touches that are chosen as they go, with noisy readings, the pose comes out to within a few readings' errors;
//   a false reading among right ones moves it no farther than their noise;  an axis that nothing tells of stays as
//   uncertain as the box is wide;  a chosen touch begins where no candidate is in the way;  what is felt at the true
//   pose leaves no residual, and candidates that are alike leave nothing to choose.

#include "feeler/execution/pose/pose_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/execution/pose/touch_choice.h"

namespace feeler::execution {
namespace {

/// A socket of 40 x 40 x 60 mm under the origin and an arm of 100 mm along x.
class Blocks final : public planner::TravelModel {
 public:
  std::vector<double> Travel(const Pose& frame_T_target, const std::vector<planner::ToolMotion>& motions) override {
    std::vector<double> travel;
    for (const planner::ToolMotion& motion : motions) {
      const Eigen::Vector3d from = frame_T_target.inverse() * motion.from_m;
      const Eigen::Vector3d along = frame_T_target.linear().transpose() * UnitVector(motion.direction);
      double least = kUnlimited_m;
      for (const auto& box : boxes_) {
        double enter = -kUnlimited_m;
        double leave = kUnlimited_m;
        for (int axis = 0; axis < 3; ++axis) {
          const double a = (box[0][axis] - from[axis]) / along[axis];
          const double b = (box[1][axis] - from[axis]) / along[axis];
          enter = std::max(enter, std::min(a, b));
          leave = std::min(leave, std::max(a, b));
        }
        if (enter < leave && leave > 0.0) least = std::min(least, enter);
      }
      travel.push_back(least);
    }
    return travel;
  }

 private:
  std::array<std::array<Eigen::Vector3d, 2>, 2> boxes_ = {
      {{Eigen::Vector3d(-0.02, -0.02, -0.06), Eigen::Vector3d(0.02, 0.02, 0.0)},
       {Eigen::Vector3d(0.0, -0.015, -0.05), Eigen::Vector3d(0.1, 0.015, -0.02)}}};
};

PoseBox Box() {
  PoseBox box;
  box.upper << 0.01, 0.01, 0.0, 0.12, 0.12;
  box.lower = -box.upper;
  return box;
}

PoseVector Uniform(const PoseBox& box, RandomStream& random) {
  PoseVector pose = PoseVector::Zero();
  for (int axis = 0; axis < 5; ++axis) {
    if (box.upper[axis] > box.lower[axis]) pose[axis] = random.Uniform(box.lower[axis], box.upper[axis]);
  }
  return pose;
}

TouchSpace Space() {
  TouchSpace space;
  space.lower_m = {-0.06, -0.06, -0.04};
  space.upper_m = {0.11, 0.06, 0.02};
  space.clear_m = 0.02;
  return space;
}

/// What a touch reads if the target is at `truth`.
FeltMotion Feel(Blocks& blocks, const TouchPlan& plan, const PoseVector& truth, double error_m) {
  FeltMotion felt;
  felt.motion = plan.motion;
  const double travel = blocks.Travel(ToPose(truth), {plan.motion})[0];
  const double end = plan.farthest_m + 3e-3;
  felt.contact = travel < end;
  felt.travelled_m = felt.contact ? travel + error_m : end;
  return felt;
}

struct Found {
  std::vector<FeltMotion> felt;
  std::vector<PoseVector> starts;
  PoseFit fit;
};

Found Localize(Blocks& blocks, const PoseVector& truth, RandomStream& random, int touches) {
  Found found;
  std::vector<PoseCandidate> candidates;
  for (int i = 0; i < 40; ++i) {
    found.starts.push_back(Uniform(Box(), random));
    candidates.push_back({found.starts.back(), 1.0});
  }
  for (int touch = 0; touch < touches; ++touch) {
    const auto plan = ChooseTouch(blocks, candidates, Space(), {0, 0, 0.02}, random.Next());
    if (!plan) break;
    found.felt.push_back(Feel(blocks, *plan, truth, 5e-5 * random.Normal()));
    const auto fits = FitPose(blocks, found.felt, Box(), found.starts);
    found.fit = fits.front();
    candidates.clear();
    for (const PoseFit& fit : fits) {
      if (fit.cost > found.fit.cost + 40) break;
      candidates.push_back({fit.pose, std::exp(-0.1 * (fit.cost - found.fit.cost))});
    }
    candidates.push_back({Uniform(Box(), random), 1e-3});
  }
  return found;
}

TEST(PoseFit, FindsThePoseFromTouchesThatItChooses) {
  Blocks blocks;
  for (std::uint64_t episode = 0; episode < 6; ++episode) {
    RandomStream random(11, episode, "pose fit");
    const PoseVector truth = Uniform(Box(), random);
    const Found found = Localize(blocks, truth, random, 12);
    const PoseVector error = (found.fit.pose - truth).cwiseAbs();
    EXPECT_LT(error.head<3>().maxCoeff(), 3e-4) << "episode " << episode;
    // The yaw matters least to what is chosen (TouchChoiceOptions::scale).
    EXPECT_LT(error[3], 1.5e-2) << "episode " << episode;
    EXPECT_LT(error[4], 6e-3) << "episode " << episode;
    EXPECT_LT(found.fit.worst_m, 5e-4);
  }
}

TEST(PoseFit, AFalseReadingIsOutvoted) {
  Blocks blocks;
  RandomStream random(12, 0, "pose fit");
  const PoseVector truth = Uniform(Box(), random);
  Found found = Localize(blocks, truth, random, 14);
  found.felt[5].travelled_m -= 4e-3;
  found.felt[5].contact = true;
  const PoseVector error = (FitPose(blocks, found.felt, Box(), found.starts).front().pose - truth).cwiseAbs();
  EXPECT_LT(error.head<3>().maxCoeff(), 5e-4);
  EXPECT_LT(error.tail<2>().maxCoeff(), 1e-2);
}

TEST(PoseFit, WhatNothingTellsOfStaysAsWideAsTheBox) {
  Blocks blocks;
  const PoseVector truth = PoseVector::Zero();
  // Only the height of the socket: tells of the pitch, never of y.
  std::vector<FeltMotion> felt;
  for (const double x : {-0.011, 0.012}) {
    FeltMotion motion;
    motion.motion = {{x, 0.003, 0.02}, Direction::kMinusZ};
    motion.travelled_m = blocks.Travel(ToPose(truth), {motion.motion})[0];
    motion.contact = true;
    felt.push_back(motion);
  }
  const PoseFit fit = FitPose(blocks, felt, Box(), {truth}).front();
  const double prior = 0.02 / std::sqrt(12.0);
  EXPECT_NEAR(std::sqrt(fit.covariance(1, 1)), prior, 0.05 * prior);
  EXPECT_LT(std::sqrt(fit.covariance(4, 4)), 0.01);
  EXPECT_EQ(fit.covariance(2, 2), 0.0);  // certain
  EXPECT_LT(fit.cost, 1e-6);
}

TEST(TouchChoice, BeginsWhereNoCandidateIsInTheWay) {
  Blocks blocks;
  for (std::uint64_t episode = 0; episode < 10; ++episode) {
    RandomStream random(13, episode, "choice");
    std::vector<PoseCandidate> candidates;
    for (int i = 0; i < 15; ++i) candidates.push_back({Uniform(Box(), random), 1.0});
    const auto plan = ChooseTouch(blocks, candidates, Space(), {0, 0, 0.02}, episode);
    ASSERT_TRUE(plan.has_value());
    EXPECT_GT(plan->gain, 0.0);
    EXPECT_LE(plan->nearest_m, plan->farthest_m);
    planner::ToolMotion way;
    way.from_m = plan->motion.from_m;
    way.from_m.z() = Space().clear_m;
    way.direction = Direction::kMinusZ;
    for (const PoseCandidate& candidate : candidates) {
      const Pose pose = ToPose(candidate.pose);
      EXPECT_GE(blocks.Travel(pose, {way})[0], way.from_m.z() - plan->motion.from_m.z());
      EXPECT_GT(blocks.Travel(pose, {plan->motion})[0], 0.0);
    }
  }
}

TEST(TouchChoice, NothingToChooseBetweenEqualCandidates) {
  Blocks blocks;
  const std::vector<PoseCandidate> alike(5, PoseCandidate{PoseVector::Zero(), 1.0});
  EXPECT_FALSE(ChooseTouch(blocks, alike, Space(), {0, 0, 0.02}, 1).has_value());
}

}  // namespace
}  // namespace feeler::execution
