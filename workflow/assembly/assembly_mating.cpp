#include "feeler/workflow/assembly/assembly_mating.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "feeler/env/model/collision_filter.h"

namespace feeler::workflow {
namespace {

constexpr int kPlaces = 3000;
/// Overlaps less deep than this are touches: MuJoCo's iterative collision functions are exact to some micrometres.
constexpr double kTouch_m = 1e-4;

/// Signed distance of two geoms as they are placed in `data`, negative: depth; zero or more: they do not overlap.
double Distance(const mjModel& model, mjData& data, int first, int second) {
  if (env::SurelyApart(model, data, first, second)) return 1.0;
  if (model.geom_type[first] > model.geom_type[second]) std::swap(first, second);
  const mjfCollision collide = mjCOLLISIONFUNC[model.geom_type[first]][model.geom_type[second]];
  if (collide == nullptr) return 1.0;
  std::array<mjContact, mjMAXCONPAIR> contacts;
  const int count = collide(&model, &data, contacts.data(), first, second, 0.0);
  double distance = 1.0;
  for (int i = 0; i < count; ++i) distance = std::min(distance, contacts[static_cast<std::size_t>(i)].dist);
  return distance;
}

/// The thing a geom belongs to: a part, the robot, or a geom of the world by its name.
std::string OwnerOf(const env::Scene& scene, int geom) {
  const mjModel& model = *scene.model;
  if (scene.geom_part[static_cast<std::size_t>(geom)] == env::ScenePart::kRobot) return "the robot";
  const int body = model.geom_bodyid[geom];
  const char* name = body > 0 ? mj_id2name(&model, mjOBJ_BODY, body) : mj_id2name(&model, mjOBJ_GEOM, geom);
  return name == nullptr ? "the scene" : name;
}

/// A tool that may be put anywhere, against geoms that stay.
class LooseTool {
 public:
  LooseTool(const mjModel& model, int tool_body, std::vector<int> tool_geoms, std::vector<int> others)
      : model_(model), data_(env::MakeData(model)), tool_geoms_(std::move(tool_geoms)), others_(std::move(others)) {
    mj_kinematics(&model_, data_.get());
    const Pose body_T_world = env::BodyPose(*data_, tool_body).inverse();
    for (const int geom : tool_geoms_) body_T_geom_.push_back(body_T_world * GeomPose(geom));
  }

  mjData& data() { return *data_; }

  /// Keeps of the others what is not farther than `radius_m` from a point.
  void KeepNear(const Eigen::Vector3d& point, double radius_m) {
    std::erase_if(others_, [&](int geom) {
      const bool bounded = model_.geom_rbound[geom] > 0;
      return bounded && (GeomPose(geom).translation() - point).norm() > radius_m + model_.geom_rbound[geom];
    });
  }

  /// Depth of the deepest overlap with the tool at this pose, and with which geom; zero or less: none.
  std::pair<double, int> Depth(const Pose& world_T_tool) {
    for (std::size_t i = 0; i < tool_geoms_.size(); ++i) Put(tool_geoms_[i], world_T_tool * body_T_geom_[i]);
    std::pair<double, int> deepest{-1.0, -1};
    for (const int tool : tool_geoms_) {
      for (const int other : others_) {
        const double depth = -Distance(model_, *data_, tool, other);
        if (depth > deepest.first) deepest = {depth, other};
      }
    }
    return deepest;
  }

 private:
  Pose GeomPose(int geom) const {
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data_->geom_xmat + 9 * geom);
    pose.translation() = Eigen::Map<const Eigen::Vector3d>(data_->geom_xpos + 3 * geom);
    return pose;
  }
  void Put(int geom, const Pose& pose) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data_->geom_xmat + 9 * geom) = pose.linear();
    Eigen::Map<Eigen::Vector3d>(data_->geom_xpos + 3 * geom) = pose.translation();
  }

  const mjModel& model_;
  env::DataHandle data_;
  std::vector<int> tool_geoms_;
  std::vector<int> others_;
  std::vector<Pose> body_T_geom_;
};

constexpr std::array<int, 4> kBases = {2, 3, 5, 7};

/// The i-th number of the sequence of van der Corput in a base, in (0, 1); with several bases: of Halton. They fill a
/// box more evenly than drawn ones, and are nobody's seed.
double RadicalInverse(int i, int base) {
  double inverse = 0.0;
  for (double digit = 1.0 / base; i > 0; i /= base, digit /= base) inverse += digit * (i % base);
  return inverse;
}

/// Tool frame in the target frame, for every place that is compared.
std::vector<Pose> Places(const env::TaskModel& model) {
  const Task& task = model.task;
  const std::vector<Eigen::Quaterniond> turns = env::TargetOrientations(task);
  const Eigen::Vector3d half_m = LargestPositionExtents(task).cast<double>() * (0.5 * task.cell_m);
  std::vector<Pose> places;
  for (int i = 1; i <= kPlaces; ++i) {
    Eigen::Vector3d place = task.start_offset_m + task.workspace_center_m;
    for (int axis = 0; axis < 3; ++axis) {
      const double reach_m = task.workspace_m[axis] + (half_m[axis] > 0.51 * task.cell_m ? half_m[axis] : 0.0);
      place[axis] += reach_m * (2.0 * RadicalInverse(i, kBases[axis]) - 1.0);
    }
    const Eigen::Quaterniond turn =
        turns[static_cast<std::size_t>(RadicalInverse(i, kBases[3]) * static_cast<double>(turns.size()))];
    places.emplace_back(Pose(turn.inverse()) * Eigen::Translation3d(place));
  }
  return places;
}

}  // namespace

std::vector<PartOverlap> FindOverlaps(const env::Scene& scene, const env::JointVector& q_rad) {
  const mjModel& model = *scene.model;
  const env::DataHandle data = env::MakeData(model);
  env::ResetScene(scene, q_rad, *data);
  std::vector<std::pair<std::string, int>> things;
  for (const auto* list : {&scene.target_geoms, &scene.environment_geoms, &scene.robot_geoms}) {
    for (const int geom : *list) things.emplace_back(OwnerOf(scene, geom), geom);
  }
  std::map<std::pair<std::string, std::string>, double> deepest;
  for (std::size_t i = 0; i < things.size(); ++i) {
    for (std::size_t j = i + 1; j < things.size(); ++j) {
      if (things[i].first == things[j].first) continue;
      const double depth = -Distance(model, *data, things[i].second, things[j].second);
      if (depth < kTouch_m) continue;
      double& known = deepest[std::minmax(things[i].first, things[j].first)];
      known = std::max(known, depth);
    }
  }
  std::vector<PartOverlap> overlaps;
  for (const auto& [names, depth] : deepest) overlaps.push_back({names.first, names.second, depth});
  std::stable_sort(overlaps.begin(), overlaps.end(),
                   [](const PartOverlap& a, const PartOverlap& b) { return a.depth_m > b.depth_m; });
  return overlaps;
}

std::string MatingCheck::Difference(const env::Scene& scene, std::size_t insertion) {
  const AssemblyInsertion& step = assembly_.insertions[insertion];
  const env::TaskModel& task_model = *assembly_.tasks.at(step.task);
  const std::vector<Pose> places = Places(task_model);
  std::vector<double>& of_task = of_task_[step.task];
  if (of_task.empty()) {
    LooseTool tool(*task_model.model, task_model.tool_body, task_model.tool_geoms, task_model.target_geoms);
    const Pose world_T_target = env::BodyPose(tool.data(), task_model.target_body);
    for (const Pose& place : places) of_task.push_back(tool.Depth(world_T_target * place).first);
  }
  std::vector<int> others = scene.target_geoms;
  others.insert(others.end(), scene.environment_geoms.begin(), scene.environment_geoms.end());
  LooseTool tool(*scene.model, scene.tool_body, scene.tool_geoms, others);
  const Pose world_T_target = env::BodyPose(tool.data(), scene.target_body);
  tool.KeepNear(world_T_target.translation(), 0.5);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Pose world_T_tool = world_T_target * places[i];
    const auto [depth, other] = tool.Depth(world_T_tool);
    const Eigen::Vector3d mm = 1e3 * places[i].translation();
    const std::string place = fmt::format("{:.0f} {:.0f} {:.0f} mm from the port", mm.x(), mm.y(), mm.z());
    if (depth > kTouch_m && of_task[i] <= 0.0) {
      return fmt::format("the part meets {} {}, where the tool of task {} meets nothing", OwnerOf(scene, other), place,
                         step.task);
    }
    if (depth <= 0.0 && of_task[i] > kTouch_m) {
      return fmt::format("the part meets nothing {}, where the tool of task {} meets the target", place, step.task);
    }
  }
  return "";
}

}  // namespace feeler::workflow
