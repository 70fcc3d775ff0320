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

}  // namespace

std::string ToString(const Extents& extents) { return fmt::format("{}x{}x{}", extents.nx, extents.ny, extents.nz); }

Extents ParseExtents(std::string_view text) {
  const std::vector<std::string_view> parts = Split(text, 'x');
  Extents extents;
  if (parts.size() != 3 || !ParseCount(parts[0], extents.nx) || !ParseCount(parts[1], extents.ny) ||
      !ParseCount(parts[2], extents.nz)) {
    throw InputError(fmt::format("extents '{}'", text), "not three counts",
                     fmt::format("write them as 7x7x5, each from 1 to {}", kMostPerAxis));
  }
  return extents;
}

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

ProblemFamily ParseProblemFamily(std::string_view spec) {
  const std::vector<std::string_view> parts = Split(spec, 'x');
  std::array<std::pair<int, int>, 3> ranges;
  bool good = parts.size() == 3;
  for (std::size_t axis = 0; good && axis < 3; ++axis) good = ParseRange(parts[axis], ranges[axis]);
  if (!good) {
    throw InputError(fmt::format("family '{}'", spec), "not three ranges of counts",
                     fmt::format("write it as 2..15x2..15x2..15 or 7x7x5, counts from 1 to {}", kMostPerAxis));
  }
  return Enumerate(ranges, std::string(spec));
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
