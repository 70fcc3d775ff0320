// feeler task: what tasks there are, and what one holds.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numbers>
#include <system_error>
#include <thread>

#include "feeler/cad/pipe_parts.h"
#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/cli/task/task_check.h"
#include "feeler/cli/task/task_import.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/parallelism.h"
#include "feeler/env/contact/axis_visibility.h"
#include "feeler/env/model/contact_settings.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/vision/image.h"
#include "feeler/env/vision/renderer.h"
#include "feeler/env/vision/task_views.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::cli {
namespace {

struct TaskFlags {
  std::string task;
  std::string opening = "closed";
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::string view = "overview";
  double depth_mm = -2.0;
  bool no_lids = false;
  std::string out;
  bool json = false;
};

/// Walls nearer to a lattice plane than this can be read as a neighbour's.
constexpr double kNearWall_cells = 0.1;

nlohmann::json AxisJson(const UncertainAxis& axis) {
  return {{"axis", ToString(axis.kind)},
          {"resolution", axis.resolution},
          {"unit", axis.angular() ? "rad" : "m"},
          {"min_cells", axis.min_cells},
          {"max_cells", axis.max_cells}};
}

/// A value per axis of the target frame, as JSON.
template <class ValueOf>
nlohmann::json PerAxis(const ValueOf& value_of) {
  return {value_of(0), value_of(1), value_of(2)};
}

std::string LateralText(const Task& task) {
  const Tolerance& tolerance = task.tolerance;
  if (tolerance.one_lateral()) return fmt::format("{:.4g}", 1e3 * tolerance.lateral_m);
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == AxisOf(task.insertion)) continue;
    text += fmt::format("{}{:.4g} ({})", text.empty() ? "" : " x ", 1e3 * tolerance.Lateral(axis), "xyz"[axis]);
  }
  return text;
}

std::string AngleText(const Task& task) {
  const Tolerance& tolerance = task.tolerance;
  const auto degrees = [&](int axis) { return tolerance.Angle(axis) * 180 / std::numbers::pi; };
  if (tolerance.one_angle()) return fmt::format("{:.4g}", degrees(0));
  return fmt::format("{:.3g} / {:.3g} / {:.3g} (about x, y, z)", degrees(0), degrees(1), degrees(2));
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
  nlohmann::json felt = nlohmann::json::array();
  for (const env::AxisVisibility& axis : env::AxisVisibilities(task, map)) {
    felt.push_back({{"axis", ToString(axis.kind)},
                    {"felt", axis.felt()},
                    {"largest_difference_cells", axis.largest_difference_cells},
                    {"fewest_probes", axis.fewest_probes},
                    {"alike_pairs", axis.alike_pairs},
                    {"pairs", axis.pairs}});
  }
  const Cell size = map.domain().Size();
  const env::TaskModel& model = setup.model;
  auto feel =
      env::ContactParameters(*model.model, model.tool_geoms, model.target_geoms, model.tool_body, model.target_body);
  feel.erase("digest");  // of the physics of an episode: it stands in the records
  return {{"task", task.name},
          {"contact_parameters", feel},
          {"file", setup.model.file.string()},
          {"fingerprint", setup.fingerprint},
          {"axes", axes},
          {"cell_m", task.cell_m},
          {"insertion", ToString(task.insertion)},
          {"insertion_depth_m", task.insertion_depth_m},
          {"tolerance",
           {{"lateral_m", task.tolerance.lateral_m},
            {"lateral_per_axis_m", PerAxis([&](int axis) { return task.tolerance.Lateral(axis); })},
            {"vertical_m", task.tolerance.vertical_m},
            {"angle_rad", task.tolerance.angle_rad},
            {"angle_per_axis_rad", PerAxis([&](int axis) { return task.tolerance.Angle(axis); })}}},
          {"cost",
           {{"per_cell", task.cost.per_cell},
            {"per_contact", task.cost.per_contact},
            {"per_action", task.cost.per_action}}},
          {"goal", ToString(task.goal)},
          {"turns_freely", task.turns_freely},
          {"felt", felt},
          {"move_lengths", task.move_lengths},
          {"contact_map",
           {{"opening", env::ToString(setup.opening)},
            {"size", {size.x(), size.y(), size.z()}},
            {"orientations", map.orientations()},
            {"blocked_share", BlockedShare(map)},
            {"phase", {map.phase().x(), map.phase().y(), map.phase().z()}},
            {"margin_cells", map.margin_cells()},
            {"walls_within_tenth", env::ShareOfWallsNear(map, kNearWall_cells)}}}};
}

void PrintVisibility(const env::AxisVisibility& axis) {
  if (!axis.felt()) {
    Print(
        "felt           {}: NOT SEEN by contact (no probe differs by more than {:.3f} cells): feeler task check "
        "says what would help\n",
        ToString(axis.kind), axis.largest_difference_cells);
    return;
  }
  Print("felt           {}: neighbours differ in {} probes at least, by up to {:.2f} cells{}\n", ToString(axis.kind),
        axis.fewest_probes, axis.largest_difference_cells,
        axis.alike_pairs == 0 ? "" : fmt::format("; {} of {} pairs are alike", axis.alike_pairs, axis.pairs));
}

void PrintTask(const workflow::PlanningSetup& setup) {
  const Task& task = setup.task();
  const planner::ContactMap& map = *setup.map;
  Print("task           {}\nfile           {}\nfingerprint    {}\n", task.name, setup.model.file.string(),
        setup.fingerprint);
  std::int64_t problems = 1;
  std::int64_t hypotheses = 1;
  for (const UncertainAxis& axis : task.axes) {
    const double scale = axis.angular() ? 180 / std::numbers::pi : 1000;
    const char* unit = axis.angular() ? "deg" : "mm";
    Print("axis {:<9} {}..{} hypotheses at {:.4g} {} (up to {:.4g} {})\n", ToString(axis.kind), axis.min_cells,
          axis.max_cells, axis.resolution * scale, unit, axis.max_cells * axis.resolution * scale, unit);
    problems *= axis.max_cells - axis.min_cells + 1;
    hypotheses *= axis.max_cells;
  }
  Print("family         {} problems of at most {} hypotheses\n", problems, hypotheses);
  Print("insertion      {}, {:.4g} mm deep, tolerance {} mm lateral, {:.4g} mm vertical, {} deg\n",
        ToString(task.insertion), task.insertion_depth_m * 1000, LateralText(task), task.tolerance.vertical_m * 1000,
        AngleText(task));
  Print("cost           {} per cell, {} per contact, {} per action; goal {}\n", task.cost.per_cell,
        task.cost.per_contact, task.cost.per_action, ToString(task.goal));
  const env::TaskModel& model = setup.model;
  const auto feel =
      env::ContactParameters(*model.model, model.tool_geoms, model.target_geoms, model.tool_body, model.target_body);
  const auto range = [&](const std::string& name) {
    const double least = feel.at(name + "_least");
    const double most = feel.at(name + "_most");
    return least == most ? fmt::format("{:g}", least) : fmt::format("{:g}..{:g}", least, most);
  };
  Print("contact        friction {}, solref {} {}, solimp {} {}; tool {:.3g} kg, target {:.3g} kg\n", range("friction"),
        range("solref_0"), range("solref_1"), range("solimp_0"), range("solimp_1"), feel.at("tool_mass_kg"),
        feel.at("target_mass_kg"));
  Print("move lengths   {}\n", fmt::join(task.move_lengths, ", "));
  const Cell size = map.domain().Size();
  Print("contact map    {} x {} x {} displacements of {:.4g} mm, {} orientation{}, opening {}, {:.1f} % blocked\n",
        size.x(), size.y(), size.z(), task.cell_m * 1000, map.orientations(), map.orientations() == 1 ? "" : "s",
        env::ToString(setup.opening), 100 * BlockedShare(map));
  Print("lattice phase  {:.3f}, {:.3f}, {:.3f} cells; walls{} at least {:.3f} cells from a lattice plane\n",
        map.phase().x(), map.phase().y(), map.phase().z(), map.orientations() == 1 ? "" : " of the target as estimated",
        map.margin_cells());
  if (map.orientations() > 1) {
    Print("               turned, {:.1f} % of what is met lies within {} cells of one\n",
          100 * env::ShareOfWallsNear(map, kNearWall_cells), kNearWall_cells);
  }
  if (task.turns_freely) Print("mating         round: a turn about the insertion axis is no error\n");
  for (const env::AxisVisibility& axis : env::AxisVisibilities(task, map)) PrintVisibility(axis);
}

void Show(const TaskFlags& flags) {
  ProgressBar bar("contact map");
  workflow::PlanningSetupOptions options;
  options.opening = ParseOpening(flags.opening);
  options.jobs = Parallelism(flags.jobs);
  options.progress = bar.Callback();
  const workflow::PlanningSetup setup = workflow::LoadPlanningSetup(flags.task, options);
  bar.Finish();
  if (flags.json) {
    PrintJson(TaskJson(setup));
  } else {
    PrintTask(setup);
  }
}

env::Image RenderView(const env::TaskModel& model, const TaskFlags& flags) {
  if (flags.view == "overview") return env::RenderSceneImage(env::BuildScene(model), env::SceneView::kOverview);
  if (flags.view == "close-up") return env::RenderSceneImage(env::BuildScene(model), env::SceneView::kCloseUp);
  env::TaskViewOptions options;
  options.depth_m = flags.depth_mm / 1000;
  options.show_lids = !flags.no_lids;
  if (flags.view == "mouth") return env::RenderTaskMouth(model, options);
  if (flags.view == "section") return env::RenderTaskSection(model, options);
  throw InputError("--view", "unknown view \"" + flags.view + "\"", "choose one of overview, close-up, section, mouth");
}

void Render(const TaskFlags& flags) {
  RequireOutputs({{"--out", flags.out, FileKind::kPng}}, InputsOfTask(flags.task));
  env::WritePng(RenderView(env::LoadTask(flags.task), flags), flags.out);
}

void MakePipeParts(const cad::PipeParameters& parameters, const std::string& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    throw InputError("--out", "\"" + folder + "\" is not a folder", "make it first");
  }
  const std::vector<cad::PartFile> parts = cad::GeneratePipeParts(parameters);
  const auto path_of = [&](const cad::PartFile& part) { return (std::filesystem::path(folder) / part.name).string(); };
  std::vector<Output> outputs;
  for (const cad::PartFile& part : parts) outputs.push_back({"--out", path_of(part), FileKind::kPipePart});
  RequireOutputs(outputs, {});
  for (const cad::PartFile& part : parts) {
    WriteFileAtomically(path_of(part), part.text);
    Print("{}\n", path_of(part));
  }
}

void List(bool json) {
  const std::vector<std::string> names = env::ListTasks();
  if (json) {
    PrintJson(names);
    return;
  }
  for (const std::string& name : names) Print("{}\n", name);
}

}  // namespace

void AddTaskCommand(CLI::App& app, Session& session) {
  CLI::App* task = app.add_subcommand("task", "Tasks: what is inserted into what");
  task->require_subcommand(1);
  auto flags = std::make_shared<TaskFlags>();
  CLI::App* list = task->add_subcommand("list", "Names of the tasks under models/tasks/");
  list->add_flag("--json", flags->json, "print JSON");
  list->callback([flags] { List(flags->json); });
  CLI::App* show = task->add_subcommand("show", "Axes, ranges, tolerance and contact map of a task");
  show->add_option("task", flags->task, "name, or path of a task file")->required();
  show->add_option("--opening", flags->opening, "closed or open while localizing")->capture_default_str();
  AddJobs(*show, flags->jobs, "threads, if the contact map must be built");
  show->add_flag("--json", flags->json, "print JSON");
  show->callback([flags] { Show(*flags); });
  CLI::App* render =
      task->add_subcommand("render", "A picture of a task: at the start pose, cut open, or into the mouth");
  render->add_option("task", flags->task, "name, or path of a task file")->required();
  render->add_option("--view", flags->view, "overview, close-up, section (cut open) or mouth (into the opening)")
      ->capture_default_str();
  AddReal(*render, "--depth", flags->depth_mm, -1000.0, 1000.0,
          "section: of the tool below the mouth, mm; negative: above it");
  render->add_flag("--no-lids", flags->no_lids, "section, mouth: without what closes the opening while localizing");
  render->add_option("--out", flags->out, "PNG file to write")->required();
  render->callback([flags] { Render(*flags); });
  AddTaskCheck(*task, session);
  AddTaskImport(*task, session);

  CLI::App* pipes =
      task->add_subcommand("make-pipe-parts", "Writes the parts of pipes and elbows from sizes in metres");
  auto sizes = std::make_shared<cad::PipeParameters>();
  const auto size = [&](const char* name, double& value, const char* help) {
    AddReal(*pipes, name, value, 0.0, 10.0, help);
  };
  size("--pipe-diameter", sizes->pipe_diameter_m, "outside of a pipe");
  size("--elbow-diameter", sizes->elbow_diameter_m, "outside of an elbow");
  size("--clearance", sizes->clearance_m, "between pipe and bore, on each side");
  size("--chamfer", sizes->chamfer_m, "of the rim of a bore");
  size("--bore-depth", sizes->bore_depth_m, "of a bore");
  size("--side-arm", sizes->side_arm_m, "from the axis of the socket to the end of the side arm");
  size("--socket-to-arm", sizes->socket_to_arm_m, "from the mouth of a fixed elbow to the axis of its side arm");
  size("--held-pipe", sizes->held_pipe_m, "length of the pipe in the gripper");
  size("--joint-pipe", sizes->joint_pipe_m, "length of the pipe with a branch, for structures");
  size("--lid-recess", sizes->lid_recess_m, "from the rim down to the lid that closes the bore for planning");
  pipes->add_option("--out", flags->out, "folder for the files")->required();
  pipes->callback([flags, sizes] { MakePipeParts(*sizes, flags->out); });
}

}  // namespace feeler::cli
