#include "feeler/workflow/check/touch_findings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/planner/belief/contact_masks.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/indistinguishable.h"
#include "feeler/workflow/episode/episode.h"

namespace feeler::workflow {
namespace {

using env::TaskFinding;
using Pairs = std::vector<std::pair<int, int>>;

/// Displacements of a contact map that is built to see whether a larger workspace would do.
constexpr double kMostDisplacements = 3e6;

planner::ProblemFamily LargestProblem(const Task& task) {
  constexpr int kMost = 15;  // hypotheses along an axis: enough to see what is alike
  std::string spec;
  for (const UncertainAxis& axis : task.axes) {
    spec += (spec.empty() ? "" : "x") + std::to_string(std::min(axis.max_cells, kMost));
  }
  return {{planner::ParseExtents(spec, task)}, spec};
}

/// Answers for one contact map and any workspace within it.
class Touch {
 public:
  Touch(const Task& task, std::shared_ptr<const planner::ContactMap> map)
      : problem_(planner::MakeCuboidProblem(task, map, LargestProblem(task).problems.front())), masks_(*map) {}

  Pairs Alike(const CellBox& workspace, std::size_t most = 1000000) {
    problem_.workspace = workspace;
    return planner::IndistinguishablePairs(problem_, masks_, most);
  }
  std::int64_t Count(const CellBox& workspace) {
    problem_.workspace = workspace;
    return planner::CountIndistinguishablePairs(problem_, masks_);
  }
  const planner::Problem& problem() const { return problem_; }

 private:
  planner::Problem problem_;
  planner::ContactMasks masks_;
};

/// Cells by which each side of a workspace is moved outwards.
struct Growth {
  Cell low = Cell::Zero();
  Cell high = Cell::Zero();
  CellBox Of(const CellBox& box) const { return {box.min - low, box.max + high}; }
};

/// The task with a workspace larger by so much on every side.
Task Wider(const Task& task, double more_m) {
  Task wider = task;
  wider.workspace_m += Eigen::Vector3d::Constant(more_m);
  return wider;
}

/// A growth, all of whose sides are needed: shrinks them one after the other while touch still tells all apart.
Growth Smallest(Touch& touch, const CellBox& workspace, int cells) {
  Growth growth{Cell::Constant(cells), Cell::Constant(cells)};
  for (const int axis : {2, 1, 0}) {
    for (Cell* side : {&growth.low, &growth.high}) {
      int fails = -1;
      int works = (*side)[axis];
      while (works - fails > 1) {
        (*side)[axis] = fails + (works - fails) / 2;
        (touch.Alike(growth.Of(workspace), 1).empty() ? works : fails) = (*side)[axis];
      }
      (*side)[axis] = works;
    }
  }
  return growth;
}

std::string Sides(const Growth& growth, double cell_m) {
  std::vector<std::string> sides;
  for (int axis = 0; axis < 3; ++axis) {
    if (growth.low[axis] > 0)
      sides.push_back(fmt::format("-{} {:.3g} mm", "xyz"[axis], growth.low[axis] * cell_m * 1000));
    if (growth.high[axis] > 0)
      sides.push_back(fmt::format("+{} {:.3g} mm", "xyz"[axis], growth.high[axis] * cell_m * 1000));
  }
  return fmt::format("{}", fmt::join(sides, ", "));
}

/// Half extents about the present centre that contain the grown box.
Eigen::Vector3d HalfExtents(const Task& task, const Growth& growth) {
  return task.workspace_m + growth.low.cwiseMax(growth.high).cast<double>() * task.cell_m;
}

std::string Example(const planner::Problem& problem, const Pairs& pairs) {
  const auto place = [&](int i) {
    const planner::Hypothesis& h = problem.hypotheses[static_cast<std::size_t>(i)];
    return fmt::format("[{}, {}, {}]{}", h.offset.x(), h.offset.y(), h.offset.z(),
                       problem.map->orientations() == 1 ? "" : fmt::format(" orientation {}", h.orientation));
  };
  return fmt::format("{} and {}", place(pairs.front().first), place(pairs.front().second));
}

/// Axes along which hypotheses differ that no touch tells apart.
std::vector<std::string> BlindAxes(const Task& task, const planner::Problem& problem, const Pairs& pairs) {
  std::set<AxisKind> blind;
  for (const auto& [i, j] : pairs) {
    const planner::Hypothesis& a = problem.hypotheses[static_cast<std::size_t>(i)];
    const planner::Hypothesis& b = problem.hypotheses[static_cast<std::size_t>(j)];
    for (const UncertainAxis& axis : task.axes) {
      bool differs = false;
      switch (axis.kind) {
        case AxisKind::kYaw: differs = a.orientation / problem.pitches != b.orientation / problem.pitches; break;
        case AxisKind::kPitch: differs = a.orientation % problem.pitches != b.orientation % problem.pitches; break;
        default: differs = a.offset[static_cast<int>(axis.kind)] != b.offset[static_cast<int>(axis.kind)];
      }
      if (differs) blind.insert(axis.kind);
    }
  }
  std::vector<std::string> names;
  for (const AxisKind kind : blind) names.emplace_back(ToString(kind));
  return names;
}

/// Episodes of the smallest problem that the spiral inserts, of three.
int SpiralInserts(const PlanningSetup& setup, Parallelism jobs) {
  EpisodeOptions options;
  std::string spec;
  for (const UncertainAxis& axis : setup.task().axes)
    spec += (spec.empty() ? "" : "x") + std::to_string(axis.min_cells);
  options.family = {{planner::ParseExtents(spec, setup.task())}, spec};
  options.ladder = false;
  const auto shared = std::make_shared<const PlanningSetup>(setup);
  const auto scene = BuildEpisodeScene(setup);
  const PolicyFactory policy = MakePolicyFactory("spiral", nullptr);
  int inserted = 0;
  RunEpisodes(
      EpisodeRange(0, 3), jobs, [&] { return EpisodeRunner(shared, scene, policy, options); },
      [&](const EpisodeRecord& record) { inserted += record.inserted ? 1 : 0; }, {}, nullptr);
  return inserted;
}

}  // namespace

env::TaskFindings TouchFindings(const PlanningSetup& setup, const std::string& where, Parallelism jobs,
                                const ProgressCallback& progress) {
  const Task& task = setup.task();
  Touch touch(task, setup.map);
  const CellBox workspace = touch.problem().workspace;
  const Pairs pairs = touch.Alike(workspace);
  if (pairs.empty()) return {};
  const std::string alike =
      fmt::format("{} pairs of hypotheses of the largest problem are told apart by no touch, {} for example",
                  touch.Count(workspace), Example(touch.problem(), pairs));
  const std::string element = fmt::format("{}: <custom><numeric name=\"feeler_workspace\">", where);
  double tried_m = 0;
  for (const double factor : {1.0, 2.0, 4.0}) {
    const int cells = static_cast<int>(std::ceil(factor * task.workspace_m.minCoeff() / task.cell_m)) + 6;
    const Task wider = Wider(task, cells * task.cell_m);
    if (static_cast<double>(DisplacementsOf(wider).Count()) > kMostDisplacements) break;
    env::TaskModel model = setup.model;
    model.task = wider;
    Touch wide(task,
               std::make_shared<const planner::ContactMap>(env::BuildContactMap(model, setup.opening, jobs, progress)));
    if (!wide.Alike(Growth{Cell::Constant(cells), Cell::Constant(cells)}.Of(workspace), 1).empty()) {
      tried_m = cells * task.cell_m;
      continue;
    }
    const Growth growth = Smallest(wide, workspace, cells);
    const Eigen::Vector3d half_m = HalfExtents(task, growth);
    return {{TaskFinding::Severity::kError, "workspace", element,
             fmt::format("too small: {}; the tool has to go further towards {}", alike, Sides(growth, task.cell_m)),
             fmt::format("\"{:.4g} {:.4g} {:.4g}\" is enough", half_m.x(), half_m.y(), half_m.z())}};
  }
  const std::vector<std::string> blind = BlindAxes(task, touch.problem(), pairs);
  const int inserted = SpiralInserts(setup, jobs);
  return {{TaskFinding::Severity::kError, "blind", fmt::format("{}: <custom><text name=\"feeler_axes\">", where),
           fmt::format("no touch tells {}, in a workspace larger by {:.3g} mm a side neither: {}",
                       fmt::join(blind, ", "), tried_m * 1000, alike),
           inserted > 0
               ? fmt::format("feeler run --policy spiral inserts it all the same ({} of 3 episodes of the smallest "
                             "problem); or give the part a feature that can be felt, or drop the axis",
                             inserted)
               : "give the part a feature that can be felt, or drop the axis; --policy spiral was tried and did not "
                 "insert"}};
}

}  // namespace feeler::workflow
