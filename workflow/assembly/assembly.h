#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/env/model/task_file.h"

namespace feeler::workflow {

/// A place of a part that takes the tool of a task: there the part is that task's target.
struct AssemblyPort {
  std::string name;
  std::string task;
  Pose part_T_target = Pose::Identity();  ///< the target frame of the task
};

/// What parts of one kind are: their geometry, how they are held and inserted, and what they take.
struct AssemblyKind {
  std::string name;
  std::filesystem::path geoms;  ///< MJCF file with the geoms, absolute
  std::string task;             ///< the task whose tool it is; empty: it is never moved
  Pose part_T_tool = Pose::Identity();
  Pose flange_T_tool = Pose::Identity();  ///< how the gripper holds it; any turn about the tool's z axis will do
  std::vector<AssemblyPort> ports;
};

/// A part of the structure.
struct AssemblyPart {
  std::string name;
  int kind = -1;
  bool fixed = false;                    ///< it stands from the beginning, for good
  Pose world_T_part = Pose::Identity();  ///< where it stands or lies at the start
};

/// A step: the part goes into (or onto) a port of a part that stands.
struct AssemblyInsertion {
  int part = -1;
  std::string task;
  int into = -1;          ///< part
  int port = -1;          ///< of its kind
  double turn_rad = 0.0;  ///< of the part about the axis of the port, from where the task has its tool
};

/// A structure to build: models/assemblies/*.json, read and checked (docs/assembly.md).
struct Assembly {
  std::string name;
  std::string file;
  std::string about;
  std::vector<std::filesystem::path> assets;  ///< MJCF files with meshes and materials, absolute
  std::vector<AssemblyKind> kinds;
  std::vector<AssemblyPart> parts;
  std::vector<AssemblyInsertion> insertions;  ///< in order
  std::map<std::string, std::shared_ptr<const env::TaskModel>> tasks;

  const AssemblyPart& Part(int part) const { return parts[static_cast<std::size_t>(part)]; }
  const AssemblyKind& KindOf(int part) const { return kinds[static_cast<std::size_t>(Part(part).kind)]; }
  const AssemblyPort& PortOf(const AssemblyInsertion& insertion) const {
    return KindOf(insertion.into).ports[static_cast<std::size_t>(insertion.port)];
  }
  const Task& TaskOf(const AssemblyInsertion& insertion) const { return tasks.at(insertion.task)->task; }
  /// "insertions[3] (jib into elbow.side)", for messages.
  std::string Describe(std::size_t insertion) const;
};

/// Loads `assembly`: a name under models/assemblies/ ("frame") or a path. Throws InputError naming file, field and what
/// to mend: not JSON, a field missing, unknown or out of range, an unknown kind, part, port or task, a part inserted
/// twice or never, a part that goes into one that does not stand by then, a cycle, a port used twice.
Assembly LoadAssembly(const std::string& assembly);

/// Names of the files under models/assemblies/, sorted.
std::vector<std::string> ListAssemblies();

/// The frame that the task calls `tool` in the part of an insertion: turned about the axis of the insertion.
Pose PartTTool(const Assembly& assembly, const AssemblyInsertion& insertion);

/// The target frame of an insertion when the part it goes into stands at `world_T_into`.
Pose TargetPoseOf(const Assembly& assembly, const AssemblyInsertion& insertion, const Pose& world_T_into);

/// Where the part of an insertion ends if all goes as drawn, with the port at `world_T_target`.
Pose InsertedPartPose(const Assembly& assembly, const AssemblyInsertion& insertion, const Pose& world_T_target);

/// Where every part (by its index) ends if all goes as drawn: the chain of ports, from the fixed parts on.
std::vector<Pose> NominalPoses(const Assembly& assembly);

}  // namespace feeler::workflow
