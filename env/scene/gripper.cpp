#include "feeler/env/scene/gripper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "feeler/env/model/mujoco_handles.h"

namespace feeler::env {
namespace {

using tinyxml2::XMLElement;

constexpr double kGripDepth_m = 0.016;     // how far the fingers overlap the tool, at most
constexpr double kPadThickness_m = 0.002;  // soft pad between finger and tool
constexpr double kFingerThickness_m = 0.007;
constexpr double kAdapter_m = 0.012;     // length of the adapter plate on the flange
constexpr double kPalm_m = 0.095;        // where the palm ends, if the tool leaves room
constexpr double kFingerRoom_m = 0.025;  // least length of finger between palm and tool
constexpr double kShortestPalm_m = 0.02;
constexpr double kLeastFinger_m = 0.005;   // between palm and tool: less is no finger
constexpr double kLongestFinger_m = 0.08;  // more is none that anyone sells for such parts
constexpr double kGripper_kg = 0.9;
constexpr double kPayload_kg = 12.5;  // Universal Robots, UR10e data sheet

// What is round about the approach axis may be gripped from any side.
bool IsRoundGrip(const mjModel& model, const mjData& data, int geom, const Pose& flange_T_world) {
  if (model.geom_type[geom] != mjGEOM_CYLINDER && model.geom_type[geom] != mjGEOM_CAPSULE) return false;
  const mjtNum* matrix = data.geom_xmat + 9 * geom;
  const Eigen::Vector3d axis = flange_T_world.linear() * Eigen::Vector3d(matrix[2], matrix[5], matrix[8]);
  const Eigen::Vector3d centre = flange_T_world * Eigen::Map<const Eigen::Vector3d>(data.geom_xpos + 3 * geom);
  return std::abs(axis.z()) > 1.0 - 1e-9 && centre.head<2>().norm() < 1e-6;
}

// The corners of a box around a geom, or the vertices of its mesh, in world axes.
std::vector<Eigen::Vector3d> Extremes(const mjModel& model, const mjData& data, int geom) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.geom_xmat + 9 * geom);
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(data.geom_xpos + 3 * geom);
  std::vector<Eigen::Vector3d> points;
  const mjtNum* size = model.geom_size + 3 * geom;
  Eigen::Vector3d half(size[0], size[1], size[2]);
  switch (model.geom_type[geom]) {
    case mjGEOM_MESH: {
      const int mesh = model.geom_dataid[geom];
      const float* vertices = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
      for (int i = 0; i < model.mesh_vertnum[mesh]; ++i) {
        points.push_back(pose * Eigen::Vector3d(vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]));
      }
      return points;
    }
    case mjGEOM_SPHERE: half = Eigen::Vector3d::Constant(size[0]); break;
    case mjGEOM_CAPSULE: half = {size[0], size[0], size[0] + size[1]}; break;
    case mjGEOM_CYLINDER: half = {size[0], size[0], size[1]}; break;
    default: break;
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
    points.push_back(pose * Eigen::Vector3d(sign.cwiseProduct(half)));
  }
  return points;
}

XMLElement& Geom(XMLElement& body, const char* type, const Pose& pose, const Eigen::VectorXd& size, double mass_kg) {
  XMLElement& geom = *body.InsertNewChildElement("geom");
  geom.SetAttribute("type", type);
  geom.SetAttribute("pos", MjcfVector(pose.translation()).c_str());
  geom.SetAttribute("quat", MjcfQuaternion(pose.linear()).c_str());
  geom.SetAttribute("size", MjcfVector(size).c_str());
  geom.SetAttribute("mass", mass_kg);
  return geom;
}

}  // namespace

GripperFit FitGripper(const mjModel& task_model, const std::vector<int>& tool_geoms, int tool_body,
                      const Pose& flange_T_tool) {
  GripperFit fit;
  const Eigen::Vector3d tool_x = flange_T_tool.linear().col(0);
  const Eigen::Vector3d tool_y = flange_T_tool.linear().col(1);
  const Eigen::Vector3d closing = std::abs(tool_x.z()) < 0.9 ? tool_x : tool_y;
  fit.closing_axis = Eigen::Vector3d(closing.x(), closing.y(), 0.0).normalized();
  const DataHandle data = MakeData(task_model);
  mj_kinematics(&task_model, data.get());
  const Pose flange_T_world = flange_T_tool * BodyPose(*data, tool_body).inverse();

  struct Extent {
    int geom = -1;
    double begin = std::numeric_limits<double>::infinity();
    double end = -std::numeric_limits<double>::infinity();
    double half = 0.0;
  };
  std::vector<Extent> extents;
  double begin = std::numeric_limits<double>::infinity();
  double end = -begin;
  for (const int geom : tool_geoms) {
    Extent extent;
    extent.geom = geom;
    for (const Eigen::Vector3d& point : Extremes(task_model, *data, geom)) {
      const Eigen::Vector3d p = flange_T_world * point;
      extent.begin = std::min(extent.begin, p.z());
      extent.end = std::max(extent.end, p.z());
      extent.half = std::max(extent.half, std::abs(p.dot(fit.closing_axis)));
    }
    begin = std::min(begin, extent.begin);
    end = std::max(end, extent.end);
    extents.push_back(extent);
  }
  if (extents.empty()) return fit;
  fit.grip_begin_m = begin;
  fit.grip_end_m = begin + std::min(kGripDepth_m, 0.4 * (end - begin));
  fit.half_opening_m = 0.002;
  bool round = true;
  for (const Extent& extent : extents) {
    if (extent.begin >= fit.grip_end_m) continue;
    fit.half_opening_m = std::max(fit.half_opening_m, extent.half);
    round = round && IsRoundGrip(task_model, *data, extent.geom, flange_T_world);
  }
  if (round) {
    // However the tool is turned in it, the gripper sits on the flange in one way.
    fit.closing_axis = Eigen::Vector3d::UnitX();
    fit.half_opening_m = 0.002;
    for (const Extent& extent : extents) {
      if (extent.begin >= fit.grip_end_m) continue;
      fit.half_opening_m = std::max(fit.half_opening_m, task_model.geom_size[3 * extent.geom]);
    }
  }
  return fit;
}

double PalmEnd(const GripperFit& fit) { return std::clamp(fit.grip_begin_m - kFingerRoom_m, kShortestPalm_m, kPalm_m); }

TaskFindings HoldFindings(const GripperFit& fit, const Task& task, double tool_mass_kg, const std::string& where) {
  TaskFindings findings;
  const auto numeric = [&](const char* field) {
    return fmt::format("{}: <custom><numeric name=\"{}\">", where, field);
  };
  const double z_m = task.flange_T_tool.translation().z();
  const std::string better =
      fmt::format("with z = {:.3g} m in feeler_flange_position the fingers have their usual length",
                  z_m + kPalm_m + kFingerRoom_m - fit.grip_begin_m);
  const double fingers_m = fit.grip_begin_m - PalmEnd(fit);
  if (fingers_m < kLeastFinger_m) {
    findings.push_back(
        {TaskFinding::Severity::kError, "fingers", numeric("feeler_flange_position"),
         fmt::format("the tool, {:.0f} mm long beyond its origin, is held {:.0f} mm from the flange: its end "
                     "stands {:.0f} mm in the palm of the gripper, which ends {:.0f} mm from it",
                     (z_m - fit.grip_begin_m) * 1000, z_m * 1000, (PalmEnd(fit) - fit.grip_begin_m) * 1000,
                     PalmEnd(fit) * 1000),
         better});
  } else if (fingers_m > kLongestFinger_m) {
    findings.push_back(
        {TaskFinding::Severity::kWarning, "fingers", numeric("feeler_flange_position"),
         fmt::format("the end of the tool is {:.0f} mm from the flange: the fingers are stretched to {:.0f} "
                     "mm between palm and tool",
                     fit.grip_begin_m * 1000, fingers_m * 1000),
         better});
  }
  const double ahead = (task.flange_T_tool.linear() * UnitVector(task.insertion)).z();
  if (ahead < -0.5) {
    findings.push_back(
        {TaskFinding::Severity::kError, "upside-down", numeric("feeler_flange_quaternion"),
         fmt::format("holds the tool upside down: it is inserted along {} of its frame, which points back "
                     "to the flange",
                     ToString(task.insertion)),
         task.insertion == Direction::kMinusZ ? "0 1 0 0 turns the tool's -z away from the flange"
                                              : "turn the tool's direction of insertion away from it"});
  }
  if (tool_mass_kg + kGripper_kg > kPayload_kg) {
    findings.push_back({TaskFinding::Severity::kError, "payload", fmt::format("{}: <body name=\"tool\">", where),
                        fmt::format("weighs {:.3g} kg, with the gripper {:.3g} kg: the payload of the UR10e is {} kg",
                                    tool_mass_kg, tool_mass_kg + kGripper_kg, kPayload_kg),
                        "give its geoms a mass (without one MuJoCo takes the density of water), or a lighter part"});
  }
  return findings;
}

void EmitGripper(const GripperFit& fit, int visual_group, int collision_group, XMLElement& flange_body) {
  XMLElement& body = *flange_body.InsertNewChildElement("body");
  body.SetAttribute("name", "gripper");
  body.SetAttribute("pos", "0 0 0");
  Eigen::Matrix3d axes;
  axes.col(0) = fit.closing_axis;
  axes.col(2) = Eigen::Vector3d::UnitZ();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  body.SetAttribute("quat", MjcfQuaternion(axes).c_str());

  const auto add = [&](const char* type, const Eigen::Vector3d& centre, const Eigen::VectorXd& size, double mass_kg,
                       const char* material, bool collides) {
    XMLElement& drawn = Geom(body, type, MakePose(centre), size, mass_kg);
    drawn.SetAttribute("material", material);
    drawn.SetAttribute("group", visual_group);
    drawn.SetAttribute("contype", 0);
    drawn.SetAttribute("conaffinity", 0);
    if (!collides) return;
    XMLElement& felt = Geom(body, type, MakePose(centre), size, 0.0);
    felt.SetAttribute("group", collision_group);
    felt.SetAttribute("contype", 1);
    felt.SetAttribute("conaffinity", 1);
  };

  const double palm_end = PalmEnd(fit);
  const double palm_half = 0.5 * (palm_end - kAdapter_m);
  const double reach = fit.half_opening_m + kPadThickness_m + kFingerThickness_m;  // outside of a finger
  const double palm_half_x = std::max(0.034, reach + 0.006);
  add("cylinder", {0, 0, 0.5 * kAdapter_m}, Eigen::Vector2d(0.0375, 0.5 * kAdapter_m), 0.15, "gripper_metal", false);
  add("box", {0, 0, kAdapter_m + palm_half - 0.004}, Eigen::Vector3d(palm_half_x - 0.006, 0.0235, palm_half - 0.004),
      0.35, "gripper_body", false);
  add("box", {0, 0, kAdapter_m + palm_half}, Eigen::Vector3d(palm_half_x - 0.008, 0.0195, palm_half), 0.1,
      "gripper_body", true);
  // The rail that the fingers slide on.
  add("box", {0, 0, palm_end - 0.007}, Eigen::Vector3d(palm_half_x, 0.013, 0.007), 0.1, "gripper_metal", true);
  for (const double side : {1.0, -1.0}) {
    const double finger_half = 0.5 * (fit.grip_end_m - palm_end);
    const double finger_x = side * (fit.half_opening_m + kPadThickness_m + 0.5 * kFingerThickness_m);
    add("box", {finger_x, 0, palm_end + finger_half},
        Eigen::Vector3d(0.5 * kFingerThickness_m, fit.half_width_m, finger_half), 0.08, "gripper_metal", true);
    add("box", {finger_x, 0, palm_end + 0.004}, Eigen::Vector3d(0.5 * kFingerThickness_m + 0.002, 0.0115, 0.006), 0.01,
        "gripper_body", false);
    const double pad_half = 0.5 * (fit.grip_end_m - fit.grip_begin_m);
    add("box", {side * (fit.half_opening_m + 0.5 * kPadThickness_m), 0, fit.grip_begin_m + pad_half},
        Eigen::Vector3d(0.5 * kPadThickness_m, fit.half_width_m - 0.0005, pad_half), 0.01, "gripper_pad", false);
  }
}

}  // namespace feeler::env
