#include "feeler/env/contact/contact_map_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/lattice_grid.h"
#include "feeler/core/worker_pool.h"
#include "feeler/env/contact/lattice_phase.h"
#include "feeler/env/contact/line_sweep.h"

namespace feeler::env {
namespace {

using planner::ContactMap;

/// Accuracy of travel, in cells.
constexpr double kAccuracy_cells = 1e-3;

/// The lattice lines of a domain along one axis, numbered; the third axis' coordinate varies fastest.
struct Lines {
  CellBox domain;
  int axis;

  int u() const { return (axis + 1) % 3; }
  int v() const { return (axis + 2) % 3; }
  int count() const { return domain.Size()[u()] * domain.Size()[v()]; }
  /// The first point of a line.
  Cell Begin(int line) const {
    Cell cell = domain.min;
    cell[u()] += line / domain.Size()[v()];
    cell[v()] += line % domain.Size()[v()];
    return cell;
  }
};

/// Counts finished lines of all passes for the caller's progress.
class Progress {
 public:
  Progress(const ProgressCallback& callback, std::int64_t total) : callback_(callback), total_(total) {}
  void Add(std::int64_t done) {
    if (!callback_) return;
    const std::lock_guard lock(mutex_);
    done_ += done;
    callback_(done_, total_);
  }

 private:
  const ProgressCallback& callback_;
  std::int64_t total_;
  std::int64_t done_ = 0;
  std::mutex mutex_;
};

/// Calls visit(line, stretches) for every lattice line, from several threads; lines do not depend on each other, so
/// that neither do results on the number of threads.
template <class Visit>
void SweepLines(const ObstacleSet& set, const Lines& lines, const Eigen::Vector3d& phase, double cell_m, bool judged,
                Parallelism parallelism, Progress& progress, const Visit& visit) {
  constexpr int kChunk = 64;
  const auto chunks = static_cast<std::size_t>((lines.count() + kChunk - 1) / kChunk);
  RunWorkers(chunks, parallelism, [&] {
    return [&, sweep = LineSweep(set, kAccuracy_cells * cell_m)](std::size_t chunk) mutable {
      const int begin = static_cast<int>(chunk) * kChunk;
      const int end = std::min(begin + kChunk, lines.count());
      for (int line = begin; line < end; ++line) {
        visit(line, sweep.Sweep(lines.axis, (lines.Begin(line).cast<double>() + phase) * cell_m, judged));
      }
      progress.Add(end - begin);
    };
  });
}

/// Travel along both directions of one lattice line from the stretches that are blocked on it.
class LineFiller {
 public:
  LineFiller(const CellBox& domain, const Eigen::Vector3d& phase, double cell_m, ContactMap::Layer& layer)
      : domain_(domain), phase_(phase), cell_m_(cell_m), layer_(layer) {
    stride_ = GridStrides(domain.Size());
  }

  void Fill(int axis, const Cell& begin, const std::vector<BlockedStretch>& stretches) {
    auto& plus = layer_.travel[IndexOf(MakeDirection(axis, 1))];
    auto& minus = layer_.travel[IndexOf(MakeDirection(axis, -1))];
    std::size_t stretch = 0;
    const Cell offset = begin - domain_.min;
    auto index = GridIndex(domain_.Size(), offset);
    for (int k = 0; k < domain_.Size()[axis];
         ++k, index += static_cast<std::size_t>(stride_[static_cast<std::size_t>(axis)])) {
      const double t = (domain_.min[axis] + k + phase_[axis]) * cell_m_;
      while (stretch < stretches.size() && stretches[stretch].high_m <= t) ++stretch;
      const bool ahead = stretch < stretches.size();
      if (ahead && stretches[stretch].low_m < t) {
        layer_.blocked[index] = 1;
        continue;
      }
      if (ahead) plus[index] = ToCells(stretches[stretch].low_m - t);
      if (stretch > 0) minus[index] = ToCells(t - stretches[stretch - 1].high_m);
    }
  }

 private:
  float ToCells(double length_m) const {
    return static_cast<float>(std::clamp(length_m / cell_m_, 0.0, double{ContactMap::kUnlimited}));
  }

  CellBox domain_;
  Eigen::Vector3d phase_;
  double cell_m_;
  ContactMap::Layer& layer_;
  std::array<std::int64_t, 3> stride_{};
};

/// Ends of blocked stretches within the domain, per lattice line, in cells.
LineEnds EndsOf(const std::vector<BlockedStretch>& stretches, const Lines& lines, double cell_m) {
  LineEnds ends;
  const auto keep = [&](double end_m, bool rising) {
    const double cells = end_m / cell_m;
    if (cells >= lines.domain.min[lines.axis] - 1 && cells <= lines.domain.max[lines.axis] + 1) {
      ends.push_back({cells, rising});
    }
  };
  for (const BlockedStretch& stretch : stretches) {
    keep(stretch.low_m, true);
    keep(stretch.high_m, false);
  }
  return ends;
}

void CheckStarts(const Task& task, const ContactMap& map, const std::string& where) {
  // Over all extents the start cell minus a hypothesis ranges, per axis, over an interval.
  Cell low = Cell::Constant(1 << 28);
  Cell high = -low;
  std::vector<int> extents;
  for (const UncertainAxis& axis : task.axes) extents.push_back(axis.max_cells);
  for (int shrink = 0; shrink < 2; ++shrink) {
    std::vector<int> smaller = extents;
    for (std::size_t i = 0; i < smaller.size(); ++i) smaller[i] = std::max(task.axes[i].min_cells, extents[i] - shrink);
    const Cell cuboid = PositionExtents(task, smaller);
    const Cell start = StartCell(task, cuboid);
    low = low.cwiseMin(start - (cuboid - Cell::Ones()));
    high = high.cwiseMax(start);
  }
  for (int orientation = 0; orientation < map.orientations(); ++orientation) {
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          if (!map.Blocked({x, y, z}, orientation)) continue;
          throw InputError(fmt::format("{}: <custom><numeric name=\"feeler_start_offset\">", where),
                           fmt::format("the tool starts in collision with the target, {} {} {} cells from it", x, y, z),
                           "start further away or lower feeler_max_cells");
        }
      }
    }
  }
}

}  // namespace

ContactMap BuildContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism,
                           const ProgressCallback& callback) {
  const Task& task = task_model.task;
  const CellBox domain = DisplacementsOf(task);
  if (domain.Count() > (std::int64_t{1} << 27)) {
    throw InputError(fmt::format("{}: <custom><numeric name=\"feeler_workspace\">", task.file),
                     fmt::format("needs a contact map of {} cells", domain.Count()), "lower it, or use larger cells");
  }
  const FeltGeoms geoms = GeomsOf(task_model, opening);
  std::vector<ObstacleSet> sets;
  for (const Eigen::Quaterniond& orientation : TargetOrientations(task)) {
    sets.emplace_back(task_model, geoms, orientation);
  }
  std::int64_t lines_in_all = 0;
  for (int axis = 0; axis < 3; ++axis) lines_in_all += Lines{domain, axis}.count();
  Progress progress(callback, lines_in_all * (1 + static_cast<std::int64_t>(sets.size())));

  // First pass, lattice lines beside the axes of the target: where are the walls? Lines exactly on the axes would run
  // in faces that lie at whole cells, where rounding decides. Only the target as estimated is asked: turned ones have
  // slanted walls, which no phase suits.
  const ObstacleSet estimated(task_model, geoms, Eigen::Quaterniond::Identity());
  const Eigen::Vector3d beside(5e-4, 6e-4, 7e-4);
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();
  double margin_cells = 0.5;
  for (int axis = 0; axis < 3; ++axis) {
    const Lines lines{domain, axis};
    WallCensus census(domain.Size()[lines.v()]);
    std::vector<LineEnds> ends(static_cast<std::size_t>(lines.count()));
    SweepLines(estimated, lines, beside, task.cell_m, /*judged=*/false, parallelism, progress,
               [&](int line, const std::vector<BlockedStretch>& stretches) {
                 ends[static_cast<std::size_t>(line)] = EndsOf(stretches, lines, task.cell_m);
               });
    census.Add(ends);
    const LatticePhase chosen = ChoosePhase(census.Walls());
    phase[axis] = chosen.phase;
    margin_cells = std::min(margin_cells, chosen.margin);
  }

  std::vector<ContactMap::Layer> layers;
  for (const ObstacleSet& set : sets) {
    ContactMap::Layer layer;
    const auto count = static_cast<std::size_t>(domain.Count());
    layer.blocked.assign(count, 0);
    for (auto& travel : layer.travel) travel.assign(count, ContactMap::kUnlimited);
    LineFiller filler(domain, phase, task.cell_m, layer);
    for (int axis = 0; axis < 3; ++axis) {
      const Lines lines{domain, axis};
      SweepLines(set, lines, phase, task.cell_m, /*judged=*/true, parallelism, progress,
                 [&](int line, const std::vector<BlockedStretch>& stretches) {
                   filler.Fill(axis, lines.Begin(line), stretches);
                 });
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (layer.blocked[i] == 0) continue;
      for (auto& travel : layer.travel) travel[i] = 0.0F;
    }
    layers.push_back(std::move(layer));
  }
  ContactMap map(domain, std::move(layers), phase, margin_cells);
  CheckStarts(task, map, task.file.empty() ? task.name : task.file);
  return map;
}

}  // namespace feeler::env
