#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "feeler/core/pose.h"
#include "feeler/execution/remote/checked_robot.h"

namespace feeler::execution {

/// What is known of a cell: written by `feeler cell calibrate`, edited by people, read by `feeler execute`
/// (docs/file-formats.md, "Cell files").
struct CellFile {
  std::string tool;                    ///< the task whose tool was held when it was measured; empty: any
  std::string robot;                   ///< as the robot named itself
  std::optional<WorkspaceBox> box;     ///< base frame
  std::optional<double> force_bias_n;  ///< of the sensor at rest, free, not zeroed
  std::optional<double> force_noise_n;
  std::optional<double> contact_force_n;  ///< contacts are told from here on
  std::optional<double> stiffness_n_m;    ///< of a contact, arm and sensor included
  std::optional<double> reaction_time_s;  ///< from the touch to rest, less the braking
  /// Where the tool reference truly is in the frame that the robot calls its tool.
  Eigen::Vector3d tool_offset_m = Eigen::Vector3d::Zero();
};

/// Throws InputError for what is no cell file, or one of another version.
CellFile ReadCellFile(const std::string& path);
void WriteCellFile(const std::string& path, const CellFile& cell);

}  // namespace feeler::execution
