// Laws of tolerances, on pegs of known size over holes of known size:
// - what a task file does not give is measured: per axis the clearance, and the turns that take it up;
// - the numbers of a file are those of its axes, and a number for all is the same as one per axis;
// - judge, success of a localization, goal sets and fingerprints go by axis.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/gym/insertion_judge.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/mouth_clearance.h"
#include "feeler/execution/records/pose_error.h"
#include "feeler/planner/family/problem_family.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

/// The peg of 8 mm over a hole with so much room to each side.
TaskText PegOver(double room_x_m, double room_y_m) {
  TaskText text;
  const double x = 0.004 + room_x_m + 0.01;
  const double y = 0.004 + room_y_m + 0.01;
  text.target = fmt::format(
      R"(<geom name="west" type="box" size="0.01 0.03 0.01" pos="{0} 0 -0.01"/>
         <geom name="east" type="box" size="0.01 0.03 0.01" pos="{1} 0 -0.01"/>
         <geom name="south" type="box" size="0.01 0.01 0.01" pos="0 {2} -0.01"/>
         <geom name="north" type="box" size="0.01 0.01 0.01" pos="0 {3} -0.01"/>
         <geom name="lid" type="box" size="0.006 0.006 0.01" pos="0 0 -0.01" contype="0" conaffinity="0"/>)",
      -x, x, -y, y);
  return text;
}

TaskModel Load(const TaskText& text) { return LoadTaskFromText(text.Mjcf(), "peg.xml", "."); }

TEST(Tolerances, WhatIsNotGivenIsMeasuredPerAxis) {
  for (const auto& [x_m, y_m] : {std::pair{0.0001, 0.00015}, {0.0003, 0.0001}, {0.0002, 0.0002}}) {
    TaskText text = PegOver(x_m, y_m);
    for (const char* field : {"feeler_tolerance_lateral", "feeler_tolerance_vertical", "feeler_tolerance_angle"}) {
      text.numbers.erase(field);
    }
    const Tolerance tolerance = Load(text).task.tolerance;
    EXPECT_NEAR(tolerance.Lateral(0), x_m, 2e-6);
    EXPECT_NEAR(tolerance.Lateral(1), y_m, 2e-6);
    EXPECT_LE(tolerance.Lateral(0), x_m + 1e-7);  // what is derived enters
    EXPECT_EQ(tolerance.lateral_m, std::min(tolerance.Lateral(0), tolerance.Lateral(1)));
    EXPECT_NEAR(tolerance.vertical_m, 0.002, 1e-12);  // a fifth of 10 mm
    const double depth_m = 0.01;
    const double half_width_m = 0.004;
    EXPECT_NEAR(tolerance.Angle(0), std::clamp(2 * y_m / depth_m, 0.01, 0.05), 5e-4);
    EXPECT_NEAR(tolerance.Angle(1), std::clamp(2 * x_m / depth_m, 0.01, 0.05), 5e-4);
    EXPECT_NEAR(tolerance.Angle(2), std::clamp(std::min(x_m, y_m) / half_width_m, 0.01, 0.05), 5e-4);
  }
}

TEST(Tolerances, RoomWithoutEndIsNoWall) {
  TaskText text = PegOver(0.0002, 0.0002);
  // Open to both sides along x: a slot.
  text.target = R"(
      <geom name="south" type="box" size="0.03 0.01 0.01" pos="0 -0.0142 -0.01"/>
      <geom name="north" type="box" size="0.03 0.01 0.01" pos="0 0.0142 -0.01"/>
      <geom name="lid" type="box" size="0.006 0.004 0.01" pos="0 0 -0.01" contype="0" conaffinity="0"/>)";
  text.numbers.erase("feeler_tolerance_lateral");
  text.numbers.erase("feeler_tolerance_angle");
  const Tolerance tolerance = Load(text).task.tolerance;
  EXPECT_NEAR(tolerance.Lateral(1), 0.0002, 2e-6);
  EXPECT_GT(tolerance.Lateral(0), 0.01);
  EXPECT_EQ(tolerance.Angle(1), 0.05);
}

TEST(Tolerances, NumbersOfAFileAreThoseOfItsAxes) {
  TaskText text = PegOver(0.0005, 0.0010);
  text.numbers["feeler_tolerance_lateral"] = "0.0004 0.0009";
  text.numbers["feeler_tolerance_angle"] = "0.01 0.02 0.03";
  const Task task = Load(text).task;
  EXPECT_NEAR(task.tolerance.Lateral(0), 0.0004, 1e-12);
  EXPECT_NEAR(task.tolerance.Lateral(1), 0.0009, 1e-12);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(task.tolerance.Angle(axis), 0.01 * (axis + 1), 1e-12);

  // Judged by axis where nothing guides.
  const InsertionLimits limits = LimitsOf(task);
  EXPECT_TRUE(limits.InsideOpening(task, {0.0003, 0.0008, -0.01}));
  EXPECT_FALSE(limits.InsideOpening(task, {0.0008, 0.0003, -0.01}));

  // So is a localization.
  const Pose truth = MakePose({0.6, 0.1, 0.2}, 0.4);
  const auto localized = [&](const Pose& off) {
    return execution::WithinTolerance(task.tolerance, execution::PoseErrorOf(task, truth, truth * off));
  };
  EXPECT_TRUE(localized(MakePose({0.0003, -0.0008, 0.0})));
  EXPECT_FALSE(localized(MakePose({-0.0008, 0.0003, 0.0})));
  EXPECT_TRUE(localized(MakePose({0.0, 0.0, 0.0}, 0.029)));
  EXPECT_FALSE(localized(MakePose({0.0, 0.0, 0.0}, 0.031)));
  const auto turned = [](double angle_rad, const Eigen::Vector3d& axis) {
    return MakePose({0.0, 0.0, 0.0}, Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis)));
  };
  EXPECT_FALSE(localized(turned(0.011, Eigen::Vector3d::UnitX())));
  EXPECT_TRUE(localized(turned(0.011, Eigen::Vector3d::UnitY())));
}

TEST(Tolerances, GoalSetsGoByAxis) {
  TaskText text = PegOver(0.0012, 0.0032);
  text.numbers["feeler_tolerance_lateral"] = "0.001 0.003";
  const TaskModel model = Load(text);
  const auto map = std::make_shared<const planner::ContactMap>(BuildContactMap(model, Opening::kClosed));
  const planner::Problem problem = planner::MakeCuboidProblem(model.task, map, {2, 2, 2});
  EXPECT_EQ(problem.insertable_spread[0], 0);  // 2 mm cells: 2 * 1 / 2 - 1
  EXPECT_EQ(problem.insertable_spread[1], 2);  // 2 * 3 / 2 - 1
}

TEST(Tolerances, ANumberForAllIsOnePerAxis) {
  TaskText text = PegOver(0.001, 0.002);
  const std::string one = Fingerprint(Load(text), Opening::kClosed);
  text.numbers["feeler_tolerance_lateral"] = "0.0005 0.0005";
  text.numbers["feeler_tolerance_angle"] = "0.03 0.03 0.03";
  EXPECT_EQ(Fingerprint(Load(text), Opening::kClosed), one);
  text.numbers["feeler_tolerance_lateral"] = "0.0005 0.0006";
  const std::string other = Fingerprint(Load(text), Opening::kClosed);
  EXPECT_NE(other, one);
  text.numbers["feeler_tolerance_angle"] = "0.03 0.04 0.03";
  EXPECT_NE(Fingerprint(Load(text), Opening::kClosed), other);
}

TEST(Tolerances, TooMuchForOneAxisNamesWhatEachAllows) {
  TaskText text = PegOver(0.0005, 0.001);
  text.numbers["feeler_tolerance_lateral"] = "0.0006 0.0009";
  try {
    Load(text);
    FAIL() << "was read";
  } catch (const std::exception& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("0.0006 and 0.0009 m along its two axes"), std::string::npos) << message;
    EXPECT_NE(message.find("per axis \"0.0005 0.001\""), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace feeler::env
