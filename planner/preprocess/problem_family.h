#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/task.h"
#include "planner/belief/problem.h"

namespace feeler::planner {

/// Number of hypotheses along x, y and z of a cuboid start belief.
struct Extents {
  int nx = 1, ny = 1, nz = 1;
  int Count() const { return nx * ny * nz; }
  int operator[](int axis) const { return axis == 0 ? nx : axis == 1 ? ny : nz; }
  auto operator<=>(const Extents&) const = default;
};

/// "7x7x5".
std::string ToString(const Extents& extents);
/// Parses "7x7x5". Throws InputError if it is not three positive counts of at most 64.
Extents ParseExtents(std::string_view text);
/// The same for a task: beside three counts, one per uncertain position axis of the task, in its order ("7x7" of a task
/// with the axes x and y is 7x7x1).
Extents ParseExtents(std::string_view text, const Task& task);

/// The problem of a cuboid of hypotheses: offsets {0..n-1} per axis, lexicographic (x slowest, z fastest, orientation
/// of the map fastest of all), the estimate at the cuboid's centre. Start cell per axis: floor((n-1)/2 +
/// start_offset/cell + 1e-9). Workspace: the task's half extents around the start cell. Validates.
Problem MakeCuboidProblem(const Task& task, std::shared_ptr<const ContactMap> map, const Extents& extents);

/// The finite set of problems that can be met online.
struct ProblemFamily {
  std::vector<Extents> problems;  ///< distinct, in lexicographic order
  std::string spec;               ///< what it was parsed from
};

/// Parses "2..15x2..15x2..15" (ranges or single counts per axis). Throws InputError on nonsense.
ProblemFamily ParseProblemFamily(std::string_view spec);
/// The same for a task: ranges or counts of x, y and z, or one per uncertain position axis of the task, in its order.
ProblemFamily ParseProblemFamily(std::string_view spec, const Task& task);
/// The problems of all the families, each once, in lexicographic order. `spec` is kept as it is.
ProblemFamily UnionOf(const std::vector<ProblemFamily>& families, std::string spec);
/// The family the task file gives by the ranges of its axes (an axis that is not uncertain has extent 1).
ProblemFamily FamilyOf(const Task& task);

enum class ProblemOrder {
  kUncertainty,  ///< increasing number of hypotheses (Algorithm 3, line 3); ties lexicographic
  kRandom,       ///< shuffled by the seed (the paper's ablation)
};

/// Indices into `family.problems` in the order in which they are to be solved.
std::vector<std::size_t> OrderOf(const ProblemFamily& family, ProblemOrder order, std::uint64_t seed);

}  // namespace feeler::planner
