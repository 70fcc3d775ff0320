// Laws: `feeler perceive` finds the target in files that hold it, at the pose it was put (oracle: the pose that made
// the files), the same for every kind of file; what cannot be read or does not fit together ends with 2 and one line,
// what holds no target with 1 and the reason. Files are written here from the surface of the task's own model.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/vision/target_points.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/uncertainty_table.h"
#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

const Eigen::Vector3d kEye(1.45, -0.5, 1.2);
const Pose kTruth = MakePose(Eigen::Vector3d(0.6, 0.1, 0.25), 0.15);

/// The plug's target, seen from kEye.
std::vector<Eigen::Vector3d> Scene() {
  const env::TargetPoints surface = env::SampleTargetSurface(env::LoadTask("plug"), 0.0025);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < surface.points_m.size(); ++i) {
    const Eigen::Vector3d p = kTruth * surface.points_m[i];
    if ((kEye - p).dot(kTruth.linear() * surface.normals[i]) > 0.0) points.push_back(p);
  }
  return points;
}

std::string Ply(const std::vector<Eigen::Vector3d>& points, double unit) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
      points.size());
  for (const Eigen::Vector3d& p : points) text += fmt::format("{} {} {}\n", unit * p.x(), unit * p.y(), unit * p.z());
  return text;
}

perception::CameraIntrinsics Camera() {
  perception::CameraIntrinsics camera;
  camera.width = 320;
  camera.height = 288;
  camera.fx = camera.fy = 226.0;
  camera.cx = 159.5;
  camera.cy = 143.5;
  const Eigen::Vector3d ahead = (Eigen::Vector3d(0.6, 0.05, 0.2) - kEye).normalized();
  camera.world_T_camera.translation() = kEye;
  camera.world_T_camera.linear().col(0) = ahead.cross(Eigen::Vector3d::UnitZ()).normalized();
  camera.world_T_camera.linear().col(1) = ahead.cross(camera.world_T_camera.linear().col(0));
  camera.world_T_camera.linear().col(2) = ahead;
  return camera;
}

std::string DepthPng(const std::vector<Eigen::Vector3d>& points, const perception::CameraIntrinsics& camera) {
  perception::DepthFrame frame{
      camera.width, camera.height,
      std::vector<float>(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0.0F)};
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = camera.world_T_camera.inverse() * point;
    const auto u = static_cast<int>(std::lround(camera.fx * p.x() / p.z() + camera.cx));
    const auto v = static_cast<int>(std::lround(camera.fy * p.y() / p.z() + camera.cy));
    if (u < 0 || v < 0 || u >= camera.width || v >= camera.height) continue;
    float& depth = frame.depth_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                                 static_cast<std::size_t>(u)];
    if (depth == 0.0F || p.z() < static_cast<double>(depth)) depth = static_cast<float>(p.z());
  }
  return EncodeDepthPng(frame, camera.depth_scale_m);
}

std::string Table(const std::string& fingerprint) {
  perception::UncertaintyTable table;
  table.task = "plug";
  table.fingerprint = fingerprint;
  table.axes = env::LoadTask("plug").task.axes;
  table.camera_m = kEye;
  perception::UncertaintyRule rule;
  rule.farthest_m = 3.0;
  rule.half = Eigen::Vector3d(0.006, 0.005, 0.004);
  table.rules = table.plain_rules = {rule};
  return ToJson(table);
}

class Perceive : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = ScratchFolder("perceive");
    WriteFile(File("table.json"), Table(env::Fingerprint(env::LoadTask("plug"), env::Opening::kClosed)));
    WriteFile(File("camera.json"), ToJson(Camera()));
  }
  std::string File(const std::string& name) const { return folder_ + "/" + name; }
  CommandResult Run(std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"perceive", "--task", "plug", "--table", File("table.json"), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunFeeler(arguments);
  }
  static void ExpectFound(const CommandResult& result, double within_m) {
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(json["estimate"]["position_m"][static_cast<std::size_t>(axis)].get<double>(),
                  kTruth.translation()[axis], within_m);
    }
    EXPECT_EQ(json["extents"], "6x5x4");
    EXPECT_EQ(json["hypotheses"], 120);
  }
  void ExpectRefused(const std::vector<std::string>& more, int code, const std::string& named) const {
    const CommandResult result = Run(more);
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_TRUE(result.err.starts_with("feeler: error: ")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(named), std::string::npos) << result.err;
  }

 private:
  std::string folder_;
};

TEST_F(Perceive, FindsTheTargetInACloud) {
  WriteFile(File("scene.ply"), Ply(Scene(), 1.0));
  ExpectFound(Run({"--cloud", File("scene.ply")}), 0.002);
}

TEST_F(Perceive, FindsTheTargetInADepthImage) {
  WriteFile(File("depth.png"), DepthPng(Scene(), Camera()));
  ExpectFound(Run({"--depth", File("depth.png"), "--intrinsics", File("camera.json")}), 0.004);
}

TEST_F(Perceive, SaysWhatIsWrong) {
  WriteFile(File("millimetres.ply"), Ply(Scene(), 1000.0));
  ExpectRefused({"--cloud", File("millimetres.ply")}, 2, "millimetres");
  WriteFile(File("empty.ply"), Ply({}, 1.0));
  ExpectRefused({"--cloud", File("empty.ply")}, 2, "no point");
  std::string cut = Ply(Scene(), 1.0);
  cut.resize(cut.size() / 2);
  WriteFile(File("cut.ply"), cut);
  ExpectRefused({"--cloud", File("cut.ply")}, 2, "cut");
  WriteFile(
      File("packed.pcd"),
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary_compressed\nabc");
  ExpectRefused({"--cloud", File("packed.pcd")}, 2, "packed.pcd: is cut off");
  ExpectRefused({"--cloud", File("none.ply")}, 2, "none.ply");
  ExpectRefused({}, 2, "--depth");

  perception::CameraIntrinsics other = Camera();
  other.height = 240;
  WriteFile(File("depth.png"), DepthPng(Scene(), Camera()));
  WriteFile(File("other.json"), ToJson(other));
  ExpectRefused({"--depth", File("depth.png"), "--intrinsics", File("other.json")}, 2, "320 x 288");
  ExpectRefused({"--depth", File("depth.png")}, 2, "--intrinsics");
}

TEST_F(Perceive, ShardsThatHaveNoEndAreRefused) {
  const CommandResult result =
      RunFeeler({"perceive", "calibrate", "--task", "plug", "--out", File("t.json"), "--from", "/dev/zero"});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_NE(result.err.find("/dev/zero: cannot be read as a file"), std::string::npos) << result.err;
}

TEST_F(Perceive, NothingThereIsTheAnswerNo) {
  std::vector<Eigen::Vector3d> post;
  for (int i = 0; i < 4000; ++i) post.emplace_back(0.5 + 0.02 * std::cos(i), 0.02 * std::sin(i), 0.05 + 1e-4 * i);
  WriteFile(File("post.ply"), Ply(post, 1.0));
  ExpectRefused({"--cloud", File("post.ply")}, 1, "not found");
  const perception::CameraIntrinsics camera = Camera();
  WriteFile(File("dark.png"), DepthPng({}, camera));
  ExpectRefused({"--depth", File("dark.png"), "--intrinsics", File("camera.json")}, 1, "no points");
}

TEST_F(Perceive, ADepthImageInAnotherUnitIsGuessed) {
  // Units a metre of the picture, read with intrinsics that say millimetres; what the message names.
  const std::pair<double, const char*> units[] = {{5000, "0.0002 (5000 a metre"},
                                                  {4000, "0.00025 (quarters"},
                                                  {10000, "0.0001 (tenths"},
                                                  {100, "0.01 (centimetres)"}};
  for (const auto& [per_metre, named] : units) {
    perception::CameraIntrinsics camera = Camera();
    camera.depth_scale_m = 1.0 / per_metre;
    WriteFile(File("depth.png"), DepthPng(Scene(), camera));
    ExpectRefused({"--depth", File("depth.png"), "--intrinsics", File("camera.json")}, 1, named);
  }
  perception::CameraIntrinsics fine = Camera();
  fine.depth_scale_m = 1e-5;
  WriteFile(File("camera.json"), ToJson(fine));
  WriteFile(File("depth.png"), DepthPng(Scene(), Camera()));
  ExpectRefused({"--depth", File("depth.png"), "--intrinsics", File("camera.json")}, 2, "0.001 (millimetres)");
}

TEST_F(Perceive, TablesOfOtherTasksAndVersionsAreRefused) {
  WriteFile(File("scene.ply"), Ply(Scene(), 1.0));
  WriteFile(File("table.json"), Table("0123"));
  ExpectRefused({"--cloud", File("scene.ply")}, 2, "table of the task");
  std::string newer = Table("0123");
  newer.replace(newer.find("\"version\": 1"), 12, "\"version\": 7");
  WriteFile(File("table.json"), newer);
  ExpectRefused({"--cloud", File("scene.ply")}, 2, "version 7");
  WriteFile(File("table.json"), "{}");
  ExpectRefused({"--cloud", File("scene.ply")}, 2, "not an uncertainty table");
}

}  // namespace
}  // namespace feeler::cli
