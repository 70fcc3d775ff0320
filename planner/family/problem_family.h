#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

/// Number of hypotheses of a cuboid start belief along each axis that a target can be uncertain in.
struct Extents {
  int nx = 1, ny = 1, nz = 1, n_yaw = 1, n_pitch = 1;
  int Count() const { return nx * ny * nz * n_yaw * n_pitch; }
  int operator[](AxisKind axis) const { return (*this)[static_cast<int>(axis)]; }
  int operator[](int axis) const {
    return axis == 0 ? nx : axis == 1 ? ny : axis == 2 ? nz : axis == 3 ? n_yaw : n_pitch;
  }
  /// Lexicographic: x, y, z, yaw, pitch.
  auto operator<=>(const Extents&) const = default;
};
inline constexpr int kAxisKinds = 5;

/// The uncertain axes of a task, in its order.
std::vector<AxisKind> AxesOf(const Task& task);
/// Counts along these axes, in their order.
std::vector<int> ExtentsPerAxis(const std::vector<AxisKind>& axes, const Extents& extents);
/// The extents with these counts along these axes, 1 along the others.
Extents ExtentsAlong(const std::vector<AxisKind>& axes, const std::vector<int>& counts);

/// "7x7x5": along x, y, z; "10x10x1x6x6" (yaw and pitch as well) where an angle has more than one.
std::string ToString(const Extents& extents);
/// As the task counts: one number per axis, "10x10x6x6" for x, y, yaw, pitch. In full where an axis that is not named
/// has more than one.
std::string ToString(const Extents& extents, const std::vector<AxisKind>& axes);
std::string ToString(const Extents& extents, const Task& task);
/// Parses "7x7x5" or "10x10x1x6x6". Throws InputError if it is not three or five positive counts of at most 64.
Extents ParseExtents(std::string_view text);
/// The same for a task: as many counts as it has axes are counts along these, in their order; else as above.
Extents ParseExtents(std::string_view text, const std::vector<AxisKind>& axes);
Extents ParseExtents(std::string_view text, const Task& task);

/// As files and messages hold them: three counts (x, y, z), five (and yaw, pitch) where an angle has more than one.
std::vector<int> ToCounts(const Extents& extents);
/// The way back. Throws std::out_of_range for fewer than three counts.
Extents FromCounts(const std::vector<int>& counts);

/// The problem of a cuboid of hypotheses: offsets {0..n-1} per axis, lexicographic (x slowest, then y, z, yaw, pitch),
/// the estimate at the cuboid's centre. The angles are the central ones of the task's lattice of orientations
/// (core/orientation_lattice.h), which are the layers of the map. Start cell per axis: floor((n-1)/2 +
/// start_offset/cell + 1e-9). Workspace: the task's half extents around the start cell. Validates; throws InputError if
/// the map has other orientations than the task, or the task fewer angles than the extents.
Problem MakeCuboidProblem(const Task& task, std::shared_ptr<const ContactMap> map, const Extents& extents);

/// The finite set of problems that can be met online.
struct ProblemFamily {
  std::vector<Extents> problems;  ///< distinct, in lexicographic order
  std::string spec;               ///< what it was parsed from
};

/// Parses "2..15x2..15x2..15" (ranges or single counts per axis, as ParseExtents does). Throws InputError on nonsense.
ProblemFamily ParseProblemFamily(std::string_view spec);
/// The same for a task: one range or count per axis of the task, in its order, or as above.
ProblemFamily ParseProblemFamily(std::string_view spec, const Task& task);
/// The problems of all the families, each once, in lexicographic order. `spec` is kept as it is.
ProblemFamily UnionOf(const std::vector<ProblemFamily>& families, std::string spec);
/// The largest extents along each axis (of no problem together, perhaps): tables for it serve the whole family.
Extents LargestExtents(const ProblemFamily& family);
/// The family the task file gives by the ranges of its axes (an axis that is not uncertain has extent 1).
ProblemFamily FamilyOf(const Task& task);

/// Throws InputError unless every problem of the family lies within the axes of the task and their largest extents.
void RequireWithinTask(const ProblemFamily& family, const Task& task);

enum class ProblemOrder {
  kUncertainty,  ///< increasing number of hypotheses (Algorithm 3, line 3); ties lexicographic
  kRandom,       ///< shuffled by the seed (the paper's ablation)
};

/// Indices into `family.problems` in the order in which they are to be solved.
std::vector<std::size_t> OrderOf(const ProblemFamily& family, ProblemOrder order, std::uint64_t seed);

}  // namespace feeler::planner
