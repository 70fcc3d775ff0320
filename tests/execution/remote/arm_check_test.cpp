// Ways that an arm cannot make are told before they are sent. Oracle: where the UR10e is singular in closed form
// (wrist: sin q5 = 0, elbow: sin q3 = 0) and how long it is. Laws: a way within reach and limits, away from those
// places, has no fault; one that leads through them, out of reach, or past a limit has one that says which; the speed
// of the joints bounds that of the tool near a singularity; joints and tool that do not fit the description are
// noticed.

#include "feeler/execution/remote/arm_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <regex>
#include <sstream>

#include "feeler/core/data_folder.h"

namespace feeler::execution {
namespace {

using planner::SerialArm;
using testing::HasSubstr;

const std::vector<double> kReady_rad = {0.2, -1.6, 1.8, -1.8, -1.57, 0.1};

std::string DescriptionText() {
  std::ifstream file(FindData("models") / "robots" / "ur10e.urdf");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

SerialArm ArmOf(const std::string& text) {
  const std::string path = testing::TempDir() + "/arm_check.urdf";
  std::ofstream(path) << text;
  return SerialArm::FromUrdf(path);
}

const SerialArm& Ur10e() {
  static const SerialArm arm = ArmOf(DescriptionText());
  return arm;
}

Eigen::VectorXd Vector(const std::vector<double>& q) {
  return Eigen::Map<const Eigen::VectorXd>(q.data(), static_cast<Eigen::Index>(q.size()));
}

const Pose kLast_T_tool = MakePose(Eigen::Vector3d(0.01, 0.02, 0.18), 0.4);

Pose ToolAt(const std::vector<double>& q) { return Ur10e().ForwardKinematics(Vector(q)) * kLast_T_tool; }

Pose Shifted(Pose pose, const Eigen::Vector3d& by_m) {
  pose.translation() += by_m;
  return pose;
}

std::string Fault(const std::vector<double>& q, const Eigen::Vector3d& by_m, double speed_m_s = 0.05) {
  ArmCheck check(Ur10e());
  const Pose from = ToolAt(q);
  return check.FaultOf(q, {from, {Shifted(from, by_m)}, speed_m_s, true});
}

TEST(ArmCheck, AWayWithinReachHasNoFault) {
  for (const Eigen::Vector3d& way : {Eigen::Vector3d(0.0, 0.0, -0.1), Eigen::Vector3d(0.08, -0.05, 0.0)}) {
    EXPECT_EQ(Fault(kReady_rad, way), "");
  }
  ArmCheck check(Ur10e());
  const Pose from = ToolAt(kReady_rad);
  EXPECT_EQ(check.FaultOf(kReady_rad, {from, {Shifted(from, {0.1, 0.2, 0.1})}, 0.0, false}), "");
}

TEST(ArmCheck, OutOfReachIsToldWithItsPlace) {
  EXPECT_THAT(Fault(kReady_rad, Eigen::Vector3d(1.5, 0.0, 0.0)), HasSubstr("cannot go straight"));
  ArmCheck check(Ur10e());
  const Pose from = ToolAt(kReady_rad);
  EXPECT_THAT(check.FaultOf(kReady_rad, {from, {Shifted(from, {2.0, 0.0, 0.0})}, 0.0, false}),
              HasSubstr("out of reach"));
}

TEST(ArmCheck, TheWristSingularityIsNotPassed) {
  // The way between two places whose joints differ in the sign of q5 alone leads through q5 = 0.
  std::vector<double> here = kReady_rad;
  here[4] = 0.3;
  std::vector<double> there = here;
  there[4] = -0.3;
  ArmCheck check(Ur10e());
  EXPECT_NE(check.FaultOf(here, {ToolAt(here), {ToolAt(there)}, 0.05, true}), "");
  // At rest on it nothing can be done but to leave it by the joints.
  std::vector<double> singular = kReady_rad;
  singular[4] = 0.0;
  EXPECT_NE(Fault(singular, Eigen::Vector3d(0.0, 0.0, -0.01)), "");
}

TEST(ArmCheck, TheArmIsNotStretched) {
  std::vector<double> bent = kReady_rad;
  bent[2] = 0.15;  // of the elbow: some millimetres before it is straight
  const Pose from = ToolAt(bent);
  const Eigen::Vector3d outward = Eigen::Vector3d(from.translation().x(), from.translation().y(), 0.0).normalized();
  EXPECT_NE(Fault(bent, 0.1 * outward, 0.25), "");
}

TEST(ArmCheck, JointsThatCannotFollowAreNamed) {
  std::vector<double> near = kReady_rad;
  near[4] = 0.06;
  EXPECT_THAT(Fault(near, Eigen::Vector3d(0.0, 0.0, -0.002), 0.25), HasSubstr("near a singularity"));
  near[4] = 0.5;
  EXPECT_EQ(Fault(near, Eigen::Vector3d(0.0, 0.0, -0.002), 0.25), "");
}

TEST(ArmCheck, LimitsOfJointsCount) {
  const std::string narrow = std::regex_replace(
      DescriptionText(), std::regex("(elbow_joint\"[\\s\\S]*?<limit lower=\")[^\"]*(\" upper=\")[^\"]*"),
      "$011.5$021.9");
  ArmCheck check(ArmOf(narrow));
  const Pose from = ToolAt(kReady_rad);
  EXPECT_EQ(check.FaultOf(kReady_rad, {from, {Shifted(from, {0.0, 0.0, 0.01})}, 0.05, true}), "");
  EXPECT_THAT(check.FaultOf(kReady_rad, {from, {Shifted(from, {0.35, 0.0, 0.0})}, 0.05, true}),
              HasSubstr("elbow_joint would be at"));
}

TEST(ArmCheck, AnotherArmIsNoticed) {
  const std::string longer = std::regex_replace(DescriptionText(), std::regex("-0\\.6127"), "-0.6427");
  ASSERT_NE(longer, DescriptionText());
  ArmCheck check(ArmOf(longer));
  const Pose from = ToolAt(kReady_rad);
  EXPECT_EQ(check.FaultOf(kReady_rad, {from, {Shifted(from, {0.0, 0.0, 0.01})}, 0.05, true}), "");
  std::vector<double> elsewhere = kReady_rad;
  elsewhere[0] += 0.8;
  elsewhere[2] -= 0.6;  // what is wrong before the elbow shows when the elbow bends
  EXPECT_THAT(check.FaultOf(elsewhere, {ToolAt(elsewhere), {ToolAt(elsewhere)}, 0.05, true}), HasSubstr("disagree"));
  EXPECT_THAT(check.FaultOf({0.0, 1.0}, {from, {from}, 0.05, true}), HasSubstr("tells of 2 joints"));
  ArmCheck untold(Ur10e());
  EXPECT_THAT(untold.FaultOf({}, {from, {from}, 0.05, true}), HasSubstr("does not tell"));
}

TEST(ArmCheck, ADryRunIsFollowed) {
  ArmCheck check(Ur10e());
  Pose here = ToolAt(kReady_rad);
  EXPECT_EQ(check.FaultOf(kReady_rad, {here, {Shifted(here, {0.0, 0.0, -0.1})}, 0.05, true}), "");
  here = Shifted(here, {0.0, 0.0, -0.04});  // a contact on the way
  EXPECT_EQ(check.FaultOf({}, {here, {Shifted(here, {0.03, 0.0, 0.0})}, 0.05, true}), "");
}

}  // namespace
}  // namespace feeler::execution
