#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"
#include "feeler/core/pose.h"

namespace feeler {

/// An axis along which the pose of the target is uncertain.
enum class AxisKind { kX, kY, kZ, kYaw, kPitch };
std::string_view ToString(AxisKind kind);

struct UncertainAxis {
  AxisKind kind = AxisKind::kX;
  double resolution = 0.002;  ///< lattice spacing, m or rad
  int min_cells = 2;          ///< smallest extent of a start belief along this axis, in hypotheses
  int max_cells = 15;         ///< largest extent
  bool angular() const { return kind == AxisKind::kYaw || kind == AxisKind::kPitch; }
};

/// Cost of a guarded move = cost per cell along its axis * cells travelled + per_contact * contact + per_action.
struct CostWeights {
  double per_cell = 1.0;  ///< along the axis where a cell costs least
  double per_contact = 0.0;
  double per_action = 0.0;
  /// What a cell along x, y, z costs beyond that: not negative, at least one of them 0. All 0: one number for all axes.
  std::array<double, 3> beyond_per_cell{};

  double PerCell(int axis) const { return per_cell + beyond_per_cell[static_cast<std::size_t>(axis)]; }
  bool one_per_cell() const { return beyond_per_cell == std::array<double, 3>{}; }
  double Of(const Outcome& outcome, Direction direction) const {
    return PerCell(AxisOf(direction)) * outcome.cells + (outcome.contact ? per_contact : 0.0) + per_action;
  }
  bool operator==(const CostWeights&) const = default;
};
/// The weights with one cost of a cell per axis.
CostWeights CostPerAxis(const std::array<double, 3>& per_cell, double per_contact, double per_action);

/// What the cost of a policy counts: what the task file says (distance, as a rule), or seconds on the robot.
enum class CostKind { kDistance, kTime };
std::string_view ToString(CostKind kind);

/// How long localizing motions take, for costs in seconds. A way of some length takes (length / speed), where speed is
/// what a longer way gains: motions are short, and setting out and stopping is in time_per_move_s. The defaults are
/// measured on the simulated arm (docs/planner.md).
struct MotionTimes {
  double transfer_speed_m_s = 0.09;  ///< over ways known to be free
  double probe_speed_m_s = 0.047;    ///< over ways where a contact may come
  double time_per_move_s = 0.09;     ///< setting out and stopping
  double time_per_contact_s = 0.13;  ///< coming off the wall and zeroing the sensor
  bool operator==(const MotionTimes&) const = default;
};

/// When a belief counts as localized: one hypothesis left (the paper's), or all that are left are inserted by one
/// motion within the tolerance of the task.
enum class GoalKind { kSingleton, kInsertable };
std::string_view ToString(GoalKind kind);

/// Largest error of the estimated target pose with which an insertion still succeeds.
struct Tolerance {
  double lateral_m = 0.001;   ///< across the insertion axis, along the axis that allows least
  double vertical_m = 0.002;  ///< along the insertion axis
  double angle_rad = 0.03;    ///< of the turn; where axes differ, about the one that allows least
  /// What the axes of the target frame allow beyond that.
  Eigen::Vector3d lateral_beyond_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d angle_beyond_rad = Eigen::Vector3d::Zero();

  double Lateral(int axis) const { return lateral_m + lateral_beyond_m[axis]; }
  double LargestLateral() const { return lateral_m + lateral_beyond_m.maxCoeff(); }
  double Angle(int axis) const { return angle_rad + angle_beyond_rad[axis]; }
  bool one_lateral() const { return lateral_beyond_m.isZero(0.0); }
  bool one_angle() const { return angle_beyond_rad.isZero(0.0); }
};
/// Of three values, one per axis of the target frame; the one along the insertion does not count.
void SetLateral(Tolerance& tolerance, Direction insertion, Eigen::Vector3d lateral_m);
/// Of turns about the axes of the target frame, rad.
void SetAngles(Tolerance& tolerance, const Eigen::Vector3d& angle_rad);

/// What is inserted into what: the numbers of a task file (docs/task-file.md), without its geometry.
///
/// Frames: the tool frame sits at the reference point of the tool (the tip of a plug), the target frame at the mouth of
/// the opening, axes parallel when aligned; with coinciding frames the tool is about to enter along `insertion`.
/// Lattice: the tool at lattice cell r and the target at hypothesis offset h are displaced by
/// (r - h + phase) * cell_m in the axes of the estimated target frame.
struct Task {
  std::string name;
  std::string file;  ///< path of the task file it came from
  std::vector<UncertainAxis> axes;
  double cell_m = 0.002;                    ///< lattice spacing of positions and of guarded moves
  Eigen::Vector3d start_offset_m{0, 0, 0};  ///< tool frame from the centre of the hypotheses at the start pose
  Direction insertion = Direction::kMinusZ;
  double insertion_depth_m = 0.0;  ///< travel from the mouth to fully inserted
  Tolerance tolerance;
  CostWeights cost;
  MotionTimes times;
  /// No contact of tool and target is to push harder, N: how fast the tool may come follows from it
  /// (execution/contact/force_budget.h). Not of the geometry: a budget changes speeds, not what a policy may do.
  double force_budget_n = 25.0;
  GoalKind goal = GoalKind::kSingleton;
  std::vector<int> move_lengths = {1, 2, 4, 8, 16};
  Eigen::Vector3d workspace_m{0.2, 0.2, 0.1};   ///< half extents of the workspace of the tool
  Eigen::Vector3d workspace_center_m{0, 0, 0};  ///< its centre, from the start pose
  /// The parts are round about the insertion axis where they mate: a turn about it is no error of an insertion.
  bool turns_freely = false;
  Pose world_T_target = Pose::Identity();  ///< nominal pose of the target, as the file places it
  Pose flange_T_tool = Pose::Identity();   ///< how the robot holds the tool
};

/// The weights in seconds that the times of the task come to.
CostWeights TimeCost(const Task& task);

/// The angle of a rotation between tool and target that an insertion feels: all of it, or, where the parts turn freely,
/// that between their insertion axes. Radians, 0 to pi.
double InsertionAngle(const Task& task, const Eigen::Matrix3d& rotation);

/// Number of hypotheses along x, y and z at the extents given for the uncertain axes of the task (1 along a certain
/// axis), in the order of task.axes. Angular axes do not count.
Cell PositionExtents(const Task& task, const std::vector<int>& extents);
/// The largest of them.
Cell LargestPositionExtents(const Task& task);
/// Lattice cell of the tool at the start pose of a problem with `extents` hypotheses:
/// floor((n - 1)/2 + start_offset/cell) per axis.
Cell StartCell(const Task& task, const Cell& extents);
/// The cells that the tool may be in for that problem: workspace_m around the start cell, moved by workspace_center_m.
CellBox WorkspaceCells(const Task& task, const Cell& extents);
/// Every displacement r - h that some problem of the task can meet.
CellBox DisplacementsOf(const Task& task);

}  // namespace feeler
