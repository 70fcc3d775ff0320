#pragma once

// The plug scene that the tests of the simulated world share, and its walls as its models define them.

#include <gtest/gtest.h>

#include <memory>

#include "feeler/env/model/task_file.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/env/robot/tool_kinematics.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// Compiled once per test binary; never changed.
inline std::shared_ptr<const Scene> PlugScene() {
  static const auto scene = [] {
    const TaskModel model = LoadTask("plug");
    return std::make_shared<const Scene>(BuildScene(model.task, model.xml, ModelsFolder().string()));
  }();
  return scene;
}

/// Configuration with the tool at a pose, continued from home.
inline JointVector At(const Scene& scene, const Pose& world_T_tool) {
  JointVector best = JointVector::Constant(1e9);
  for (const JointVector& q : ToolInverseKinematics(scene, world_T_tool)) {
    if ((q - scene.home_q_rad).norm() < (best - scene.home_q_rad).norm()) best = q;
  }
  EXPECT_LT(best.norm(), 1e6) << "out of reach";
  return best;
}

/// The tool aligned with the nominal target, displaced from its mouth.
inline Pose ToolAt(const Scene& scene, const Eigen::Vector3d& displacement_m) {
  Pose pose = scene.task.world_T_target;
  pose.translation() += pose.linear() * displacement_m;
  return pose;
}

/// Housing 58 x 50 mm around the mouth, plug 24 x 16 mm: half extents of the configuration-space obstacle.
inline constexpr double kWallX_m = 0.029 + 0.012;
inline constexpr double kWallY_m = 0.025 + 0.008;
inline constexpr double kPanel_m = -0.030;  ///< height of the panel's top in the target frame

}  // namespace feeler::env
