#pragma once

#include <mujoco/mujoco.h>
#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"
#include "feeler/env/model/task_finding.h"

namespace feeler::env {

/// Where a parallel gripper on the flange meets the tool: everything in the flange frame (z out of the flange).
struct GripperFit {
  double grip_begin_m = 0.13;  ///< z of the end of the tool that faces the flange
  double grip_end_m = 0.146;   ///< z to which the fingers reach
  double half_opening_m = 0.01;
  double half_width_m = 0.008;                              ///< of a finger, across
  Eigen::Vector3d closing_axis = Eigen::Vector3d::UnitX();  ///< unit, perpendicular to z
};

/// Fits the gripper to the tool's collision geoms: the fingers close along the tool's x axis (or y, where x points
/// along the flange axis) and take the rearmost part of the tool between them. `task_model` is a model that contains
/// the tool body, compiled without a robot.
GripperFit FitGripper(const mjModel& task_model, const std::vector<int>& tool_geoms, int tool_body,
                      const Pose& flange_T_tool);

/// Where the palm ends, m from the flange.
double PalmEnd(const GripperFit& fit);

/// Whether arm and gripper can hold the tool so: the tool reaches into the palm, the fingers are stretched, the tool is
/// upside down (its tip between the fingers), gripper and tool are heavier than the payload of the arm. `where` names
/// the task file.
TaskFindings HoldFindings(const GripperFit& fit, const Task& task, double tool_mass_kg, const std::string& where);

/// Emits the gripper as a body named `gripper` under `flange_body`: adapter, palm, two fingers with pads; visual and
/// collision shapes, 0.9 kg in all. `visual_group` and `collision_group` as for the robot.
void EmitGripper(const GripperFit& fit, int visual_group, int collision_group, tinyxml2::XMLElement& flange_body);

}  // namespace feeler::env
