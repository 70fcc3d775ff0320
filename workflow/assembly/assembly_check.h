#pragma once

#include <string>
#include <vector>

#include "feeler/core/progress.h"
#include "feeler/workflow/assembly/assembly.h"

namespace feeler::workflow {

/// What checking an assembly finds out for building it.
struct AssemblyPlan {
  std::vector<double> grip_turn_rad;  ///< of each insertion: how the part is turned in the gripper
  std::vector<Pose> world_T_part;     ///< of every part when all is built as drawn
};

/// Goes through the assembly as drawn, without physics: where parts overlap each other, the table or the robot, at the
/// start or once built; whether every part meets the port it goes into as tool and target of the task meet (else the
/// policies of the task do not hold), with nothing else in the way; whether the arm reaches and stands free wherever
/// fetching and inserting take it, also for ports that are turned as far as the task allows.
/// Throws InputError that names the insertion (or part), what is wrong and how to mend it.
AssemblyPlan CheckAssembly(const Assembly& assembly, const ProgressCallback& progress = {});

}  // namespace feeler::workflow
