// CPU time of one registration: the plug's panel and housing as a depth camera at 1.4 m sees them, with 2 mm of noise.
#include <benchmark/benchmark.h>

#include "feeler/core/random.h"
#include "feeler/perception/registration.h"

namespace feeler::perception {
namespace {

void AddTop(const Eigen::Vector3d& centre, double half_x, double half_y, double spacing_m, SurfacePoints& surface) {
  for (double x = -half_x; x < half_x; x += spacing_m) {
    for (double y = -half_y; y < half_y; y += spacing_m) {
      surface.points.emplace_back(centre + Eigen::Vector3d(x, y, 0.0));
      surface.normals.emplace_back(Eigen::Vector3d::UnitZ());
    }
  }
}

SurfacePoints PanelAndHousing(double spacing_m) {
  SurfacePoints surface;
  AddTop({0.0, 0.0, -0.03}, 0.17, 0.17, spacing_m, surface);
  AddTop({0.0, 0.0, 0.0}, 0.029, 0.025, spacing_m, surface);
  return surface;
}

void BM_Register(benchmark::State& state) {
  const TargetModel model(PanelAndHousing(0.0025));
  const Pose truth = MakePose(Eigen::Vector3d(0.6, 0.05, 0.2), 0.2);
  RandomStream random(1, 0, "bench");
  Points scene;
  for (const Eigen::Vector3d& p : PanelAndHousing(0.003).points) {
    scene.emplace_back(truth * p + 0.002 * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()));
  }
  const Eigen::Vector3d eye(1.45, -0.5, 1.2);
  for (auto _ : state) {
    benchmark::DoNotOptimize(Register(scene, model, Eigen::Matrix3d::Identity(), eye));
  }
  state.counters["points"] = static_cast<double>(scene.size());
}
BENCHMARK(BM_Register)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace feeler::perception
