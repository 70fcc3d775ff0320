#include "planner/preprocess/problem_family.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/random.h"

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

/// The axes that the parts of a text stand for: x, y and z if there are three, else the uncertain position axes of the
/// task if there are as many. Empty: neither.
std::vector<std::size_t> AxesOf(std::size_t parts, const Task* task) {
  if (parts == 3) return {0, 1, 2};
  std::vector<std::size_t> axes;
  if (task == nullptr) return axes;
  for (const UncertainAxis& axis : task->axes) {
    if (!axis.angular()) axes.push_back(static_cast<std::size_t>(axis.kind));
  }
  return axes.size() == parts ? axes : std::vector<std::size_t>();
}

/// "x, y" of a task with these axes.
std::string AxisNames(const Task& task) {
  std::string names;
  for (const UncertainAxis& axis : task.axes) {
    if (!axis.angular()) names += (names.empty() ? "" : ", ") + std::string(ToString(axis.kind));
  }
  return names;
}

std::string OrForTask(const Task* task) {
  if (task == nullptr) return "";
  const std::string names = AxisNames(*task);
  return names.empty() || names == "x, y, z" ? "" : fmt::format(", or for the axes {} of {} only", names, task->name);
}

ProblemFamily Enumerate(const std::array<std::pair<int, int>, 3>& ranges, std::string spec) {
  ProblemFamily family;
  family.spec = std::move(spec);
  for (int x = ranges[0].first; x <= ranges[0].second; ++x) {
    for (int y = ranges[1].first; y <= ranges[1].second; ++y) {
      for (int z = ranges[2].first; z <= ranges[2].second; ++z) family.problems.push_back({x, y, z});
    }
  }
  return family;
}

Extents ParseExtentsFor(std::string_view text, const Task* task) {
  const std::vector<std::string_view> parts = Split(text, 'x');
  const std::vector<std::size_t> axes = AxesOf(parts.size(), task);
  std::array<int, 3> counts = {1, 1, 1};
  bool good = !axes.empty();
  for (std::size_t i = 0; good && i < axes.size(); ++i) good = ParseCount(parts[i], counts[axes[i]]);
  if (!good) {
    throw InputError(fmt::format("extents '{}'", text), "not three counts",
                     fmt::format("write them as 7x7x5, each from 1 to {}{}", kMostPerAxis, OrForTask(task)));
  }
  return {counts[0], counts[1], counts[2]};
}

ProblemFamily ParseFamilyFor(std::string_view spec, const Task* task) {
  const std::vector<std::string_view> parts = Split(spec, 'x');
  const std::vector<std::size_t> axes = AxesOf(parts.size(), task);
  std::array<std::pair<int, int>, 3> ranges = {{{1, 1}, {1, 1}, {1, 1}}};
  bool good = !axes.empty();
  for (std::size_t i = 0; good && i < axes.size(); ++i) good = ParseRange(parts[i], ranges[axes[i]]);
  if (!good) {
    throw InputError(
        fmt::format("family '{}'", spec), "not three ranges of counts",
        fmt::format("write it as 2..15x2..15x2..15 or 7x7x5, counts from 1 to {}{}", kMostPerAxis, OrForTask(task)));
  }
  return Enumerate(ranges, std::string(spec));
}

}  // namespace

std::string ToString(const Extents& extents) { return fmt::format("{}x{}x{}", extents.nx, extents.ny, extents.nz); }

Extents ParseExtents(std::string_view text) { return ParseExtentsFor(text, nullptr); }

Extents ParseExtents(std::string_view text, const Task& task) { return ParseExtentsFor(text, &task); }

Problem MakeCuboidProblem(const Task& task, std::shared_ptr<const ContactMap> map, const Extents& extents) {
  Problem problem;
  problem.name = fmt::format("{} {}", task.name, ToString(extents));
  problem.map = std::move(map);
  if (!problem.map) throw InputError(problem.name, "no contact map");
  const int orientations = problem.map->orientations();
  problem.hypotheses.reserve(static_cast<std::size_t>(extents.Count()) * static_cast<std::size_t>(orientations));
  for (int x = 0; x < extents.nx; ++x) {
    for (int y = 0; y < extents.ny; ++y) {
      for (int z = 0; z < extents.nz; ++z) {
        for (int o = 0; o < orientations; ++o) problem.hypotheses.push_back({Cell(x, y, z), o, 1.0});
      }
    }
  }
  Cell reach;
  for (int axis = 0; axis < 3; ++axis) {
    const double centre = (extents[axis] - 1) / 2.0;
    problem.start[axis] = static_cast<int>(std::floor(centre + task.start_offset_m[axis] / task.cell_m + 1e-9));
    reach[axis] = static_cast<int>(std::floor(task.workspace_m[axis] / task.cell_m + 1e-9));
    const bool along_insertion = axis == AxisOf(task.insertion);
    const double tolerance_m = along_insertion ? task.tolerance.vertical_m : task.tolerance.lateral_m;
    // The truth lies half a cell around a lattice point, so a spread of k cells needs a motion that forgives (k+1)/2.
    problem.insertable_spread[axis] =
        std::max(0, static_cast<int>(std::floor(2.0 * tolerance_m / task.cell_m - 1.0 + 1e-9)));
  }
  problem.workspace = {problem.start - reach, problem.start + reach};
  problem.move_lengths = task.move_lengths;
  problem.cost = task.cost;
  problem.goal = task.goal;
  problem.generous_workspace = true;
  Validate(problem);
  return problem;
}

ProblemFamily ParseProblemFamily(std::string_view spec) { return ParseFamilyFor(spec, nullptr); }

ProblemFamily ParseProblemFamily(std::string_view spec, const Task& task) { return ParseFamilyFor(spec, &task); }

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

ProblemFamily FamilyOf(const Task& task) {
  std::array<std::pair<int, int>, 3> ranges = {{{1, 1}, {1, 1}, {1, 1}}};
  for (const UncertainAxis& axis : task.axes) {
    if (!axis.angular()) ranges[static_cast<std::size_t>(axis.kind)] = {axis.min_cells, axis.max_cells};
  }
  std::string spec;
  for (const auto& [low, high] : ranges) {
    spec += (spec.empty() ? "" : "x") + (low == high ? fmt::format("{}", low) : fmt::format("{}..{}", low, high));
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
