#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/env/arm/ur10e.h"
#include "feeler/env/scene/scene.h"
#include "feeler/execution/recovery/online_planner.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/assembly/assembly.h"
#include "feeler/workflow/assembly/assembly_check.h"
#include "feeler/workflow/assembly/assembly_record.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// What a task of an assembly is localized with.
struct AssemblyTask {
  std::shared_ptr<const PlanningSetup> setup;
  std::shared_ptr<policies::Database> database;  ///< null: it holds nothing
  /// For problems that the database does not hold; null: none is planned, touches alone tell the pose.
  std::shared_ptr<execution::OnlinePlanner> online;
};
using AssemblyTasks = std::map<std::string, AssemblyTask>;

/// Opens the databases and loads the tasks of an assembly, each with the database that was made for it. Throws
/// InputError for a database of another task, two of one task, or a task without one.
AssemblyTasks LoadAssemblyTasks(const Assembly& assembly, const std::vector<std::string>& databases, Parallelism jobs,
                                const ProgressCallback& progress = {});

/// What is to be seen of a build: a scene with what the arm did in it, one after the other.
struct AssemblyFilm {
  struct Frame {
    double time_s = 0.0;  ///< since the build began
    env::JointVector q_rad = env::JointVector::Zero();
  };
  struct Segment {
    std::shared_ptr<const env::Scene> scene;
    std::string caption;
    std::vector<Frame> frames;
  };
  double period_s = 0.1;  ///< between frames, simulated
  std::vector<Segment> segments;
};

struct AssemblyOptions {
  std::uint64_t seed = 1;
  bool ladder = true;  ///< fallbacks within an attempt, and a second attempt from a fresh estimate
  AssemblyFilm* film = nullptr;
  ProgressCallback progress;  ///< insertions done
  const CancellationToken* cancellation = nullptr;
  /// What goes wrong behind the robot's back, for tests: where a part truly ends that was left at a pose, and what is
  /// told of a port instead of its estimate.
  std::function<Pose(std::size_t insertion, const Pose& world_T_part)> disturb_part;
  std::function<Pose(std::size_t insertion, const Pose& world_T_estimate)> disturb_estimate;
};

/// Builds an assembly in simulation: for each insertion the robot fetches the part from where it lies, carries it
/// around all that stands to the start pose over an estimate of the port, localizes the port by touch, inserts, lets
/// go.
///
/// The true pose of a port follows from the true poses of the parts below it: each part stays where it ended, with the
/// error it had then. The estimate differs from the true pose by a draw from the box of a problem, which is drawn from
/// the family of the task; each draw is keyed by seed, insertion and attempt. A failed attempt is tried once more from
/// a fresh estimate; a second failure ends the build with its reason.
///
/// Same assembly, databases, seed: the same record (`timing` excepted). Several may run at once on the same tasks.
AssemblyRecord BuildAssembly(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                             const AssemblyOptions& options);

}  // namespace feeler::workflow
