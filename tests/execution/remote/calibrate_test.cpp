// Laws of a calibration, on a point over a block of springs: bias, stiffness, reaction time and tool offset are found;
// a bias above the contact force spoils nothing; what cannot be measured is refused with what fits to mend it.
#include "feeler/execution/remote/calibrate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "feeler/core/error.h"
#include "feeler/core/random.h"

namespace feeler::execution {
namespace {

/// A point that is `tip_m` off from where it believes to be, over a block: it stops a reaction time after the force.
class SpringCell final : public Robot {
 public:
  Pose ToolPose() const override { return pose_; }
  Wrench ContactWrench() const override {
    Eigen::Vector3d read = Force();
    for (int axis = 0; axis < 3 && noise_n > 0.0; ++axis) read[axis] += noise_n * random_.Normal();
    return {read, Eigen::Vector3d::Zero()};
  }
  void ZeroWrench() override { zero_n_ = Force() + zero_n_; }
  double Time() const override { return time_s_; }
  MotionResult Transfer(const Pose& goal) override { return Go(goal.translation(), 0.25, 1e9); }
  MotionResult LinearMove(const Pose& goal, double speed_m_s, double force_n) override {
    hardest_n = std::max(hardest_n, force_n < 1e5 ? force_n : 0.0);
    return Go(goal.translation(), speed_m_s, force_n);
  }
  MotionResult Guarded(const GuardedMotion& motion) override {
    hardest_n = std::max(hardest_n, motion.contact_force_n);
    if (!detail.empty()) return {.reason = StopReason::kAborted, .world_T_tool = pose_, .detail = detail};
    return Go(pose_.translation() + motion.distance_m * motion.direction, motion.speed_m_s, motion.contact_force_n);
  }
  MotionResult Compliant(const CompliantMotion&) override { return {}; }

  Eigen::Vector3d min_m{-0.01, -0.02, 0.0};
  Eigen::Vector3d max_m{0.01, 0.02, 0.1};
  Eigen::Vector3d tip_m{0.001, -0.002, 0.0005};
  Eigen::Vector3d bias_n{0.0, 0.0, 8.0};
  double noise_n = 0.0;  ///< standard deviation of each component of what is read
  double stiffness_n_m = 5e4;
  double reaction_time_s = 0.01;
  std::string detail;  ///< that every guarded motion ends with
  double hardest_n = 0.0;

 private:
  Eigen::Vector3d Force() const {
    const Eigen::Vector3d p = pose_.translation() + tip_m;
    Eigen::Vector3d force = bias_n - zero_n_;
    if (!((p - min_m).array() > 0.0).all() || !((max_m - p).array() > 0.0).all()) return force;
    int axis = 0;
    const double below_m = (p - min_m).minCoeff(&axis);
    int other = 0;
    const double above_m = (max_m - p).minCoeff(&other);
    if (above_m < below_m) force[other] += stiffness_n_m * above_m;
    if (above_m >= below_m) force[axis] -= stiffness_n_m * below_m;
    return force;
  }
  MotionResult Go(const Eigen::Vector3d& goal, double speed_m_s, double force_n) {
    constexpr double kStep_s = 1e-4;
    MotionResult result;
    double over_s = 0.0;  // since the force
    while ((goal - pose_.translation()).norm() > 1e-12) {
      const Eigen::Vector3d left = goal - pose_.translation();
      pose_.translation() += left * std::min(1.0, kStep_s * speed_m_s / left.norm());
      time_s_ += kStep_s;
      result.peak_force_n = std::max(result.peak_force_n, Force().norm());
      if (!result.contact && Force().norm() > force_n) {
        result.contact = true;
        result.reason = StopReason::kContact;
        result.world_T_tool = pose_;
      }
      if (result.contact && (over_s += kStep_s) > reaction_time_s) return result;
    }
    if (!result.contact) result.world_T_tool = pose_;
    return result;
  }

  Pose pose_ = MakePose(Eigen::Vector3d(0.0, 0.0, 0.13));
  Eigen::Vector3d zero_n_ = Eigen::Vector3d::Zero();
  double time_s_ = 0.0;
  mutable RandomStream random_{1, 0, "sensor"};
};

KnownBlock BlockOf(const SpringCell& cell) { return {cell.min_m, cell.max_m}; }

std::string WhyNot(SpringCell& cell, const CalibrationSettings& settings = {}) {
  try {
    Calibrate(cell, BlockOf(cell), settings);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(WireCalibrate, ABiasAboveTheContactForceIsFoundAndSpoilsNothing) {
  for (const double bias_n : {0.0, 8.0, 30.0}) {
    SpringCell cell;
    cell.bias_n.z() = bias_n;
    const CellFile found = Calibrate(cell, BlockOf(cell));
    EXPECT_NEAR(*found.force_bias_n, bias_n, 1e-9);
    EXPECT_NEAR(*found.stiffness_n_m, cell.stiffness_n_m, 0.05 * cell.stiffness_n_m);
    ASSERT_TRUE(found.reaction_time_s);
    EXPECT_NEAR(*found.reaction_time_s, cell.reaction_time_s, 0.15 * cell.reaction_time_s);
    EXPECT_LT((found.tool_offset_m - cell.tip_m).norm(), 5e-5) << found.tool_offset_m.transpose();
  }
}

TEST(WireCalibrate, TheNoiseOfTheSensorIsItsSpreadAtRest) {
  SpringCell quiet;
  EXPECT_NEAR(*Calibrate(quiet, BlockOf(quiet)).force_noise_n, 0.0, 1e-9);
  for (const double noise_n : {0.1, 0.5}) {
    SpringCell cell;
    cell.noise_n = noise_n;
    CalibrationSettings settings;
    settings.samples = 400;
    EXPECT_NEAR(*Calibrate(cell, BlockOf(cell), settings).force_noise_n, noise_n, 0.1 * noise_n);
  }
}

TEST(WireCalibrate, WhatIsPressedWithFollowsFromTheTouchAndFromTheRobot) {
  for (const double force_n : {1.0, 6.0, 20.0, 50.0}) {
    SpringCell cell;
    CalibrationSettings settings;
    settings.contact_force_n = force_n;
    settings.most_force_n = 80.0;
    const CellFile found = Calibrate(cell, BlockOf(cell), settings);
    EXPECT_NEAR(*found.stiffness_n_m, cell.stiffness_n_m, 0.1 * cell.stiffness_n_m) << force_n;
    EXPECT_GT(cell.hardest_n, 1.4 * force_n);
    EXPECT_LE(cell.hardest_n, settings.most_force_n);
  }
  SpringCell cell;
  CalibrationSettings settings;
  settings.contact_force_n = 50.0;
  settings.most_force_n = 60.0;
  EXPECT_NE(WhyNot(cell, settings).find("--contact-force"), std::string::npos);
  EXPECT_EQ(cell.hardest_n, 0.0) << "refused before anything is touched";
}

TEST(WireCalibrate, WhatCannotBeMeasuredIsRefusedOrLeftOut) {
  SpringCell rigid;
  rigid.stiffness_n_m = 1e9;
  const CellFile stiff = Calibrate(rigid, BlockOf(rigid));
  EXPECT_FALSE(stiff.stiffness_n_m || stiff.reaction_time_s) << "left out: stiffer than depths are told";
  SpringCell far;
  far.tip_m = Eigen::Vector3d(0.0, 0.0, 0.002);
  KnownBlock elsewhere = BlockOf(far);
  elsewhere.max_m.z() -= 0.06;
  EXPECT_THROW(Calibrate(far, elsewhere), WorldError);
  SpringCell quick;
  quick.reaction_time_s = 0.0;
  EXPECT_FALSE(Calibrate(quick, BlockOf(quick)).reaction_time_s);
}

TEST(WireCalibrate, TheMendFitsWhatWentWrong) {
  SpringCell cell;
  cell.detail = "protective stop: the arm touches something";
  EXPECT_NE(WhyNot(cell).find("look at the robot"), std::string::npos) << WhyNot(cell);
  cell.detail = "link lost: silent for 0.1 s";
  EXPECT_NE(WhyNot(cell).find("network"), std::string::npos) << WhyNot(cell);
  SpringCell low;
  KnownBlock block = BlockOf(low);
  low.max_m.z() = 0.02;  // nothing is met where it is said to stand
  try {
    Calibrate(low, block);
    ADD_FAILURE();
  } catch (const WorldError& error) {
    EXPECT_NE(std::string(error.what()).find("nothing was met"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace feeler::execution
