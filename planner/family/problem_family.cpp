#include "feeler/planner/family/problem_family.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/orientation_lattice.h"
#include "feeler/core/random.h"

namespace feeler::planner {
namespace {

constexpr int kMostPerAxis = 64;

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

bool ParseCount(std::string_view text, int& count) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  return error == std::errc() && end == text.data() + text.size() && count >= 1 && count <= kMostPerAxis;
}

/// "2..15" or "7".
bool ParseRange(std::string_view text, std::pair<int, int>& range) {
  const std::size_t dots = text.find("..");
  if (dots == std::string_view::npos) {
    return ParseCount(text, range.first) && ParseCount(text, range.second);
  }
  return ParseCount(text.substr(0, dots), range.first) && ParseCount(text.substr(dots + 2), range.second) &&
         range.first <= range.second;
}

constexpr std::array<AxisKind, kAxisKinds> kAllAxes = {AxisKind::kX, AxisKind::kY, AxisKind::kZ, AxisKind::kYaw,
                                                       AxisKind::kPitch};

/// The axes that the parts of a text stand for: those given if there are as many, else x, y and z, or all. Empty:
/// none of these.
std::vector<AxisKind> AxesFor(std::size_t parts, const std::vector<AxisKind>& axes) {
  if (parts == axes.size()) return axes;
  if (parts == 3 || parts == kAxisKinds) return {kAllAxes.begin(), kAllAxes.begin() + static_cast<int>(parts)};
  return {};
}

using Ranges = std::array<std::pair<int, int>, kAxisKinds>;
constexpr Ranges kOneEach = {{{1, 1}, {1, 1}, {1, 1}, {1, 1}, {1, 1}}};

/// What to write: "counts" as 7x7x5, or for the axes of a task.
std::string HowToWrite(const std::string& counts, const std::vector<AxisKind>& axes) {
  std::string names;
  for (const AxisKind axis : axes) names += (names.empty() ? "" : ", ") + std::string(ToString(axis));
  const std::string of = names.empty() ? "x, y, z" : names;
  return fmt::format("write {} for the axes {}, each from 1 to {}", counts, of, kMostPerAxis);
}

ProblemFamily Enumerate(const Ranges& ranges, std::string spec) {
  ProblemFamily family;
  family.spec = std::move(spec);
  Extents at;
  for (at.nx = ranges[0].first; at.nx <= ranges[0].second; ++at.nx) {
    for (at.ny = ranges[1].first; at.ny <= ranges[1].second; ++at.ny) {
      for (at.nz = ranges[2].first; at.nz <= ranges[2].second; ++at.nz) {
        for (at.n_yaw = ranges[3].first; at.n_yaw <= ranges[3].second; ++at.n_yaw) {
          for (at.n_pitch = ranges[4].first; at.n_pitch <= ranges[4].second; ++at.n_pitch)
            family.problems.push_back(at);
        }
      }
    }
  }
  return family;
}

ProblemFamily ParseFamilyFor(std::string_view spec, const std::vector<AxisKind>& known) {
  const std::vector<std::string_view> parts = Split(spec, 'x');
  const std::vector<AxisKind> axes = AxesFor(parts.size(), known);
  Ranges ranges = kOneEach;
  bool good = !axes.empty();
  for (std::size_t i = 0; good && i < axes.size(); ++i) {
    good = ParseRange(parts[i], ranges[static_cast<std::size_t>(axes[i])]);
  }
  if (!good) {
    throw InputError(fmt::format("family '{}'", spec), fmt::format("not {} ranges of counts", known.size()),
                     HowToWrite("ranges such as 2..15 or counts, joined by x,", known));
  }
  return Enumerate(ranges, std::string(spec));
}

const std::vector<AxisKind> kPositions = {AxisKind::kX, AxisKind::kY, AxisKind::kZ};

std::string Joined(const std::vector<int>& counts) {
  std::string text;
  for (const int count : counts) text += fmt::format("{}{}", text.empty() ? "" : "x", count);
  return text;
}

}  // namespace

std::vector<AxisKind> AxesOf(const Task& task) {
  std::vector<AxisKind> axes;
  for (const UncertainAxis& axis : task.axes) axes.push_back(axis.kind);
  return axes;
}

std::vector<int> ExtentsPerAxis(const std::vector<AxisKind>& axes, const Extents& extents) {
  std::vector<int> counts;
  counts.reserve(axes.size());
  for (const AxisKind axis : axes) counts.push_back(extents[axis]);
  return counts;
}

Extents ExtentsAlong(const std::vector<AxisKind>& axes, const std::vector<int>& counts) {
  std::array<int, kAxisKinds> all = {1, 1, 1, 1, 1};
  for (std::size_t i = 0; i < axes.size() && i < counts.size(); ++i) {
    all[static_cast<std::size_t>(axes[i])] = counts[i];
  }
  return {all[0], all[1], all[2], all[3], all[4]};
}

std::string ToString(const Extents& extents) {
  std::string positions = fmt::format("{}x{}x{}", extents.nx, extents.ny, extents.nz);
  if (extents.n_yaw == 1 && extents.n_pitch == 1) return positions;
  return fmt::format("{}x{}x{}", positions, extents.n_yaw, extents.n_pitch);
}

std::string ToString(const Extents& extents, const std::vector<AxisKind>& axes) {
  const std::vector<int> counts = ExtentsPerAxis(axes, extents);
  return ExtentsAlong(axes, counts) == extents && !axes.empty() ? Joined(counts) : ToString(extents);
}

std::string ToString(const Extents& extents, const Task& task) { return ToString(extents, AxesOf(task)); }

Extents ParseExtents(std::string_view text) { return ParseExtents(text, kPositions); }

Extents ParseExtents(std::string_view text, const std::vector<AxisKind>& known) {
  const std::vector<std::string_view> parts = Split(text, 'x');
  const std::vector<AxisKind> axes = AxesFor(parts.size(), known);
  std::vector<int> counts(axes.size(), 1);
  bool good = !axes.empty();
  for (std::size_t i = 0; good && i < axes.size(); ++i) good = ParseCount(parts[i], counts[i]);
  if (!good) {
    throw InputError(fmt::format("extents '{}'", text), fmt::format("not {} counts", known.size()),
                     HowToWrite(fmt::format("counts such as {}", Joined(std::vector<int>(known.size(), 5))), known));
  }
  return ExtentsAlong(axes, counts);
}

Extents ParseExtents(std::string_view text, const Task& task) { return ParseExtents(text, AxesOf(task)); }

std::vector<int> ToCounts(const Extents& extents) {
  std::vector<int> counts = {extents.nx, extents.ny, extents.nz};
  if (extents.n_yaw > 1 || extents.n_pitch > 1) counts.insert(counts.end(), {extents.n_yaw, extents.n_pitch});
  return counts;
}

Extents FromCounts(const std::vector<int>& counts) {
  Extents extents{counts.at(0), counts.at(1), counts.at(2)};
  if (counts.size() == 5) {
    extents.n_yaw = counts[3];
    extents.n_pitch = counts[4];
  }
  return extents;
}

Problem MakeCuboidProblem(const Task& task, std::shared_ptr<const ContactMap> map, const Extents& extents) {
  Problem problem;
  problem.name = fmt::format("{} {}", task.name, ToString(extents, task));
  problem.map = std::move(map);
  if (!problem.map) throw InputError(problem.name, "no contact map", "give the map of the task");
  const int yaws = LatticeAngles(task, AxisKind::kYaw);
  const int pitches = LatticeAngles(task, AxisKind::kPitch);
  if (problem.map->orientations() != yaws * pitches) {
    throw InputError(
        problem.name,
        fmt::format("the contact map has {} orientations, the task {}", problem.map->orientations(), yaws * pitches),
        "build the map of this task");
  }
  if (extents.n_yaw > yaws || extents.n_pitch > pitches) {
    throw InputError(problem.name, fmt::format("the task has {} yaw and {} pitch angles", yaws, pitches),
                     "ask for fewer, or raise feeler_max_cells in the task file");
  }
  problem.pitches = pitches;
  const int first_yaw = FirstAngle(extents.n_yaw, yaws);
  const int first_pitch = FirstAngle(extents.n_pitch, pitches);
  problem.hypotheses.reserve(static_cast<std::size_t>(extents.Count()));
  for (int x = 0; x < extents.nx; ++x) {
    for (int y = 0; y < extents.ny; ++y) {
      for (int z = 0; z < extents.nz; ++z) {
        for (int yaw = first_yaw; yaw < first_yaw + extents.n_yaw; ++yaw) {
          for (int pitch = first_pitch; pitch < first_pitch + extents.n_pitch; ++pitch) {
            problem.hypotheses.push_back({Cell(x, y, z), yaw * pitches + pitch, 1.0});
          }
        }
      }
    }
  }
  const Cell cuboid(extents.nx, extents.ny, extents.nz);
  problem.start = StartCell(task, cuboid);
  problem.workspace = WorkspaceCells(task, cuboid);
  for (int axis = 0; axis < 3; ++axis) {
    const bool along_insertion = axis == AxisOf(task.insertion);
    const double tolerance_m = along_insertion ? task.tolerance.vertical_m : task.tolerance.Lateral(axis);
    // The truth lies half a cell around a lattice point, so a spread of k cells needs a motion that forgives (k+1)/2.
    problem.insertable_spread[axis] =
        std::max(0, static_cast<int>(std::floor(2.0 * tolerance_m / task.cell_m - 1.0 + 1e-9)));
  }
  problem.move_lengths = task.move_lengths;
  problem.cost = task.cost;
  problem.goal = task.goal;
  problem.generous_workspace = true;
  Validate(problem);
  return problem;
}

ProblemFamily ParseProblemFamily(std::string_view spec) { return ParseFamilyFor(spec, kPositions); }

ProblemFamily ParseProblemFamily(std::string_view spec, const Task& task) { return ParseFamilyFor(spec, AxesOf(task)); }

ProblemFamily UnionOf(const std::vector<ProblemFamily>& families, std::string spec) {
  ProblemFamily all;
  all.spec = std::move(spec);
  for (const ProblemFamily& family : families) {
    all.problems.insert(all.problems.end(), family.problems.begin(), family.problems.end());
  }
  std::ranges::sort(all.problems);
  all.problems.erase(std::unique(all.problems.begin(), all.problems.end()), all.problems.end());
  return all;
}

Extents LargestExtents(const ProblemFamily& family) {
  Extents largest;
  for (const Extents& extents : family.problems) {
    largest.nx = std::max(largest.nx, extents.nx);
    largest.ny = std::max(largest.ny, extents.ny);
    largest.nz = std::max(largest.nz, extents.nz);
    largest.n_yaw = std::max(largest.n_yaw, extents.n_yaw);
    largest.n_pitch = std::max(largest.n_pitch, extents.n_pitch);
  }
  return largest;
}

void RequireWithinTask(const ProblemFamily& family, const Task& task) {
  std::array<int, kAxisKinds> largest = {1, 1, 1, 1, 1};
  for (const UncertainAxis& axis : task.axes) largest[static_cast<std::size_t>(axis.kind)] = axis.max_cells;
  for (const Extents& extents : family.problems) {
    for (int axis = 0; axis < kAxisKinds; ++axis) {
      const int most = largest[static_cast<std::size_t>(axis)];
      if (extents[axis] >= 1 && extents[axis] <= most) continue;
      throw InputError("problem " + ToString(extents, task),
                       fmt::format("task {} allows 1..{} {} along {}", task.name, most, axis < 3 ? "cells" : "angles",
                                   ToString(static_cast<AxisKind>(axis))),
                       "change the family, or the ranges in the task file");
    }
  }
}

ProblemFamily FamilyOf(const Task& task) {
  Ranges ranges = kOneEach;
  std::string spec;
  for (const UncertainAxis& axis : task.axes) {
    ranges[static_cast<std::size_t>(axis.kind)] = {axis.min_cells, axis.max_cells};
    spec += spec.empty() ? "" : "x";
    spec += axis.min_cells == axis.max_cells ? fmt::format("{}", axis.min_cells)
                                             : fmt::format("{}..{}", axis.min_cells, axis.max_cells);
  }
  return Enumerate(ranges, spec);
}

std::vector<std::size_t> OrderOf(const ProblemFamily& family, ProblemOrder order, std::uint64_t seed) {
  std::vector<std::size_t> indices(family.problems.size());
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  if (order == ProblemOrder::kUncertainty) {
    std::ranges::stable_sort(indices, {}, [&](std::size_t i) { return family.problems[i].Count(); });
  } else {
    RandomStream random(seed, 0, "problem order");
    for (std::size_t i = indices.size(); i > 1; --i) std::swap(indices[i - 1], indices[random.Index(i)]);
  }
  return indices;
}

}  // namespace feeler::planner
