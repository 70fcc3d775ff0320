#include "feeler/workflow/assembly/assembly_stage.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <cstring>
#include <string>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/task_xml.h"

namespace feeler::workflow {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

XMLElement& AddBody(XMLElement& parent, const std::string& name, const Pose& pose) {
  XMLElement& body = *parent.InsertNewChildElement("body");
  body.SetAttribute("name", name.c_str());
  body.SetAttribute("pos", env::MjcfVector(pose.translation()).c_str());
  body.SetAttribute("quat", env::MjcfQuaternion(pose.linear()).c_str());
  return body;
}

/// The geoms of a kind of part, without names (a part may occur often) and lids. `ghost`: what gives the gripper its
/// shape, but is neither seen nor felt: no geom has the bit that these collide with.
void AddGeoms(const AssemblyKind& kind, bool ghost, XMLElement& body) {
  XMLDocument document;
  const std::string text = env::ReadTextFile(kind.geoms);
  document.Parse(text.c_str(), text.size());
  if (document.Error() || document.RootElement() == nullptr) {
    throw InputError(kind.geoms.string(), "not well-formed XML", "correct the file");
  }
  for (const XMLElement* geom = document.RootElement()->FirstChildElement(); geom != nullptr;
       geom = geom->NextSiblingElement()) {
    if (std::strcmp(geom->Name(), "geom") != 0) {
      throw InputError(kind.geoms.string(), fmt::format("<{}> in a part", geom->Name()), "a part has geoms only");
    }
    const char* name = geom->Attribute("name");
    const bool visual = geom->Attribute("class", "part_visual") != nullptr;
    if ((name != nullptr && std::strncmp(name, "lid", 3) == 0) || (ghost && visual)) continue;
    XMLElement& copy = *geom->DeepClone(body.GetDocument())->ToElement();
    copy.DeleteAttribute("name");
    if (ghost) {
      copy.SetAttribute("contype", 0);
      copy.SetAttribute("conaffinity", 2);
      copy.SetAttribute("group", env::Scene::kLidGroup);
      copy.SetAttribute("mass", 1e-4);  // a body without mass does not compile
    }
    body.InsertEndChild(&copy);
  }
}

}  // namespace

Pose GraspPose(const Assembly& assembly, std::size_t insertion, const std::vector<Pose>& world_T_part) {
  const AssemblyInsertion& step = assembly.insertions[insertion];
  return world_T_part[static_cast<std::size_t>(step.part)] * PartTTool(assembly, step);
}

env::Scene BuildStage(const Assembly& assembly, const StageLayout& layout) {
  const AssemblyInsertion& step = assembly.insertions[layout.insertion];
  const env::TaskModel& model = *assembly.tasks.at(step.task);
  Task task = model.task;
  const Eigen::Vector3d outward = -UnitVector(task.insertion);
  const AssemblyKind& held = assembly.KindOf(step.part);
  // Held by the part, not by the tool frame: a turn of the part in the port does not turn it in the gripper.
  const Pose tool0_T_tool = held.part_T_tool.inverse() * PartTTool(assembly, step);
  task.flange_T_tool = held.flange_T_tool * Eigen::AngleAxisd(layout.grip_turn_rad, outward) * tool0_T_tool;
  task.world_T_target = TargetPoseOf(assembly, step, layout.world_T_part[static_cast<std::size_t>(step.into)]);
  task.file = assembly.file;

  std::string text = "<mujoco model=\"assembly\">\n  <include file=\"scene.xml\"/>\n";
  for (const auto& asset : assembly.assets) text += fmt::format("  <include file=\"{}\"/>\n", asset.string());
  text += "  <worldbody>\n    <include file=\"bench.xml\"/>\n  </worldbody>\n</mujoco>\n";
  text = env::ResolveMjcf(text, assembly.file, env::ModelsFolder() / "parts");
  XMLDocument document;
  document.Parse(text.c_str(), text.size());
  XMLElement& world = *document.RootElement()->FirstChildElement("worldbody");

  XMLElement& target = AddBody(world, "target", task.world_T_target);
  const Pose target_T_into = assembly.PortOf(step).part_T_target.inverse();
  AddGeoms(assembly.KindOf(step.into), false, AddBody(target, "part " + assembly.Part(step.into).name, target_T_into));
  const bool fetch = layout.phase == StagePhase::kFetch;
  XMLElement& tool = AddBody(world, "tool", Pose(Eigen::Translation3d(0.0, 0.0, 2.0)));
  AddGeoms(held, fetch,
           AddBody(tool, (fetch ? "grip of " : "part ") + assembly.Part(step.part).name,
                   PartTTool(assembly, step).inverse()));
  for (std::size_t part = 0; part < assembly.parts.size(); ++part) {
    const int index = static_cast<int>(part);
    if (index == step.into || (index == step.part && !fetch)) continue;
    AddGeoms(assembly.KindOf(index), false,
             AddBody(world, "part " + assembly.parts[part].name, layout.world_T_part[part]));
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  env::SceneOptions options;
  options.cameras.housings = false;
  return env::BuildScene(task, printer.CStr(), env::ModelsFolder().string(), options);
}

}  // namespace feeler::workflow
