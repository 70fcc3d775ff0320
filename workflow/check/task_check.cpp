#include "feeler/workflow/check/task_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "feeler/env/model/contact_settings.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/geometry_findings.h"
#include "feeler/env/model/mesh_check.h"
#include "feeler/env/model/read_task.h"
#include "feeler/workflow/check/robot_findings.h"
#include "feeler/workflow/check/touch_findings.h"
#include "feeler/workflow/perception/perceive_table.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {
namespace {

using env::TaskFinding;
using env::TaskFindings;

std::string WhereOf(const env::TaskModel& task_model) { return task_model.file.lexically_normal().string(); }

void Append(TaskFindings more, TaskFindings& findings) {
  findings.insert(findings.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

/// What feels otherwise than the task's numbers say, and is no fault: said, so that nobody wonders.
void AddFeel(const env::TaskModel& task_model, const std::string& where, TaskFindings& findings) {
  const mjModel& model = *task_model.model;
  for (const std::vector<int>* geoms : {&task_model.tool_geoms, &task_model.target_geoms}) {
    for (const int geom : *geoms) {
      const double time_s = model.geom_solref[mjNREF * geom];
      if (time_s < 0 || time_s <= 0.04) continue;
      findings.push_back({TaskFinding::Severity::kWarning, "soft",
                          fmt::format("{}: {}", where, env::NameOfTaskGeom(model, geom)),
                          fmt::format("solref {} lets parts sink into each other for {:.0f} ms: walls are read late",
                                      time_s, time_s * 1000),
                          "solref=\"0.01 1\" is common"});
      return;
    }
  }
}

void AddCaps(const std::string& table_file, const env::TaskModel& task_model, const std::string& where,
             TaskFindings& findings) {
  const Task& task = task_model.task;
  const perception::UncertaintyTable table =
      LoadTable(table_file, task, env::Fingerprint(task_model, env::Opening::kClosed));
  std::vector<int> needed(task.axes.size(), 0);
  for (const perception::UncertaintyRule& rule : table.rules) {
    std::vector<UncertainAxis> free_axes = table.axes;
    for (UncertainAxis& axis : free_axes) axis.max_cells = 1000000;
    const std::vector<int> counts = perception::CountsFor(free_axes, rule.half);
    for (std::size_t i = 0; i < needed.size() && i < counts.size(); ++i) needed[i] = std::max(needed[i], counts[i]);
  }
  std::string capped;
  std::string value;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    value += fmt::format("{}{}", i == 0 ? "" : " ", std::max(needed[i], task.axes[i].max_cells));
    if (needed[i] <= task.axes[i].max_cells) continue;
    capped += fmt::format("{}{} needs {} cells and has {}", capped.empty() ? "" : ", ", ToString(task.axes[i].kind),
                          needed[i], task.axes[i].max_cells);
  }
  if (capped.empty()) return;
  findings.push_back(
      {TaskFinding::Severity::kError, "capped", fmt::format("{}: <custom><numeric name=\"feeler_max_cells\">", where),
       fmt::format("caps what the calibration {} asks for: {}; truths outside are missed", table_file, capped),
       fmt::format("\"{}\" holds them", value)});
}

}  // namespace

bool Prevents(const TaskFindings& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const TaskFinding& f) { return f.severity == TaskFinding::Severity::kError; });
}

std::vector<int> SmallestExtents(const Task& task) {
  std::vector<int> extents;
  for (const UncertainAxis& axis : task.axes) extents.push_back(axis.min_cells);
  return extents;
}

std::vector<int> LargestExtents(const Task& task) {
  std::vector<int> extents;
  for (const UncertainAxis& axis : task.axes) extents.push_back(axis.max_cells);
  return extents;
}

TaskFindings QuickFindings(const env::TaskModel& task_model, env::Opening opening, const std::vector<int>& extents) {
  const std::string where = WhereOf(task_model);
  TaskFindings findings;
  if (opening == env::Opening::kClosed) Append(env::LidFindings(task_model, where), findings);
  Append(RobotFindings(task_model, extents, where), findings);
  AddFeel(task_model, where, findings);
  return findings;
}

TaskFindings CheckTask(const std::string& task, const TaskCheckOptions& options) {
  const env::TaskModel read = env::ReadTask(task);
  const std::string where = WhereOf(read);
  TaskFindings findings = env::ContactSettingFindings(read, where);
  Append(env::MeshFindings(read.xml, where), findings);
  Append(env::GeometryFindings(read, where), findings);
  // A part that is not what its file says, or does not go in, has no contact map worth asking.
  const bool sound = !Prevents(findings);
  Append(QuickFindings(read, options.opening, LargestExtents(read.task)), findings);
  if (!options.table.empty()) AddCaps(options.table, read, where, findings);
  if (!sound || !options.touch) return findings;
  PlanningSetupOptions setup_options;
  setup_options.opening = options.opening;
  setup_options.jobs = options.jobs;
  setup_options.progress = options.progress;
  Append(TouchFindings(LoadPlanningSetup(task, setup_options), where, options.jobs, options.progress), findings);
  return findings;
}

}  // namespace feeler::workflow
