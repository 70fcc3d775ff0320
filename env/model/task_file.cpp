#include "feeler/env/model/task_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <string_view>

#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/core/orientation_lattice.h"
#include "feeler/core/text/plain_locale.h"
#include "feeler/env/model/contact_settings.h"
#include "feeler/env/model/geometry_findings.h"
#include "feeler/env/model/mesh_check.h"
#include "feeler/env/model/mouth_clearance.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/overlap_judge.h"
#include "feeler/env/model/read_task.h"
#include "feeler/env/model/task_fields.h"
#include "feeler/env/model/task_xml.h"

namespace feeler::env {
namespace {

namespace fs = std::filesystem;

bool BelongsTo(const mjModel& model, int geom, int body) {
  for (int b = model.geom_bodyid[geom]; b > 0; b = model.body_parentid[b]) {
    if (b == body) return true;
  }
  return false;
}

int FindBody(const mjModel& model, const char* name, const std::string& where) {
  const int body = mj_name2id(&model, mjOBJ_BODY, name);
  if (body < 0) {
    throw InputError(fmt::format("{}: <worldbody>", where), fmt::format("<body name=\"{}\"> is missing", name),
                     "a task has one body `tool` and one body `target`");
  }
  if (model.body_parentid[body] != 0) {
    throw InputError(fmt::format("{}: <body name=\"{}\">", where, name), "is not a child of <worldbody>",
                     "move it there");
  }
  return body;
}

void SortGeoms(TaskModel& task_model, const std::string& where) {
  const mjModel& model = *task_model.model;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const std::string_view name = model.names + model.name_geomadr[geom];
    const bool can_collide = model.geom_contype[geom] != 0 || model.geom_conaffinity[geom] != 0;
    const bool of_tool = BelongsTo(model, geom, task_model.tool_body);
    const bool of_target = BelongsTo(model, geom, task_model.target_body);
    const bool lid = (of_target || of_tool) && name.starts_with("lid");
    if (lid && can_collide) {
      throw InputError(fmt::format("{}: <geom name=\"{}\">", where, name), "a lid collides in physics",
                       "set contype=\"0\" conaffinity=\"0\"");
    }
    if (lid) (of_tool ? task_model.tool_lid_geoms : task_model.lid_geoms).push_back(geom);
    if (!can_collide || (!of_tool && !of_target)) continue;
    const int type = model.geom_type[geom];
    if (type == mjGEOM_HFIELD || (type == mjGEOM_PLANE && of_tool)) {
      throw InputError(fmt::format("{}: <geom name=\"{}\">", where, name),
                       type == mjGEOM_HFIELD ? "height fields are not supported" : "a tool cannot have a plane",
                       "use boxes, cylinders, capsules, spheres, ellipsoids or convex meshes");
    }
    (of_tool ? task_model.tool_geoms : task_model.target_geoms).push_back(geom);
  }
  for (const auto& [geoms, name] : {std::pair{&task_model.tool_geoms, "tool"}, {&task_model.target_geoms, "target"}}) {
    if (geoms->empty()) {
      throw InputError(fmt::format("{}: <body name=\"{}\">", where, name), "has no geom that can collide",
                       "give one geom a contype and a conaffinity of 1");
    }
  }
}

Pose BodyAtRest(const mjModel& model, int body) {
  const DataHandle data = MakeData(model);
  mj_kinematics(&model, data.get());
  return BodyPose(*data, body);
}

/// Whether the tool, aligned and anywhere on its way in, is free of contact at every turn about the insertion axis.
bool TurnsFreely(const TaskModel& task_model) {
  const Task& task = task_model.task;
  constexpr int kTurns = 36;  // 10 degrees each: no multiple of the sides of a polygon that is meant to be round
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  for (int turn = 1; turn < kTurns; ++turn) {
    // Turning the target one way is turning the tool the other way.
    const Eigen::Quaterniond orientation(Eigen::AngleAxisd(2 * std::numbers::pi * turn / kTurns, inward));
    OverlapJudge judge(task_model, GeomsOf(task_model, Opening::kOpen), orientation);
    for (const double share : {0.1, 0.5, 0.98}) {
      if (judge.Overlap(inward * (share * task.insertion_depth_m))) return false;
    }
  }
  return true;
}

/// The stem of the file, or the model's own name where the file is one `task.xml` among many, as imports write them.
std::string NameOf(const mjModel& model, const std::string& stem) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.+";
  const std::string_view own = model.names;  // the model's name stands first
  const bool plain = !own.empty() && own.front() != '.' && own.find_first_not_of(kPlain) == std::string_view::npos;
  return stem == "task" && plain ? std::string(own) : stem;
}

}  // namespace

std::string_view ToString(Opening opening) { return opening == Opening::kClosed ? "closed" : "open"; }

FeltGeoms GeomsOf(const TaskModel& task_model, Opening opening) {
  FeltGeoms geoms{task_model.tool_geoms, task_model.target_geoms};
  if (opening == Opening::kOpen) return geoms;
  geoms.tool.insert(geoms.tool.end(), task_model.tool_lid_geoms.begin(), task_model.tool_lid_geoms.end());
  geoms.target.insert(geoms.target.end(), task_model.lid_geoms.begin(), task_model.lid_geoms.end());
  return geoms;
}

std::vector<Eigen::Quaterniond> TargetOrientations(const Task& task) {
  std::vector<Eigen::Quaterniond> orientations;
  for (int k = 0; k < LatticeOrientations(task); ++k) orientations.push_back(LatticeOrientation(task, k));
  return orientations;
}

fs::path ModelsFolder() { return FindData("models"); }

TaskModel ReadTaskFromText(const std::string& mjcf, const std::string& name, const fs::path& folder) {
  const PlainLocale plain;
  TaskModel task_model;
  task_model.xml = ResolveMjcf(mjcf, name, folder);
  RequireSoundMeshes(task_model.xml, name);
  task_model.model = std::shared_ptr<const mjModel>(CompileMjcf(task_model.xml, name));
  const mjModel& model = *task_model.model;
  task_model.tool_body = FindBody(model, "tool", name);
  task_model.target_body = FindBody(model, "target", name);
  SortGeoms(task_model, name);
  task_model.task = ReadTaskFields(model, name);
  task_model.task.world_T_target = BodyAtRest(model, task_model.target_body);
  task_model.task.name = NameOf(model, fs::path(name).stem().string());
  DeriveTolerances(task_model);
  return task_model;
}

TaskModel LoadTaskFromText(const std::string& mjcf, const std::string& name, const fs::path& folder) {
  TaskModel task_model = ReadTaskFromText(mjcf, name, folder);
  RequireNoError(ContactSettingFindings(task_model, name));
  RequireNoError(MeshFindings(task_model.xml, name));
  RequireNoError(GeometryFindings(task_model, name));
  task_model.task.turns_freely = TurnsFreely(task_model);
  return task_model;
}

namespace {

bool IsPath(const std::string& task) { return task.find('/') != std::string::npos || task.ends_with(".xml"); }

}  // namespace

fs::path FileOfTask(const std::string& task) {
  if (!IsPath(task)) return ModelsFolder() / "tasks" / (task + ".xml");
  const fs::path file(task);
  return file.has_parent_path() ? file : fs::path(".") / file;
}

std::vector<std::string> FilesOfTask(const std::string& task) {
  const fs::path file = FileOfTask(task);
  std::vector<std::string> files = FilesOfMjcf(ReadTextFile(file), file.string(), file.parent_path());
  files.push_back(file.string());
  return files;
}

namespace {

using FromText = TaskModel (*)(const std::string& mjcf, const std::string& name, const fs::path& folder);

TaskModel FromFile(const std::string& task, FromText from_text) {
  const bool is_path = IsPath(task);
  const fs::path file = FileOfTask(task);
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    std::string known;
    for (const std::string& name : ListTasks()) known += " " + name;
    const bool missing = !error || error == std::errc::no_such_file_or_directory;
    if (!missing) throw InputError(task, "cannot be read: " + error.message(), "check the name and the permissions");
    throw InputError(is_path ? task : "task " + task, "no such task",
                     is_path
                         ? "give a task's name or the path of a task file"
                         : "tasks are:" + (known.empty() ? " none in " + (ModelsFolder() / "tasks").string() : known));
  }
  TaskModel task_model = from_text(ReadTextFile(file), file.lexically_normal().string(), file.parent_path());
  task_model.file = fs::absolute(file, error).lexically_normal();
  if (error) throw InputError(task, "cannot be located: " + error.message(), "change to another folder");
  task_model.task.file = task_model.file.string();
  return task_model;
}

}  // namespace

TaskModel LoadTask(const std::string& task) { return FromFile(task, LoadTaskFromText); }

TaskModel ReadTask(const std::string& task) { return FromFile(task, ReadTaskFromText); }

std::vector<std::string> ListTasks() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(ModelsFolder() / "tasks", error)) {
    if (entry.path().extension() == ".xml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace feeler::env
