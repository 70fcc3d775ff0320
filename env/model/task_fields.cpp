#include "feeler/env/model/task_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/model/randomization.h"

namespace feeler::env {
namespace {

constexpr std::array kNumericFields = {
    "feeler_resolution",        "feeler_min_cells",          "feeler_max_cells",        "feeler_start_offset",
    "feeler_workspace",         "feeler_move_lengths",       "feeler_insertion_depth",  "feeler_cell",
    "feeler_tolerance_lateral", "feeler_tolerance_vertical", "feeler_tolerance_angle",  "feeler_cost",
    "feeler_flange_position",   "feeler_flange_quaternion",  "feeler_transfer_speed",   "feeler_probe_speed",
    "feeler_force_budget",      "feeler_time_per_move",      "feeler_time_per_contact", "feeler_workspace_center"};
constexpr std::array kTextFields = {"feeler_axes", "feeler_insertion_axis", "feeler_goal"};

constexpr int kMaxCells = 64;       ///< hypotheses along an axis; beyond it a number is a slip, not a wish
constexpr double kMaxLength_m = 2;  ///< of offsets, workspaces and depths: the reach of an arm
constexpr int kMaxMoveCells = 1000;

class Fields {
 public:
  Fields(const mjModel& model, std::string where) : model_(model), where_(std::move(where)) {
    for (int i = 0; i < model.nnumeric; ++i)
      CheckKnown(model.names + model.name_numericadr[i], kNumericFields, "numeric");
    for (int i = 0; i < model.ntext; ++i) CheckKnown(model.names + model.name_textadr[i], kTextFields, "text");
  }

  [[noreturn]] void Fail(const std::string& element, const std::string& field, const std::string& what,
                         const std::string& mend) const {
    throw InputError(fmt::format("{}: <custom><{} name=\"{}\">", where_, element, field), what, mend);
  }
  [[noreturn]] void FailNumber(const std::string& field, const std::string& what, const std::string& mend) const {
    Fail("numeric", field, what, mend);
  }

  bool HasNumeric(const char* field) const { return mj_name2id(&model_, mjOBJ_NUMERIC, field) >= 0; }

  /// `count` < 0: one or more.
  std::vector<double> Numbers(const char* field, int count, const std::string& meaning) const {
    const int id = mj_name2id(&model_, mjOBJ_NUMERIC, field);
    if (id < 0) FailNumber(field, "is missing", "give " + meaning + "; see docs/task-file.md");
    const int size = model_.numeric_size[id];
    if (count >= 0 && size != count) {
      FailNumber(field, fmt::format("has {} values instead of {}", size, count), "give " + meaning);
    }
    const double* data = model_.numeric_data + model_.numeric_adr[id];
    std::vector<double> values(data, data + size);
    for (const double value : values) {
      if (!std::isfinite(value)) FailNumber(field, "is not a finite number", "give finite numbers");
    }
    return values;
  }

  double Number(const char* field, const std::string& meaning, double low, double high) const {
    const double value = Numbers(field, 1, meaning)[0];
    CheckRange(field, value, low, high);
    return value;
  }

  void CheckRange(const char* field, double value, double low, double high) const {
    if (value < low || value > high) {
      FailNumber(field, fmt::format("{} is not in {} to {}", value, low, high),
                 fmt::format("give a number from {} to {}", low, high));
    }
  }

  std::vector<int> WholeNumbers(const char* field, int count, const std::string& meaning, int low, int high) const {
    std::vector<int> whole;
    for (const double value : Numbers(field, count, meaning)) {
      if (value != std::floor(value))
        FailNumber(field, fmt::format("{} is not a whole number", value), "give whole numbers");
      CheckRange(field, value, low, high);
      whole.push_back(static_cast<int>(value));
    }
    return whole;
  }

  Eigen::Vector3d Vector(const char* field, const std::string& meaning) const {
    const std::vector<double> v = Numbers(field, 3, meaning);
    return {v[0], v[1], v[2]};
  }

  std::string Text(const char* field, const std::string& meaning) const {
    const int id = mj_name2id(&model_, mjOBJ_TEXT, field);
    if (id < 0) Fail("text", field, "is missing", "give " + meaning + "; see docs/task-file.md");
    return model_.text_data + model_.text_adr[id];
  }

 private:
  /// A misspelt optional field would otherwise be ignored in silence.
  template <class Known>
  void CheckKnown(std::string_view name, const Known& known, const char* element) const {
    if (!name.starts_with("feeler_") || IsRandomizationField(name)) return;
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      Fail(element, std::string(name), "is not a field of a task", "the fields are listed in docs/task-file.md");
    }
  }

  const mjModel& model_;
  std::string where_;
};

AxisKind ParseAxis(const Fields& fields, const std::string& word) {
  for (const AxisKind kind : {AxisKind::kX, AxisKind::kY, AxisKind::kZ, AxisKind::kYaw, AxisKind::kPitch}) {
    if (word == ToString(kind)) return kind;
  }
  fields.Fail("text", "feeler_axes", "unknown axis '" + word + "'", "axes are x y z yaw pitch");
}

void ReadAxes(const Fields& fields, Task& task) {
  std::istringstream words(fields.Text("feeler_axes", "the uncertain axes, some of x y z yaw pitch"));
  for (std::string word; words >> word;) {
    const AxisKind kind = ParseAxis(fields, word);
    if (!task.axes.empty() && kind <= task.axes.back().kind) {
      fields.Fail("text", "feeler_axes", "axis '" + word + "' is repeated or out of order",
                  "name each axis once, in the order x y z yaw pitch");
    }
    task.axes.push_back({.kind = kind});
  }
  const int count = static_cast<int>(task.axes.size());
  if (count == 0) fields.Fail("text", "feeler_axes", "names no axis", "name some of x y z yaw pitch");

  const auto resolution = fields.Numbers("feeler_resolution", count, "one lattice spacing per axis of feeler_axes");
  const auto min_cells =
      fields.WholeNumbers("feeler_min_cells", count, "the smallest number of hypotheses per axis", 1, kMaxCells);
  const auto max_cells =
      fields.WholeNumbers("feeler_max_cells", count, "the largest number of hypotheses per axis", 1, kMaxCells);
  double cell_m = 0;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    UncertainAxis& axis = task.axes[k];
    axis.resolution = resolution[k];
    axis.min_cells = min_cells[k];
    axis.max_cells = max_cells[k];
    if (axis.resolution <= 0) {
      fields.FailNumber("feeler_resolution", fmt::format("{} is not positive", axis.resolution),
                        "give the spacing of the lattice, in m or rad");
    }
    if (axis.resolution > (axis.angular() ? 1.0 : 0.1)) {
      fields.FailNumber("feeler_resolution",
                        fmt::format("{} of axis {} is absurdly coarse", axis.resolution, ToString(axis.kind)),
                        "positions in m, angles in rad");
    }
    if (axis.resolution < 1e-5) {
      fields.FailNumber("feeler_resolution",
                        fmt::format("{} of axis {} is finer than the 1e-5 that collision "
                                    "detection resolves",
                                    axis.resolution, ToString(axis.kind)),
                        "give 1e-5 or more");
    }
    if (axis.min_cells > axis.max_cells) {
      fields.FailNumber(
          "feeler_min_cells",
          fmt::format("{} of axis {} exceeds feeler_max_cells {}", axis.min_cells, ToString(axis.kind), axis.max_cells),
          "give at most as many as feeler_max_cells");
    }
    if (axis.angular()) continue;
    if (cell_m != 0 && axis.resolution != cell_m) {
      fields.FailNumber("feeler_resolution",
                        fmt::format("{} of axis {} differs from {}", axis.resolution, ToString(axis.kind), cell_m),
                        "x, y and z share one lattice");
    }
    cell_m = axis.resolution;
  }
  if (fields.HasNumeric("feeler_cell") || cell_m == 0) {
    const double cell = fields.Number("feeler_cell", "the lattice spacing of positions in m", 1e-5, 0.1);
    if (cell_m != 0 && cell != cell_m) {
      fields.FailNumber("feeler_cell", fmt::format("{} contradicts feeler_resolution {}", cell, cell_m),
                        "leave it out: x, y and z share the lattice of feeler_resolution");
    }
    cell_m = cell;
  }
  task.cell_m = cell_m;
}

void ReadMotion(const Fields& fields, Task& task) {
  task.start_offset_m =
      fields.Vector("feeler_start_offset", "the start of the tool from the centre of the hypotheses, m");
  for (const double value : task.start_offset_m)
    fields.CheckRange("feeler_start_offset", value, -kMaxLength_m, kMaxLength_m);
  task.workspace_m = fields.Vector("feeler_workspace", "half extents of the tool's workspace around the start, m");
  for (const double value : task.workspace_m) fields.CheckRange("feeler_workspace", value, 0, kMaxLength_m);
  if (fields.HasNumeric("feeler_workspace_center")) {
    task.workspace_center_m = fields.Vector("feeler_workspace_center", "the centre of the workspace from the start, m");
    for (int i = 0; i < 3; ++i) {
      if (std::abs(task.workspace_center_m[i]) <= task.workspace_m[i] - 0.5 * task.cell_m) continue;
      if (task.workspace_center_m[i] == 0) continue;
      fields.FailNumber("feeler_workspace_center", "leaves the start outside of the workspace",
                        "each number is less than that of feeler_workspace");
    }
  }
  for (const UncertainAxis& axis : task.axes) {
    if (!axis.angular() && task.workspace_m[static_cast<int>(axis.kind)] < task.cell_m) {
      fields.FailNumber("feeler_workspace",
                        fmt::format("leaves the tool no room along the uncertain axis {}", ToString(axis.kind)),
                        "give at least one cell along each uncertain axis");
    }
  }
  task.move_lengths =
      fields.WholeNumbers("feeler_move_lengths", -1, "the lengths of guarded moves in cells", 1, kMaxMoveCells);
  if (std::set<int>(task.move_lengths.begin(), task.move_lengths.end()).size() != task.move_lengths.size()) {
    fields.FailNumber("feeler_move_lengths", "names a length twice", "name each once");
  }
  std::sort(task.move_lengths.begin(), task.move_lengths.end());
  if (task.move_lengths.front() != 1) {
    fields.FailNumber("feeler_move_lengths", "does not contain 1",
                      "without moves of one cell a pose cannot be pinned down");
  }

  const std::string insertion = fields.Text("feeler_insertion_axis", "the direction of the insertion, e.g. -z");
  const auto direction = ParseDirection(insertion);
  if (!direction) {
    fields.Fail("text", "feeler_insertion_axis", "'" + insertion + "' is not a direction",
                "one of +x -x +y -y +z -z, in the frame of the target");
  }
  task.insertion = *direction;
  task.insertion_depth_m =
      fields.Number("feeler_insertion_depth", "the travel from the mouth to inserted, m", 0, kMaxLength_m);
  if (task.insertion_depth_m == 0) {
    fields.FailNumber("feeler_insertion_depth", "is zero", "give the travel from the mouth to inserted, m");
  }

  const Eigen::Vector3d position = fields.Vector("feeler_flange_position", "the tool frame's origin in the flange, m");
  for (const double value : position) fields.CheckRange("feeler_flange_position", value, -kMaxLength_m, kMaxLength_m);
  const auto q = fields.Numbers("feeler_flange_quaternion", 4, "the tool frame's orientation in the flange, w x y z");
  const Eigen::Quaterniond orientation(q[0], q[1], q[2], q[3]);
  if (std::abs(orientation.norm() - 1) > 1e-3) {
    fields.FailNumber("feeler_flange_quaternion", fmt::format("has length {} instead of 1", orientation.norm()),
                      "divide its four numbers by that length; 0 1 0 0 points the tool down");
  }
  task.flange_T_tool = MakePose(position, orientation);
}

/// Where a field is absent its values are NaN: DeriveTolerances measures them.
void ReadTolerances(const Fields& fields, Task& task) {
  const auto positive = [&](const char* field, std::size_t axes, const std::string& meaning, double high) {
    if (!fields.HasNumeric(field)) return std::vector<double>{std::numeric_limits<double>::quiet_NaN()};
    std::vector<double> values = fields.Numbers(field, -1, meaning);
    if (values.size() != 1 && values.size() != axes) {
      fields.FailNumber(field, fmt::format("has {} values instead of 1 or {}", values.size(), axes), "give " + meaning);
    }
    for (const double value : values) {
      fields.CheckRange(field, value, 0, high);
      if (value == 0) fields.FailNumber(field, "is zero", "no real insertion has no tolerance");
    }
    return values;
  };
  const auto lateral = positive("feeler_tolerance_lateral", 2,
                                "the largest error across the insertion, m: one number, or one per axis", 0.1);
  const int along = AxisOf(task.insertion);
  Eigen::Vector3d per_axis = Eigen::Vector3d::Constant(lateral.front());
  per_axis[along == 2 ? 1 : 2] = lateral.back();
  SetLateral(task.tolerance, task.insertion, per_axis);
  const double derived_m = std::min(0.002, 0.2 * task.insertion_depth_m);
  task.tolerance.vertical_m = derived_m;
  if (fields.HasNumeric("feeler_tolerance_vertical")) {
    task.tolerance.vertical_m =
        positive("feeler_tolerance_vertical", 1, "the largest error along the insertion, m", 0.1).front();
  }
  const auto angle = positive("feeler_tolerance_angle", 3,
                              "the largest error of the orientation, rad: one number, or one about each axis", 1);
  SetAngles(task.tolerance, {angle.front(), angle[angle.size() / 2], angle.back()});
}

void ReadVerdict(const Fields& fields, Task& task) {
  ReadTolerances(fields, task);
  if (task.tolerance.vertical_m >= task.insertion_depth_m) {
    fields.FailNumber(
        "feeler_tolerance_vertical",
        fmt::format("{} is not below feeler_insertion_depth {}", task.tolerance.vertical_m, task.insertion_depth_m),
        "give less than the depth: with as much, doing nothing would be inserted");
  }

  const auto cost =
      fields.Numbers("feeler_cost", -1, "cost per cell (one, or one per axis), per contact and per action");
  for (const double weight : cost) fields.CheckRange("feeler_cost", weight, 0, 1e6);
  if (cost.size() == 5) {
    task.cost = CostPerAxis({cost[0], cost[1], cost[2]}, cost[3], cost[4]);
  } else if (cost.size() == 3) {
    task.cost = {cost[0], cost[1], cost[2]};
  } else {
    fields.FailNumber(
        "feeler_cost", fmt::format("has {} values instead of 3", cost.size()),
        "give 3: cost per cell, per contact and per action; or 5: per cell along x, y, z, then the others");
  }
  if (task.cost.per_cell == 0 && task.cost.per_action == 0) {
    fields.FailNumber("feeler_cost", "is zero per cell and per action", "a move must cost something");
  }

  const auto optional = [&](const char* field, double low, double high, double& value) {
    if (fields.HasNumeric(field)) value = fields.Number(field, "one number", low, high);
  };
  optional("feeler_transfer_speed", 1e-4, 10.0, task.times.transfer_speed_m_s);
  optional("feeler_probe_speed", 1e-4, 10.0, task.times.probe_speed_m_s);
  optional("feeler_force_budget", 1e-3, 1e6, task.force_budget_n);
  optional("feeler_time_per_move", 0.0, 100.0, task.times.time_per_move_s);
  optional("feeler_time_per_contact", 0.0, 100.0, task.times.time_per_contact_s);

  const std::string goal = fields.Text("feeler_goal", "singleton or insertable");
  if (goal == ToString(GoalKind::kSingleton)) {
    task.goal = GoalKind::kSingleton;
  } else if (goal == ToString(GoalKind::kInsertable)) {
    task.goal = GoalKind::kInsertable;
  } else {
    fields.Fail("text", "feeler_goal", "unknown goal '" + goal + "'", "singleton or insertable");
  }
}

}  // namespace

Task ReadTaskFields(const mjModel& model, const std::string& where) {
  const Fields fields(model, where);
  Task task;
  ReadAxes(fields, task);
  ReadMotion(fields, task);
  ReadVerdict(fields, task);
  ReadRandomization(model, where);  // for its errors; the scene reads the ranges
  return task;
}

}  // namespace feeler::env
