#pragma once

#include <mujoco/mujoco.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/task.h"

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
  std::vector<int> tool_geoms;    ///< can collide
  std::vector<int> target_geoms;  ///< can collide
  std::vector<int> lid_geoms;     ///< close the opening in the contact map, ignored by physics
};

/// Where models/ lies: $FEELER_MODELS if set, else the folder of the source tree the program was built from.
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
