// Visual servoing. Oracles: finite differences of the projection for the interaction matrix; a drawn picture of a known
// rectangle for its corners; a synthetic camera that looks at a textured plane, moved as the law says. Laws: the loop
// converges from any offset in range and ends at the goal; same pictures, same decisions; where features are lost or
// mislead the policy ends with a reason, never runs on; an empty goal or bad options are refused.

#include "feeler/policies/visual/visual_servoing.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "feeler/core/error.h"
#include "feeler/core/random.h"

namespace feeler::policies {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal = 300.0;
constexpr double kGoalDepth_m = 0.15;

// A camera over the plane z = 0 looking straight down on it from `eye` (x right and y down are the plane's x and y).
// `color` of the plane at a point, in 0..1 for red, green, blue.
using Paint = std::function<Eigen::Vector3d(double x, double y)>;

CameraView Draw(const Paint& paint, const Eigen::Vector3d& eye) {
  CameraView view;
  view.width = kWidth;
  view.height = kHeight;
  view.fx = view.fy = kFocal;
  view.cx = 0.5 * (kWidth - 1);
  view.cy = 0.5 * (kHeight - 1);
  constexpr int kSub = 2;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int i = 0; i < kSub * kSub; ++i) {
        const double u = column - 0.5 + (i % kSub + 0.5) / kSub;
        const double v = row - 0.5 + (i / kSub + 0.5) / kSub;
        sum += paint(eye.x() + (u - view.cx) / kFocal * eye.z(), eye.y() + (v - view.cy) / kFocal * eye.z());
      }
      for (const double value : sum)
        view.rgb.push_back(static_cast<std::uint8_t>(std::lround(255.0 * value / (kSub * kSub))));
    }
  }
  return view;
}

Eigen::Vector3d Tape(double x, double y) {
  const bool inside = std::abs(x) < 0.025 && std::abs(y) < 0.006;
  return inside ? Eigen::Vector3d(0.8, 0.05, 0.05) : Eigen::Vector3d(0.1, 0.1, 0.1);
}

constexpr int kCells = 1200;
constexpr double kCell_m = 0.0002;

// Spots of many sizes and greys at random places, 0.24 m wide.
Eigen::Vector3d Spots(double x, double y) {
  static const auto grid = [] {
    RandomStream random(1, 0, "spots");
    std::vector<float> greys(kCells * kCells, 0.5F);
    for (int spot = 0; spot < 300; ++spot) {
      const int radius = 5 + static_cast<int>(random.Index(20));
      const int cx = static_cast<int>(random.Index(kCells));
      const int cy = static_cast<int>(random.Index(kCells));
      const auto shade = static_cast<float>(random.Uniform());
      for (int row = std::max(0, cy - radius); row < std::min(kCells, cy + radius); ++row) {
        for (int column = std::max(0, cx - radius); column < std::min(kCells, cx + radius); ++column) {
          if (std::hypot(row - cy, column - cx) < radius)
            greys[static_cast<std::size_t>(row * kCells + column)] = shade;
        }
      }
    }
    return greys;
  }();
  const int column = std::clamp(static_cast<int>(x / kCell_m) + kCells / 2, 0, kCells - 1);
  const int row = std::clamp(static_cast<int>(y / kCell_m) + kCells / 2, 0, kCells - 1);
  return Eigen::Vector3d::Constant(static_cast<double>(grid[static_cast<std::size_t>(row * kCells + column)]));
}

Eigen::Vector3d Black(double /*x*/, double /*y*/) { return Eigen::Vector3d::Constant(0.03); }

std::shared_ptr<const VisualGoal> GoalOf(const Paint& paint) {
  auto goal = std::make_shared<VisualGoal>();
  goal->view = Draw(paint, {0.0, 0.0, kGoalDepth_m});
  goal->depth_m.assign(kWidth * kHeight, static_cast<float>(kGoalDepth_m));
  goal->hidden.assign(kWidth * kHeight, 0);
  return goal;
}

// Turns velocities into displacements of the eye until the policy ends. The eye looks along -z of the plane.
struct Course {
  Decision end;
  Eigen::Vector3d eye;
  int pictures = 0;
};
Course Serve(VisualServoingPolicy& policy, const Paint& paint, Eigen::Vector3d eye) {
  const planner::Problem problem;
  policy.Begin(problem);
  Course run;
  for (run.pictures = 0; run.pictures < 1000; ++run.pictures) {
    const Decision decision = policy.Next({});
    const auto* servo = std::get_if<Servo>(&decision);
    if (servo == nullptr) {
      run.end = decision;
      break;
    }
    const Eigen::Vector3d moved = servo->motion.linear_m_s * servo->motion.duration_s;
    eye += Eigen::Vector3d(moved.x(), moved.y(), -moved.z());
    policy.See(Draw(paint, eye));
  }
  run.eye = eye;
  return run;
}

TEST(Interaction, IsTheDerivativeOfTheProjection) {
  RandomStream random(3, 0, "points");
  for (int sample = 0; sample < 100; ++sample) {
    const Eigen::Vector3d point(random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2), random.Uniform(0.1, 0.6));
    const auto project = [](const Eigen::Vector3d& p) { return Eigen::Vector2d(p.x() / p.z(), p.y() / p.z()); };
    const Eigen::Matrix<double, 2, 6> interaction = PointInteraction(project(point), point.z());
    constexpr double kStep = 1e-6;
    for (int i = 0; i < 6; ++i) {
      const auto after = [&](double step) {  // the resting point in the moved camera
        Pose moved = Pose::Identity();
        if (i < 3) moved.translation() = step * Eigen::Vector3d::Unit(i);
        if (i >= 3) moved.linear() = Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(i - 3)).toRotationMatrix();
        return project(moved.inverse() * point);
      };
      const Eigen::Vector2d numeric = (after(kStep) - after(-kStep)) / (2.0 * kStep);
      EXPECT_LT((numeric - interaction.col(i)).norm(), 1e-6 * (1.0 + numeric.norm())) << "column " << i;
    }
  }
}

TEST(ServoLaw, ConvergesFromRandomPosesOnExactProjections) {
  RandomStream random(4, 0, "offsets");
  const std::vector<Eigen::Vector3d> world = {
      {0.03, 0.02, 0.0}, {-0.03, 0.02, 0.01}, {-0.03, -0.02, 0.0}, {0.03, -0.02, 0.0}, {0.0, 0.0, 0.02}};
  for (const ServoFreedom freedom : {ServoFreedom::kTranslation, ServoFreedom::kAll}) {
    for (int sample = 0; sample < 50; ++sample) {
      Pose goal = Pose::Identity();
      goal.translation().z() = -0.2;
      Pose camera = goal;
      for (double& value : camera.translation()) value += random.Uniform(-0.03, 0.03);
      if (freedom == ServoFreedom::kAll) {
        Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
        camera.linear() = Eigen::AngleAxisd(random.Uniform(0.0, 0.3), axis.normalized()).toRotationMatrix();
      }
      const auto project = [](const Eigen::Vector3d& p) { return Eigen::Vector2d(p.x() / p.z(), p.y() / p.z()); };
      for (int step = 0; step < 200; ++step) {
        std::vector<ServoPoint> points;
        for (const Eigen::Vector3d& p : world) {
          points.push_back({project(camera.inverse() * p), project(goal.inverse() * p), (goal.inverse() * p).z()});
        }
        const CameraTwist twist = 0.13 * ServoStep(points, freedom);
        Pose moved = Pose::Identity();
        moved.translation() = twist.head<3>();
        if (twist.tail<3>().norm() > 0)
          moved.linear() = Eigen::AngleAxisd(twist.tail<3>().norm(), twist.tail<3>().normalized()).toRotationMatrix();
        camera = camera * moved;
      }
      EXPECT_LT((goal.inverse() * camera).translation().norm(), 1e-6);
      EXPECT_LT(Eigen::AngleAxisd((goal.inverse() * camera).linear()).angle(), 1e-5);
    }
  }
}

TEST(ServoLaw, SaysNothingWherePointsDoNotTell) {
  EXPECT_TRUE(ServoStep({}, ServoFreedom::kTranslation).isZero());
  EXPECT_TRUE(ServoStep({{{0.1, 0.0}, {0.0, 0.0}, 0.2}}, ServoFreedom::kTranslation).isZero());
  const ServoPoint same{{0.1, 0.1}, {0.0, 0.0}, 0.2};
  EXPECT_TRUE(ServoStep({same, same, same, same}, ServoFreedom::kTranslation).isZero()) << "no scale in one point";
}

TEST(TapeCorners, AreFoundToAFractionOfAPixel) {
  RandomStream random(5, 0, "eyes");
  for (int sample = 0; sample < 20; ++sample) {
    const Eigen::Vector3d eye(random.Uniform(-0.02, 0.02), random.Uniform(-0.02, 0.02), random.Uniform(0.12, 0.22));
    const CameraView view = Draw(Tape, eye);
    const TapeCorners found = FindTapeCorners(view);
    ASSERT_EQ(found.corners_px.size(), 4U) << found.lost;
    const std::array<std::array<double, 2>, 4> truth = {
        {{-0.025, -0.006}, {0.025, -0.006}, {0.025, 0.006}, {-0.025, 0.006}}};
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d expected(view.cx + kFocal * (truth[i][0] - eye.x()) / eye.z(),
                                     view.cy + kFocal * (truth[i][1] - eye.y()) / eye.z());
      EXPECT_LT((found.corners_px[i] - expected).norm(), 0.4) << "corner " << i;
    }
  }
}

TEST(TapeCorners, SayWhyThereAreNone) {
  EXPECT_EQ(FindTapeCorners(Draw(Black, {0, 0, 0.15})).lost, "no red tape in the picture");
  EXPECT_EQ(FindTapeCorners(Draw(Tape, {0.08, 0, 0.15})).lost, "the red tape leaves the picture");
  const Paint bent = [](double x, double y) { return x > 0.0 && y > 0.0 ? Black(x, y) : Tape(x, y); };
  EXPECT_EQ(FindTapeCorners(Draw(bent, {0, 0, 0.15})).lost, "the red tape is partly hidden");
}

TEST(VisualServoing, ConvergesWithTape) {
  const auto goal = GoalOf(Tape);
  // A pixel of this camera is half a millimetre and the tape is 24 of them high: depth is known to some 0.2 mm.
  VisualServoingOptions options;
  options.reached_m = 5e-4;
  VisualServoingPolicy policy("tape", goal, MakeTapeTracker(goal), options);
  RandomStream random(6, 0, "starts");
  for (int sample = 0; sample < 3; ++sample) {
    const Eigen::Vector3d start(random.Uniform(-0.02, 0.02), random.Uniform(-0.02, 0.02), random.Uniform(0.15, 0.2));
    const Course run = Serve(policy, Tape, start);
    const auto* insert = std::get_if<Insert>(&run.end);
    ASSERT_NE(insert, nullptr) << (std::holds_alternative<GiveUp>(run.end) ? std::get<GiveUp>(run.end).reason
                                                                           : "went on");
    EXPECT_FALSE(insert->confirm);
    EXPECT_TRUE(insert->tool_T_target.has_value());
    EXPECT_LT((run.eye - Eigen::Vector3d(0, 0, kGoalDepth_m)).norm(), 1e-3);
    EXPECT_LT(run.pictures, 100);
  }
}

TEST(VisualServoing, ConvergesWithSiftOnATextureAndRepeats) {
  const auto goal = GoalOf(Spots);
  const Eigen::Vector3d start(0.012, -0.015, 0.18);
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (int time = 0; time < 2; ++time) {
    VisualServoingPolicy policy("sift", goal, MakeSiftTracker(goal));
    const Course run = Serve(policy, Spots, start);
    ASSERT_TRUE(std::holds_alternative<Insert>(run.end))
        << (std::holds_alternative<GiveUp>(run.end) ? std::get<GiveUp>(run.end).reason : "?");
    EXPECT_LT((run.eye - Eigen::Vector3d(0, 0, kGoalDepth_m)).norm(), 4e-4);
    if (time == 0) first = run.eye;
    EXPECT_EQ(run.eye, first);
  }
}

TEST(VisualServoing, EndsWithAReasonWhereFeaturesAreLostOrMislead) {
  const auto reason = [](const Course& run) {
    return std::holds_alternative<GiveUp>(run.end) ? std::get<GiveUp>(run.end).reason : "went on";
  };
  const auto spots = GoalOf(Spots);
  VisualServoingPolicy sift("sift", spots, MakeSiftTracker(spots));
  const Course dark = Serve(sift, Black, {0, 0, 0.15});
  EXPECT_EQ(reason(dark).rfind("features lost: 0 SIFT features", 0), 0U) << reason(dark);
  EXPECT_EQ(dark.pictures, VisualServoingOptions{}.lost_frames);
  const auto black = GoalOf(Black);
  VisualServoingPolicy blind("sift", black, MakeSiftTracker(black));
  EXPECT_EQ(reason(Serve(blind, Spots, {0, 0, 0.15})).rfind("features lost", 0), 0U);

  const auto goal = GoalOf(Tape);
  VisualServoingPolicy tape("tape", goal, MakeTapeTracker(goal));
  EXPECT_EQ(reason(Serve(tape, Black, {0, 0, 0.15})), "features lost: no red tape in the picture");
  // A picture that does not answer to the motion.
  const CameraView frozen = Draw(Tape, {0.01, 0.01, 0.18});
  const planner::Problem problem;
  tape.Begin(problem);
  int pictures = 0;
  while (std::holds_alternative<Servo>(tape.Next({})) && pictures < 2000) {
    tape.See(frozen);
    ++pictures;
  }
  const Decision end = tape.Next({});
  ASSERT_TRUE(std::holds_alternative<GiveUp>(end));
  EXPECT_EQ(std::get<GiveUp>(end).reason.rfind("led astray", 0), 0U) << std::get<GiveUp>(end).reason;
  tape.Begin(problem);
  EXPECT_TRUE(std::holds_alternative<Servo>(tape.Next({}))) << "Begin erases the past";
  tape.See({});
  ASSERT_TRUE(std::holds_alternative<GiveUp>(tape.Next({})));
  EXPECT_EQ(std::get<GiveUp>(tape.Next({})).reason, "the robot has no camera");
}

TEST(VisualServoing, RefusesBadOptionsAndGoals) {
  const auto goal = GoalOf(Tape);
  VisualServoingOptions options;
  options.gain_per_s = 100.0;
  EXPECT_THROW(VisualServoingPolicy("tape", goal, MakeTapeTracker(goal), options), InputError);
  options = {};
  options.reached_m = 0.0;
  EXPECT_THROW(VisualServoingPolicy("tape", goal, MakeTapeTracker(goal), options), InputError);
  EXPECT_THROW(MakeTapeTracker(std::make_shared<VisualGoal>()), InputError);
  EXPECT_THROW(MakeSiftTracker(std::make_shared<VisualGoal>()), InputError);
}

}  // namespace
}  // namespace feeler::policies
