#include "feeler/cad/numbers/walls.h"

#include <algorithm>
#include <cmath>

#include "feeler/env/contact/lattice_phase.h"
#include "feeler/env/contact/line_sweep.h"

namespace feeler::cad {
namespace {

/// Spacing of the lines that are swept; walls narrower than a few of them play no part.
constexpr double kSpacing_m = 1e-3;
constexpr int kMostLines = 110;  // along one side
constexpr double kAccuracy_m = 1e-7;
/// Fewer lines than that end at a corner, not at a side.
constexpr int kFewestLines = 4;

}  // namespace

MetWalls WallsOf(const env::TaskModel& model) {
  const env::ObstacleSet set(model, env::GeomsOf(model, env::Opening::kClosed), Eigen::Quaterniond::Identity());
  env::LineSweep sweep(set, kAccuracy_m);
  const Task& task = model.task;
  const Eigen::Vector3d center = task.start_offset_m + task.workspace_center_m;
  Eigen::Vector3d spacing;
  Eigen::Matrix<int, 3, 1> lines;
  for (int k = 0; k < 3; ++k) {
    spacing[k] = std::max(kSpacing_m, 2 * task.workspace_m[k] / kMostLines);
    lines[k] = static_cast<int>(std::floor(2 * task.workspace_m[k] / spacing[k])) + 1;
  }
  MetWalls met;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    std::vector<env::LineEnds> ends;
    for (int i = 0; i < lines[u]; ++i) {
      for (int j = 0; j < lines[v]; ++j) {
        Eigen::Vector3d point = center;
        // Off the round numbers that parts are made of.
        point[u] += -task.workspace_m[u] + (i + 0.37) * spacing[u];
        point[v] += -task.workspace_m[v] + (j + 0.37) * spacing[v];
        env::LineEnds line;
        for (const env::BlockedStretch& stretch : sweep.Sweep(axis, point, false)) {
          for (const auto& [at, rising] : {std::pair{stretch.low_m, true}, {stretch.high_m, false}}) {
            if (std::abs(at - center[axis]) <= task.workspace_m[axis]) line.push_back({at * 1000, rising});
          }
        }
        ends.push_back(std::move(line));
      }
    }
    env::WallCensus census(lines[v]);
    census.Add(ends);
    const auto number = static_cast<std::size_t>(axis);
    for (const double wall : census.Walls()) met.walls[number].push_back(wall / 1000);
    const auto ended = std::count_if(ends.begin(), ends.end(), [](const env::LineEnds& line) { return !line.empty(); });
    met.any_side[number] = ended >= kFewestLines;
  }
  return met;
}

Eigen::Vector2d PlayOfPieces(const env::TaskModel& model, double depth_m, double most_m) {
  const env::ObstacleSet set(model, env::GeomsOf(model, env::Opening::kOpen), Eigen::Quaterniond::Identity());
  env::LineSweep sweep(set, 1e-9);
  Eigen::Vector2d play;
  for (int axis = 0; axis < 2; ++axis) {
    double low = -most_m;
    double high = most_m;
    for (const env::BlockedStretch& stretch : sweep.Sweep(axis, {0, 0, -depth_m}, false)) {
      if (stretch.high_m <= 1e-6) low = std::max(low, stretch.high_m);
      if (stretch.low_m >= -1e-6) high = std::min(high, stretch.low_m);
      if (stretch.low_m < -1e-6 && stretch.high_m > 1e-6) low = high = 0;
    }
    play[axis] = std::max(0.0, 0.5 * (high - low));
  }
  return play;
}

}  // namespace feeler::cad
