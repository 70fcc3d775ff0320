// From depth images and clouds to hypotheses: feeler.perceive.
#include <cmath>

#include "common.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/perception/uncertainty_table.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/workflow/perception/perceive.h"
#include "feeler/workflow/perception/perceive_table.h"
#include "planner.h"

namespace feeler::python {
namespace {

perception::DepthFrame ToDepth(const FloatArray& image, const char* where) {
  if (image.ndim() != 2) throw InputError(where, "is no picture", "give (height, width) float32, metres");
  perception::DepthFrame frame;
  frame.height = static_cast<int>(image.shape(0));
  frame.width = static_cast<int>(image.shape(1));
  frame.depth_m.assign(image.data(), image.data() + image.size());
  for (float& depth : frame.depth_m) {
    if (!std::isfinite(depth) || depth < 0.0F) depth = 0.0F;  // no reading
  }
  return frame;
}

perception::Points ToPoints(const DoubleArray& cloud) {
  if (cloud.ndim() != 2 || cloud.shape(1) != 3)
    throw InputError("cloud", "has no rows of three", "give (n, 3), metres");
  perception::Points points;
  points.reserve(cloud.shape(0));
  for (std::size_t i = 0; i < cloud.shape(0); ++i) {
    points.emplace_back(cloud.data()[3 * i], cloud.data()[3 * i + 1], cloud.data()[3 * i + 2]);
  }
  return points;
}

/// The finder of a task with its table, if it has one.
class Finder {
 public:
  Finder(PlanningTask& task, const std::string& table)
      : task_(task.model()),
        table_(TableOf(task_, table)),
        finder_(task_, table_ ? workflow::SettingsOf(*table_) : workflow::PerceptionSettings()) {
    if (table_) family_ = workflow::FamilyOfTable(*table_, task_.task, table);
  }

  nb::dict Answer(const perception::Registration& found) const {
    nb::dict d;
    d["found"] = found.found;
    d["reason"] = found.reason;
    d["fitness"] = found.fitness;
    d["explained"] = found.explained;
    d["beyond"] = found.beyond;
    d["seen_through"] = found.seen_through;
    d["missing_m2"] = found.missing_m2;
    d["rms_m"] = found.rms_m;
    d["points"] = found.points;
    d["world_T_target"] = Eigen::Matrix4d(found.world_T_target.matrix());
    d["covariance"] = Eigen::MatrixXd(found.covariance);
    if (!found.found || !table_) return d;
    const perception::PoseHypotheses hypotheses = perception::HypothesesFor(*table_, found.world_T_target);
    d["world_T_estimate"] = Eigen::Matrix4d(hypotheses.world_T_estimate.matrix());
    d["counts"] = nb::tuple(nb::cast(hypotheses.counts));
    d["clamped"] = hypotheses.clamped;
    const auto snapped = workflow::SnapTo(family_, task_.task, hypotheses.counts);
    d["extents"] = nb::none();
    if (snapped) d["extents"] = nb::tuple(nb::cast(planner::ExtentsPerAxis(planner::AxesOf(task_.task), *snapped)));
    return d;
  }

  const workflow::TargetFinder& finder() const { return finder_; }

 private:
  static std::optional<perception::UncertaintyTable> TableOf(const env::TaskModel& task, const std::string& table) {
    if (table.empty()) return std::nullopt;
    return workflow::LoadTable(table, task.task, env::Fingerprint(task, env::Opening::kClosed));
  }

  env::TaskModel task_;
  std::optional<perception::UncertaintyTable> table_;
  workflow::TargetFinder finder_;
  planner::ProblemFamily family_;
};

}  // namespace

void BindPerception(nb::module_& m) {
  nb::class_<Finder>(m, "Finder")
      .def(
          "__init__",
          [](Finder* self, PlanningTask& task, const std::string& table) { new (self) Finder(task, table); }, "task"_a,
          "table"_a)
      .def(
          "in_depth",
          [](const Finder& self, const FloatArray& depth, const nb::dict& camera,
             const std::optional<FloatArray>& background) {
            perception::CameraIntrinsics intrinsics;
            const auto number = [&](const char* key) {
              double value = 0.0;
              if (!camera.contains(key) || !nb::try_cast(camera[key], value) || !std::isfinite(value)) {
                throw InputError("camera", std::string("has no number \"") + key + "\"",
                                 "give fx, fy, cx, cy and world_T_camera");
              }
              return value;
            };
            intrinsics.fx = number("fx");
            intrinsics.fy = number("fy");
            intrinsics.cx = number("cx");
            intrinsics.cy = number("cy");
            Eigen::Matrix4d pose;
            if (!camera.contains("world_T_camera") || !nb::try_cast(camera["world_T_camera"], pose)) {
              throw InputError("camera", "has no pose \"world_T_camera\"", "give a 4 x 4 pose");
            }
            intrinsics.world_T_camera = ToPose(pose, "world_T_camera");
            const perception::DepthFrame frame = ToDepth(depth, "depth");
            intrinsics.width = frame.width;
            intrinsics.height = frame.height;
            std::optional<perception::DepthFrame> behind;
            if (background) behind = ToDepth(*background, "background");
            perception::Registration found;
            {
              const nb::gil_scoped_release released;
              found = self.finder().InDepth(frame, intrinsics, behind ? &*behind : nullptr);
            }
            return self.Answer(found);
          },
          "depth"_a, "camera"_a, "background"_a.none())
      .def(
          "in_cloud",
          [](const Finder& self, const DoubleArray& cloud, const Eigen::Vector3d& eye_m) {
            const perception::Points points = ToPoints(cloud);
            if (!eye_m.allFinite()) throw InputError("eye_m", "is not finite", "give where the camera stands, metres");
            perception::Registration found;
            {
              const nb::gil_scoped_release released;
              found = self.finder().InCloud(points, eye_m);
            }
            return self.Answer(found);
          },
          "cloud"_a, "eye_m"_a);
  m.def(
      "look",
      [](PlanningTask& task, std::uint64_t seed, std::uint64_t episode) {
        const auto scene = std::make_shared<const env::Scene>(env::BuildScene(task.model()));
        const auto finder = std::make_shared<const workflow::TargetFinder>(task.model());
        const nb::gil_scoped_release released;
        workflow::CameraCell cell(scene, finder);
        RandomStream random(seed, episode, "placement");
        const workflow::PlacementDraw placement = cell.DrawPlacement(random);
        RandomStream noise(seed, episode, "camera");
        cell.Look(placement.world_T_target, seed, episode, noise);
        const nb::gil_scoped_acquire acquired;
        const auto picture = [](const perception::DepthFrame& frame) {
          return NewArray(std::vector<float>(frame.depth_m),
                          {static_cast<std::size_t>(frame.height), static_cast<std::size_t>(frame.width)});
        };
        nb::dict camera;
        camera["fx"] = cell.intrinsics().fx;
        camera["fy"] = cell.intrinsics().fy;
        camera["cx"] = cell.intrinsics().cx;
        camera["cy"] = cell.intrinsics().cy;
        camera["world_T_camera"] = Eigen::Matrix4d(cell.intrinsics().world_T_camera.matrix());
        nb::dict d;
        d["depth"] = picture(cell.depth());
        d["background"] = picture(cell.background());
        d["camera"] = camera;
        d["world_T_target"] = Eigen::Matrix4d(placement.world_T_target.matrix());
        return nb::object(d);
      },
      "task"_a, "seed"_a, "episode"_a, "What the simulated depth camera sees of a target somewhere in the workspace.");
}

}  // namespace feeler::python
