#include "feeler/workflow/perception/perceive.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/clock.h"
#include "feeler/core/error.h"
#include "feeler/env/vision/target_points.h"

namespace feeler::workflow {
namespace {

perception::SurfacePoints SurfaceOf(const env::TaskModel& task_model, double spacing_m) {
  env::TargetPoints sampled = env::SampleTargetSurface(task_model, spacing_m);
  return {std::move(sampled.points_m), std::move(sampled.normals)};
}

/// The vertical, and the task's own uncertain angles, in the frame of the target as the task file places it.
std::vector<Eigen::Vector3d> RotationAxes(const Task& task) {
  std::vector<Eigen::Vector3d> axes = {task.world_T_target.linear().transpose() * Eigen::Vector3d::UnitZ()};
  for (const UncertainAxis& axis : task.axes) {
    if (!axis.angular()) continue;
    const Eigen::Vector3d own = axis.kind == AxisKind::kYaw ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
    constexpr double kSame = 0.99;  // cosine
    if (std::none_of(axes.begin(), axes.end(), [&](const auto& a) { return std::abs(a.dot(own)) > kSame; })) {
      axes.push_back(own);
    }
  }
  return axes;
}

/// So far that no camera of a cell sees it.
const Pose kAway = MakePose(Eigen::Vector3d(0.0, 0.0, -1000.0));

}  // namespace

PerceptionSettings SettingsOf(const perception::UncertaintyTable& table) {
  PerceptionSettings settings;
  settings.averaged_frames = table.averaged_frames;
  settings.registration.limits = table.limits;
  return settings;
}

TargetFinder::TargetFinder(const env::TaskModel& task_model, const PerceptionSettings& settings)
    : settings_(settings),
      model_(SurfaceOf(task_model, settings.model_spacing_m)),
      nominal_orientation_(task_model.task.world_T_target.linear()) {
  settings_.registration.rotation_axes = RotationAxes(task_model.task);
  settings_.registration.Validate();
  if (settings.averaged_frames < 1) throw InputError("perception", "no frame to average", "give 1 or more");
}

perception::Points TargetFinder::Foreground(const perception::DepthFrame& depth,
                                            const perception::CameraIntrinsics& camera,
                                            const perception::DepthFrame* background) const {
  perception::Points points = perception::ToPoints(depth, camera, settings_.cloud, background);
  if (background != nullptr) return points;
  std::erase_if(points, [&](const Eigen::Vector3d& p) {
    return !((p.array() >= settings_.lower_m.array()).all() && (p.array() <= settings_.upper_m.array()).all());
  });
  return points;
}

perception::Registration TargetFinder::InDepth(const perception::DepthFrame& depth,
                                               const perception::CameraIntrinsics& camera,
                                               const perception::DepthFrame* background) const {
  return perception::Register(Foreground(depth, camera, background), model_, nominal_orientation_,
                              camera.world_T_camera.translation(), settings_.registration,
                              perception::ToPoints(depth, camera, settings_.cloud));
}

perception::Registration TargetFinder::InCloud(const perception::Points& scene, const Eigen::Vector3d& eye_m) const {
  perception::Points points;
  for (const Eigen::Vector3d& p : scene) {
    if ((p.array() >= settings_.lower_m.array()).all() && (p.array() <= settings_.upper_m.array()).all()) {
      points.push_back(p);
    }
  }
  return perception::Register(points, model_, nominal_orientation_, eye_m, settings_.registration, scene);
}

perception::DepthFrame ToFrame(const env::DepthImage& image) { return {image.width, image.height, image.depth_m}; }

perception::CameraIntrinsics ToIntrinsics(const env::CameraModel& model) {
  perception::CameraIntrinsics camera;
  camera.width = model.width;
  camera.height = model.height;
  camera.fx = model.fx;
  camera.fy = model.fy;
  camera.cx = model.cx;
  camera.cy = model.cy;
  camera.world_T_camera = model.world_T_camera;
  return camera;
}

CameraCell::CameraCell(std::shared_ptr<const env::Scene> scene, std::shared_ptr<const TargetFinder> finder,
                       const env::DepthNoiseOptions& noise)
    : scene_(std::move(scene)),
      finder_(std::move(finder)),
      noise_(noise),
      camera_(scene_),
      placements_(scene_),
      data_(env::MakeData(*scene_->model)) {
  env::ResetScene(*scene_, scene_->home_q_rad, *data_);
  intrinsics_ = ToIntrinsics(camera_.Nominal(*data_));
}

PlacementDraw CameraCell::DrawPlacement(RandomStream& random) {
  return placements_.Draw(random, [&](const Pose& pose) { return Sees(pose); });
}

bool CameraCell::Sees(const Pose& world_T_target) {
  const Eigen::Vector3d to_eye = eye_m() - world_T_target.translation();
  if (to_eye.norm() > farthest_m) return false;
  const Eigen::Vector3d out_of_opening = world_T_target.linear() * -UnitVector(scene_->task.insertion);
  if (to_eye.normalized().dot(out_of_opening) < least_cosine) return false;
  env::SetTargetPose(*scene_, world_T_target, *data_);
  mj_kinematics(scene_->model.get(), data_.get());
  const env::DepthCapture exact = camera_.Exact(*data_);
  const perception::SurfacePoints& surface = finder_->model().coarse().surface;
  const Pose camera_T_target = intrinsics_.world_T_camera.inverse() * world_T_target;
  int facing = 0;
  int seen = 0;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Eigen::Vector3d p = camera_T_target * surface.points[i];
    if ((world_T_target * surface.points[i]).z() < finder_->settings().lower_m.z()) continue;  // in the bench
    if (-p.dot(camera_T_target.linear() * surface.normals[i]) < 0.15 * p.norm()) continue;
    ++facing;
    if (p.z() <= 0.0) continue;
    const int u = static_cast<int>(std::lround(intrinsics_.fx * p.x() / p.z() + intrinsics_.cx));
    const int v = static_cast<int>(std::lround(intrinsics_.fy * p.y() / p.z() + intrinsics_.cy));
    if (u < 0 || v < 0 || u >= intrinsics_.width || v >= intrinsics_.height) continue;
    constexpr double kHidden_m = 0.02;
    seen += double{exact.depth.at(v, u)} > p.z() - kHidden_m ? 1 : 0;
  }
  return facing > 0 && seen >= least_seen * facing;
}

perception::DepthFrame CameraCell::Picture(const std::optional<Pose>& world_T_target,
                                           const env::Installation& installation, RandomStream& random) {
  env::SetTargetPose(*scene_, world_T_target.value_or(kAway), *data_);
  mj_kinematics(scene_->model.get(), data_.get());
  return ToFrame(camera_.Noisy(*data_, noise_, installation, random, finder_->settings().averaged_frames).depth);
}

const CameraCell::Cell& CameraCell::CellFor(std::uint64_t seed, std::uint64_t installation_key) {
  const auto key = std::make_pair(seed, installation_key);
  const auto known = cells_.find(key);
  if (known != cells_.end()) return known->second;
  Cell cell;
  RandomStream mounting(seed, installation_key, "camera installation");
  cell.installation = env::DrawInstallation(noise_, mounting);
  RandomStream random(seed, installation_key, "picture without target");
  cell.background = Picture(std::nullopt, cell.installation, random);
  return cells_.emplace(key, std::move(cell)).first->second;
}

Sight CameraCell::Look(const Pose& world_T_target, std::uint64_t seed, std::uint64_t installation_key,
                       RandomStream& random) {
  const Cell& cell = CellFor(seed, installation_key);
  depth_ = Picture(world_T_target, cell.installation, random);
  background_ = &cell.background;
  Sight sight;
  sight.world_T_true = world_T_target;
  sight.distance_m = (world_T_target.translation() - eye_m()).norm();
  const double start_s = ThreadCpuSeconds();
  sight.registration = finder_->InDepth(depth_, intrinsics_, background_);
  sight.cpu_s = ThreadCpuSeconds() - start_s;
  return sight;
}

}  // namespace feeler::workflow
