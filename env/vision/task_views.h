#pragma once

#include "feeler/env/model/task_file.h"
#include "feeler/env/vision/image.h"

namespace feeler::env {

/// Pictures of tool and target alone, without robot, near enough that the opening fills them.
struct TaskViewOptions {
  int width = 1280;
  int height = 960;
  double depth_m = 0.0;   ///< of the tool below the mouth; negative: over it
  bool show_lids = true;  ///< translucent
  bool show_tool = true;
  int section_axis = 1;  ///< of the section: 0 cuts across x, 1 across y; through the origin of the target
};

/// Tool and target cut open through the middle of the mouth, seen square to the cut; cut faces stand out in colour.
Image RenderTaskSection(const TaskModel& task, const TaskViewOptions& options = {});

/// The mouth seen from above, into the opening; the tool is left away.
Image RenderTaskMouth(const TaskModel& task, const TaskViewOptions& options = {});

}  // namespace feeler::env
