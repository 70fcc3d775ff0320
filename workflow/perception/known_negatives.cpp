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
constexpr double kSpacing_m = 0.005;  // of points shown

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

/// The bench around a place, level at z = 0.
SurfacePoints Bench(const Eigen::Vector3d& around_m) {
  constexpr double kReach_m = 0.6;
  SurfacePoints bench;
  for (double x = -kReach_m; x <= kReach_m; x += kSpacing_m) {
    for (double y = -kReach_m; y <= kReach_m; y += kSpacing_m) {
      bench.points.emplace_back(around_m.x() + x, around_m.y() + y, 0.0);
      bench.normals.push_back(Eigen::Vector3d::UnitZ());
    }
  }
  return bench;
}

/// What a camera at `eye_m` sees of a thing over the bench.
perception::Points Picture(const SurfacePoints& thing, const Pose& world_T_thing, const SurfacePoints& bench,
                           const Eigen::Vector3d& eye_m, std::uint64_t key) {
  perception::TargetModel::Level scene{kSpacing_m, bench, perception::NearestPoints({eye_m})};
  for (std::size_t i = 0; i < thing.points.size(); ++i) {
    scene.surface.points.push_back(world_T_thing * thing.points[i]);
    scene.surface.normals.push_back(world_T_thing.linear() * thing.normals[i]);
  }
  RandomStream random(1, key, "known negatives");
  perception::Points cloud;
  for (const std::size_t i : perception::Visible(scene, eye_m)) {
    const double x = random.Normal();
    const double y = random.Normal();
    const double z = random.Normal();
    cloud.push_back(scene.surface.points[i] + kNoise_m * Eigen::Vector3d(x, y, z));
  }
  return cloud;
}

/// Something that is not the target, its top or mouth at its origin.
struct Thing {
  std::string kind, what;
  SurfacePoints surface;
  Eigen::Matrix3d orientation = Eigen::Matrix3d::Identity();
};

/// Plates and boxes of usual sizes, and such as hide the target best: its own outline seen from above, as a plate, and
/// the box around it.
std::vector<Thing> PlainThings(const perception::TargetModel& model, const Eigen::Matrix3d& orientation) {
  Eigen::Vector3d lower = orientation * model.fine().surface.points.front();
  Eigen::Vector3d upper = lower;
  for (const Eigen::Vector3d& p : model.fine().surface.points) {
    lower = lower.cwiseMin(orientation * p);
    upper = upper.cwiseMax(orientation * p);
  }
  const Eigen::Vector3d size_m = upper - lower;
  constexpr double kThin_m = 0.01;
  const Eigen::Vector3d sizes_m[] = {{1.5, 1.0, kThin_m},  {0.8, 0.8, kThin_m},
                                     {0.5, 0.4, kThin_m},  {0.4, 0.3, kThin_m},
                                     {0.2, 0.15, kThin_m}, {size_m.x(), size_m.y(), kThin_m},
                                     {0.1, 0.1, 0.1},      {0.3, 0.2, 0.15},
                                     {0.06, 0.04, 0.05},   size_m};
  std::vector<Thing> things;
  for (const Eigen::Vector3d& s : sizes_m) {
    things.push_back({s.z() <= kThin_m ? "plate" : "box",
                      fmt::format("{:.0f} x {:.0f} x {:.0f} mm", s.x() * 1000, s.y() * 1000, s.z() * 1000),
                      Box(s, 0.8 * kSpacing_m)});
    for (Eigen::Vector3d& p : things.back().surface.points) p.z() -= s.z();
  }
  return things;
}

/// How a thing stands: as the target would, tilted, elsewhere.
struct Stand {
  const char* how;
  Eigen::Vector3d moved_m;
  double tilt_rad;  ///< about y
};
const Stand kStands[] = {{"", {0, 0, 0}, 0}, {", tilted", {0, 0, 0}, 0.07}, {", aside", {0.1, -0.2, 0.05}, 0}};

}  // namespace

std::vector<KnownNegative> TryKnownNegatives(const TargetFinder& finder, const env::TaskModel& task_model,
                                             const Eigen::Vector3d& eye_m, const CancellationToken* cancellation,
                                             bool upright_only) {
  const Pose& nominal = task_model.task.world_T_target;
  std::vector<Thing> things = PlainThings(finder.model(), nominal.linear());
  for (const std::string& name : env::ListTasks()) {
    const env::TaskModel other = env::LoadTask(name);
    const TargetFinder thing(other);
    if (Alike(thing.model(), finder.model())) continue;
    things.push_back({"part", name, thing.model().fine().surface, other.task.world_T_target.linear()});
  }
  std::vector<KnownNegative> negatives;
  for (const Thing& thing : things) {
    for (const Stand& stand : kStands) {
      if (cancellation != nullptr && cancellation->cancelled()) return negatives;
      if (upright_only && &stand != kStands) break;
      Pose pose = MakePose(nominal.translation() + stand.moved_m);
      pose.linear() =
          Eigen::AngleAxisd(stand.tilt_rad, Eigen::Vector3d::UnitY()).toRotationMatrix() * thing.orientation;
      const perception::Points cloud = Picture(thing.surface, pose, Bench(pose.translation()), eye_m, negatives.size());
      const perception::Registration registration = finder.InCloud(cloud, eye_m);
      negatives.push_back({thing.kind, thing.what + stand.how, registration.found, registration});
    }
  }
  return negatives;
}

}  // namespace feeler::workflow
