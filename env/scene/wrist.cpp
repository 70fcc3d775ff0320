#include "feeler/env/scene/wrist.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"

namespace feeler::env {
namespace {

// A colon is in no name that anybody gives to a part.
constexpr std::array<const char*, 3> kSlides = {"feeler:wrist_x", "feeler:wrist_y", "feeler:wrist_z"};
constexpr double kGravity_m_s2 = 9.81;

}  // namespace

void RequireWrist(const SceneOptions& options) {
  const double k = options.wrist_stiffness_n_m;
  if (k == 0.0 || (k >= Wrist::kSoftest_n_m && k <= Wrist::kStiffest_n_m)) return;
  throw InputError("scene options", fmt::format("the stiffness of the wrist is {} N/m", k),
                   fmt::format("give {:g} to {:g}, or 0 for a tool that is held rigidly", Wrist::kSoftest_n_m,
                               Wrist::kStiffest_n_m));
}

void AddWrist(const SceneOptions& options, const Task& task, double tool_mass_kg, tinyxml2::XMLElement& tool) {
  const double k = options.wrist_stiffness_n_m;
  if (k == 0.0) return;
  // Half a radian of the tool's swing in a step: what a step resolves.
  const double stiffest = 0.25 * tool_mass_kg / (options.timestep_s * options.timestep_s);
  if (k > stiffest) {
    throw InputError(
        "scene options",
        fmt::format("on springs of {:g} N/m the tool of {:.3g} kg swings faster than steps of {:g} ms show", k,
                    tool_mass_kg, 1e3 * options.timestep_s),
        fmt::format("give at most {:.0f} N/m, or 0 for a tool that is held rigidly", std::floor(stiffest)));
  }
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravity_m_s2);
  const Eigen::Vector3d weight_n = tool_mass_kg * (task.world_T_target.linear().transpose() * gravity);
  tinyxml2::XMLNode* after = nullptr;
  for (int axis = 0; axis < 3; ++axis) {
    // Every attribute, so that no default of the task file has a say.
    tinyxml2::XMLElement& slide = *tool.GetDocument()->NewElement("joint");
    after = after == nullptr ? tool.InsertFirstChild(&slide) : tool.InsertAfterChild(after, &slide);
    slide.SetAttribute("name", kSlides[static_cast<std::size_t>(axis)]);
    slide.SetAttribute("type", "slide");
    slide.SetAttribute("pos", "0 0 0");
    slide.SetAttribute("axis", MjcfVector(Eigen::Vector3d::Unit(axis)).c_str());
    slide.SetAttribute("stiffness", k);
    slide.SetAttribute("springdamper", "0 0");
    slide.SetAttribute("springref", -weight_n[axis] / k);
    slide.SetAttribute("damping", 2.0 * std::sqrt(tool_mass_kg * k));
    slide.SetAttribute("limited", "true");
    slide.SetAttribute("range", fmt::format("{} {}", -Wrist::kTravel_m, Wrist::kTravel_m).c_str());
    slide.SetAttribute("margin", 0);
    // Hard: how far a stop gives way goes by the mass on it, and it is the arm that pushes the tool against it.
    slide.SetAttribute("solreflimit", "0.004 1");
    slide.SetAttribute("solimplimit", "0.99 0.999 0.0005");
    slide.SetAttribute("ref", 0);
    slide.SetAttribute("armature", 0);
    slide.SetAttribute("frictionloss", 0);
  }
}

Wrist FindWrist(const SceneOptions& options, const mjModel& model) {
  Wrist wrist;
  wrist.stiffness_n_m = options.wrist_stiffness_n_m;
  if (wrist.stiffness_n_m == 0.0) return wrist;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int joint = mj_name2id(&model, mjOBJ_JOINT, kSlides[axis]);
    wrist.qpos[axis] = model.jnt_qposadr[joint];
    wrist.dof[axis] = model.jnt_dofadr[joint];
  }
  wrist.damping_n_s_m = model.dof_damping[wrist.dof[0]];
  return wrist;
}

}  // namespace feeler::env
