#pragma once

#include <memory>
#include <vector>

#include "feeler/env/scene/scene.h"
#include "feeler/workflow/assembly/assembly.h"

namespace feeler::workflow {

/// What the robot has to do with the part of an insertion.
enum class StagePhase {
  kFetch,   ///< the gripper is empty and opened for the part, which lies where it lies
  kInsert,  ///< the part is in the gripper
};

/// The world in one phase of one insertion.
struct StageLayout {
  std::size_t insertion = 0;
  StagePhase phase = StagePhase::kFetch;
  double grip_turn_rad = 0.0;      ///< of the part in the gripper about the axis of the tool
  std::vector<Pose> world_T_part;  ///< of every part of the assembly, where it is at present
};

/// Robot, table and all parts: the part in the gripper is the scene's tool, the part that it goes into the scene's
/// target (a mocap body whose frame is the target frame of the task at the port), everything else is environment. The
/// task of the scene is that of the insertion, the target where the layout has it. In kFetch the tool can touch nothing
/// and is not seen; tool frame and gripper are those of kInsert.
///
/// Lids are left out: they are the contact map's.
env::Scene BuildStage(const Assembly& assembly, const StageLayout& layout);

/// Where the tool frame of an insertion is when the gripper closes on the part as it lies.
Pose GraspPose(const Assembly& assembly, std::size_t insertion, const std::vector<Pose>& world_T_part);

}  // namespace feeler::workflow
