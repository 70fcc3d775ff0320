// feeler task: what tasks there are, and what one holds.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <thread>

#include "cli/commands.h"
#include "cli/progress_bar.h"
#include "cli/solver_flags.h"
#include "core/error.h"
#include "env/image.h"
#include "env/renderer.h"
#include "env/scene.h"
#include "workflow/planning_setup.h"

namespace feeler::cli {
namespace {

struct Flags {
  std::string task;
  std::string opening = "closed";
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::string view = "overview";
  std::string out;
  bool json = false;
};

nlohmann::json AxisJson(const UncertainAxis& axis) {
  return {{"axis", ToString(axis.kind)},
          {"resolution", axis.resolution},
          {"unit", axis.angular() ? "rad" : "m"},
          {"min_cells", axis.min_cells},
          {"max_cells", axis.max_cells}};
}

/// Share of the displacements of the domain where tool and target overlap.
double BlockedShare(const planner::ContactMap& map) {
  std::int64_t blocked = 0;
  for (int o = 0; o < map.orientations(); ++o) {
    const auto& cells = map.layer(o).blocked;
    blocked += std::count_if(cells.begin(), cells.end(), [](std::uint8_t b) { return b != 0; });
  }
  return static_cast<double>(blocked) / static_cast<double>(map.domain().Count() * map.orientations());
}

nlohmann::json TaskJson(const workflow::PlanningSetup& setup) {
  const Task& task = setup.task();
  const planner::ContactMap& map = *setup.map;
  nlohmann::json axes = nlohmann::json::array();
  for (const UncertainAxis& axis : task.axes) axes.push_back(AxisJson(axis));
  const Cell size = map.domain().Size();
  return {{"task", task.name},
          {"file", setup.model.file.string()},
          {"fingerprint", setup.fingerprint},
          {"axes", axes},
          {"cell_m", task.cell_m},
          {"insertion", ToString(task.insertion)},
          {"insertion_depth_m", task.insertion_depth_m},
          {"tolerance",
           {{"lateral_m", task.tolerance.lateral_m},
            {"vertical_m", task.tolerance.vertical_m},
            {"angle_rad", task.tolerance.angle_rad}}},
          {"cost",
           {{"per_cell", task.cost.per_cell},
            {"per_contact", task.cost.per_contact},
            {"per_action", task.cost.per_action}}},
          {"goal", ToString(task.goal)},
          {"move_lengths", task.move_lengths},
          {"contact_map",
           {{"opening", env::ToString(setup.opening)},
            {"size", {size.x(), size.y(), size.z()}},
            {"orientations", map.orientations()},
            {"blocked_share", BlockedShare(map)},
            {"phase", {map.phase().x(), map.phase().y(), map.phase().z()}},
            {"margin_cells", map.margin_cells()}}}};
}

void PrintTask(const workflow::PlanningSetup& setup) {
  const Task& task = setup.task();
  const planner::ContactMap& map = *setup.map;
  fmt::print("task           {}\nfile           {}\nfingerprint    {}\n", task.name, setup.model.file.string(),
             setup.fingerprint);
  std::int64_t problems = 1;
  std::int64_t hypotheses = 1;
  for (const UncertainAxis& axis : task.axes) {
    const double scale = axis.angular() ? 180 / std::numbers::pi : 1000;
    const char* unit = axis.angular() ? "deg" : "mm";
    fmt::print("axis {:<9} {}..{} hypotheses at {:.4g} {} (up to {:.4g} {})\n", ToString(axis.kind), axis.min_cells,
               axis.max_cells, axis.resolution * scale, unit, axis.max_cells * axis.resolution * scale, unit);
    problems *= axis.max_cells - axis.min_cells + 1;
    hypotheses *= axis.max_cells;
  }
  fmt::print("family         {} problems of at most {} hypotheses\n", problems, hypotheses);
  fmt::print("insertion      {}, {:.4g} mm deep, tolerance {:.4g} mm lateral, {:.4g} mm vertical, {:.4g} deg\n",
             ToString(task.insertion), task.insertion_depth_m * 1000, task.tolerance.lateral_m * 1000,
             task.tolerance.vertical_m * 1000, task.tolerance.angle_rad * 180 / std::numbers::pi);
  fmt::print("cost           {} per cell, {} per contact, {} per action; goal {}\n", task.cost.per_cell,
             task.cost.per_contact, task.cost.per_action, ToString(task.goal));
  fmt::print("move lengths   {}\n", fmt::join(task.move_lengths, ", "));
  const Cell size = map.domain().Size();
  fmt::print("contact map    {} x {} x {} displacements of {:.4g} mm, {} orientation{}, opening {}, {:.1f} % blocked\n",
             size.x(), size.y(), size.z(), task.cell_m * 1000, map.orientations(), map.orientations() == 1 ? "" : "s",
             env::ToString(setup.opening), 100 * BlockedShare(map));
  fmt::print("lattice phase  {:.3f}, {:.3f}, {:.3f} cells; walls at least {:.3f} cells from a lattice plane\n",
             map.phase().x(), map.phase().y(), map.phase().z(), map.margin_cells());
}

void Show(const Flags& flags) {
  ProgressBar bar("contact map");
  workflow::PlanningSetupOptions options;
  options.opening = ParseOpening(flags.opening);
  options.jobs = ParseJobs(flags.jobs);
  options.progress = bar.Callback();
  const workflow::PlanningSetup setup = workflow::LoadPlanningSetup(flags.task, options);
  bar.Finish();
  if (flags.json) {
    PrintJson(TaskJson(setup));
  } else {
    PrintTask(setup);
  }
}

void Render(const Flags& flags) {
  env::SceneView view = env::SceneView::kOverview;
  if (flags.view == "close-up") {
    view = env::SceneView::kCloseUp;
  } else if (flags.view != "overview") {
    throw InputError("--view", "unknown view \"" + flags.view + "\"", "choose one of overview, close-up");
  }
  RequireWritable("--out", flags.out);
  const env::Scene scene = env::BuildScene(env::LoadTask(flags.task));
  env::WritePng(env::RenderSceneImage(scene, view), flags.out);
}

void List(bool json) {
  const std::vector<std::string> names = env::ListTasks();
  if (json) {
    PrintJson(names);
    return;
  }
  for (const std::string& name : names) fmt::print("{}\n", name);
}

}  // namespace

void AddTaskCommand(CLI::App& app, Session& /*session*/) {
  CLI::App* task = app.add_subcommand("task", "Tasks: what is inserted into what");
  task->require_subcommand(1);
  auto flags = std::make_shared<Flags>();
  CLI::App* list = task->add_subcommand("list", "Names of the tasks under models/tasks/");
  list->add_flag("--json", flags->json, "print JSON");
  list->callback([flags] { List(flags->json); });
  CLI::App* show = task->add_subcommand("show", "Axes, ranges, tolerance and contact map of a task");
  show->add_option("task", flags->task, "name, or path of a task file")->required();
  show->add_option("--opening", flags->opening, "closed or open while localizing")->capture_default_str();
  show->add_option("--jobs", flags->jobs, "threads, if the contact map must be built")->capture_default_str();
  show->add_flag("--json", flags->json, "print JSON");
  show->callback([flags] { Show(*flags); });
  CLI::App* render = task->add_subcommand("render", "A picture of robot, tool and target at the start pose");
  render->add_option("task", flags->task, "name, or path of a task file")->required();
  render->add_option("--view", flags->view, "overview or close-up")->capture_default_str();
  render->add_option("--out", flags->out, "PNG file to write")->required();
  render->callback([flags] { Render(*flags); });
}

}  // namespace feeler::cli
