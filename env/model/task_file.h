#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/task.h"

namespace feeler::env {

/// A task file, read and checked: its numbers, its text for the scene, and its geometry compiled alone (without robot).
/// Immutable once loaded; share it freely.
struct TaskModel {
  Task task;
  std::filesystem::path file;  ///< absolute
  /// The MJCF text with its includes in place and its file names absolute, for merging with a robot.
  std::string xml;
  std::shared_ptr<const mjModel> model;
  int tool_body = -1;
  int target_body = -1;
  std::vector<int> tool_geoms;      ///< can collide
  std::vector<int> target_geoms;    ///< can collide
  std::vector<int> lid_geoms;       ///< of the target; close the opening in the contact map, ignored by physics
  std::vector<int> tool_lid_geoms;  ///< the same of a tool that has the opening
};

/// Whether the opening is closed by its lid geoms.
enum class Opening { kClosed, kOpen };
std::string_view ToString(Opening opening);

/// Geoms of tool and target that are felt.
struct FeltGeoms {
  std::vector<int> tool;
  std::vector<int> target;
};
FeltGeoms GeomsOf(const TaskModel& task_model, Opening opening);

/// Orientations of the target relative to the estimate, lexicographic in the angular axes of the task (one identity if
/// there are none), at their largest extents: Rz(yaw) * Ry(pitch), each angle (k - (n - 1)/2) * resolution.
std::vector<Eigen::Quaterniond> TargetOrientations(const Task& task);

/// Where models/ lies (core/data_folder.h). Throws InputError that lists what it looked for if it is nowhere.
std::filesystem::path ModelsFolder();

/// Loads `task`: a name under models/tasks/ ("plug") or a path to a task file. Fields: docs/task-file.md.
/// Throws InputError naming file, element and field when the file is unknown or malformed, a field is missing, has
/// the wrong number of values or a value out of range, or fields and geometry contradict each other.
TaskModel LoadTask(const std::string& task);

/// The same from a text; `name` stands for the file in messages, relative file names are taken from `folder`.
TaskModel LoadTaskFromText(const std::string& mjcf, const std::string& name, const std::filesystem::path& folder = ".");

/// Names of the task files under models/tasks/, sorted.
std::vector<std::string> ListTasks();

}  // namespace feeler::env
