#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>

#include "feeler/core/robot.h"
#include "feeler/execution/remote/cell_file.h"

namespace feeler::execution {

/// A block that stands in the cell, its sides along the axes of the base frame, known to better than what is to be
/// found out.
struct KnownBlock {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d max_m = Eigen::Vector3d::Zero();
};

struct CalibrationSettings {
  double clearance_m = 0.01;     ///< above and beside the block between touches
  double reach_m = 0.03;         ///< from a side of the block to the tool reference while the tool stands beside it
  double depth_m = 0.005;        ///< of the tool reference below the top while it touches a side
  double speed_m_s = 0.01;       ///< of touches
  double fast_speed_m_s = 0.03;  ///< of the touches that show how fast the robot reacts
  double way_speed_m_s = 0.1;    ///< between touches
  double contact_force_n = 6.0;  ///< that counts as a touch; what is pressed with for the stiffness follows
  double most_force_n = 250.0;   ///< that the robot takes
  int samples = 20;              ///< of the sensor at rest
  bool sides = true;             ///< touch the four sides, too: the tool centre point across
  std::function<void(const std::string&)> tell;  ///< what is being done, for people; may be empty
};

/// Touches the block with a tool that stands above it, axes parallel to the base frame: sensor bias and noise at rest,
/// the tool centre point (the heights at three places on top; the middles between opposite sides, where the width of
/// the tool cancels), the stiffness of a contact (pressed by small steps: force over depth at rest) and the reaction
/// time (two speeds, two peaks); the last two are left out where they cannot be told. Throws InputError for settings
/// that measure nothing, WorldError where a touch does not meet the block, the robot refuses, or what comes out cannot
/// be.
CellFile Calibrate(Robot& robot, const KnownBlock& block, const CalibrationSettings& settings = {});

}  // namespace feeler::execution
