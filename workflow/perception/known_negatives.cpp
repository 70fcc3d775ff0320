#include "feeler/workflow/perception/known_negatives.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "feeler/core/random.h"
#include "feeler/perception/icp_fit.h"

namespace feeler::workflow {
namespace {

using perception::SurfacePoints;

constexpr double kNoise_m = 0.001;
constexpr double kAlike_m = 0.004;
constexpr double kAlikeShare = 0.98;

/// The surface of a box that stands on z = 0, points at most `spacing_m` apart.
SurfacePoints Box(const Eigen::Vector3d& size_m, double spacing_m) {
  SurfacePoints surface;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    const int steps_u = static_cast<int>(std::ceil(size_m[u] / spacing_m));
    const int steps_v = static_cast<int>(std::ceil(size_m[v] / spacing_m));
    for (const double side : {-1.0, 1.0}) {
      for (int i = 0; i <= steps_u; ++i) {
        for (int k = 0; k <= steps_v; ++k) {
          Eigen::Vector3d p;
          p[axis] = side * size_m[axis] / 2;
          p[u] = (static_cast<double>(i) / steps_u - 0.5) * size_m[u];
          p[v] = (static_cast<double>(k) / steps_v - 0.5) * size_m[v];
          surface.points.push_back(p + Eigen::Vector3d(0, 0, size_m.z() / 2));
          surface.normals.push_back(side * Eigen::Vector3d::Unit(axis));
        }
      }
    }
  }
  return surface;
}

double ShareNear(const perception::TargetModel::Level& of, const perception::TargetModel::Level& to) {
  const auto& points = of.surface.points;
  const auto near = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
    return to.tree.Nearest(p).squared_m2 < kAlike_m * kAlike_m;
  });
  return static_cast<double>(near) / static_cast<double>(points.size());
}

bool Alike(const perception::TargetModel& a, const perception::TargetModel& b) {
  return ShareNear(a.fine(), b.fine()) >= kAlikeShare && ShareNear(b.fine(), a.fine()) >= kAlikeShare;
}

void Show(const TargetFinder& finder, const perception::TargetModel& thing, const Pose& world_T_thing,
          const Eigen::Vector3d& eye_m, std::uint64_t key, KnownNegative& negative) {
  RandomStream random(1, key, "known negatives");
  perception::Points cloud;
  for (const std::size_t i : perception::Visible(thing.fine(), world_T_thing.inverse() * eye_m)) {
    const double x = random.Normal();
    const double y = random.Normal();
    const double z = random.Normal();
    cloud.push_back(world_T_thing * thing.fine().surface.points[i] + kNoise_m * Eigen::Vector3d(x, y, z));
  }
  const perception::Registration registration = finder.InCloud(cloud, eye_m);
  negative.found = registration.found;
  negative.fitness = registration.fitness;
}

}  // namespace

std::vector<KnownNegative> TryKnownNegatives(const TargetFinder& finder, const env::TaskModel& task_model,
                                             const Eigen::Vector3d& eye_m, const CancellationToken* cancellation) {
  const Eigen::Vector3d sizes_m[] = {{0.8, 0.8, 0.01}, {0.4, 0.3, 0.01}, {0.2, 0.15, 0.01},
                                     {0.1, 0.1, 0.1},  {0.3, 0.2, 0.15}, {0.06, 0.04, 0.05}};
  const Eigen::Vector3d place_m = task_model.task.world_T_target.translation();
  const auto cancelled = [&] { return cancellation != nullptr && cancellation->cancelled(); };
  std::vector<KnownNegative> negatives;
  for (const Eigen::Vector3d& size_m : sizes_m) {
    if (cancelled()) return negatives;
    KnownNegative negative{
        size_m.z() < 0.02 ? "plate" : "box",
        fmt::format("{:.0f} x {:.0f} x {:.0f} mm", size_m.x() * 1000, size_m.y() * 1000, size_m.z() * 1000)};
    const perception::TargetModel box(Box(size_m, 0.003));
    Show(finder, box, MakePose(place_m), eye_m, negatives.size(), negative);
    negatives.push_back(negative);
  }
  for (const std::string& name : env::ListTasks()) {
    if (cancelled()) return negatives;
    const env::TaskModel other = env::LoadTask(name);
    const TargetFinder thing(other);
    if (Alike(thing.model(), finder.model())) continue;
    Pose pose = other.task.world_T_target;
    pose.translation() = place_m;
    KnownNegative negative{"part", name};
    Show(finder, thing.model(), pose, eye_m, negatives.size(), negative);
    negatives.push_back(negative);
  }
  return negatives;
}

}  // namespace feeler::workflow
