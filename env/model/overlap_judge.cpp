#include "feeler/env/model/overlap_judge.h"

#include <array>
#include <utility>

#include "feeler/env/model/geom_shapes.h"

namespace feeler::env {
namespace {

void Place(mjData& data, int geom, const Pose& pose) {
  Eigen::Map<Eigen::Vector3d>(data.geom_xpos + 3 * geom) = pose.translation();
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.geom_xmat + 9 * geom) = pose.linear();
}

}  // namespace

OverlapJudge::OverlapJudge(const TaskModel& task_model, FeltGeoms geoms, const Eigen::Quaterniond& orientation)
    : model_(mj_copyModel(nullptr, task_model.model.get()), ModelDeleter()),
      data_(MakeData(*model_)),
      tool_geoms_(std::move(geoms.tool)),
      target_geoms_(std::move(geoms.target)),
      tool_position_m_(static_cast<std::size_t>(model_->ngeom), Eigen::Vector3d::Zero()) {
  // The default tolerance of the convex collider, 1e-6 m, is half of the accuracy asked of travel distances.
  model_->opt.mpr_tolerance = 1e-8;
  model_->opt.mpr_iterations = 200;
  std::vector<std::pair<int, Pose>> placed;
  for (const int geom : tool_geoms_) {
    placed.emplace_back(geom, GeomInBody(*model_, geom, task_model.tool_body));
    tool_position_m_[static_cast<std::size_t>(geom)] = placed.back().second.translation();
  }
  for (const int geom : target_geoms_) {
    placed.emplace_back(
        geom, MakePose(Eigen::Vector3d::Zero(), orientation) * GeomInBody(*model_, geom, task_model.target_body));
  }
  for (const auto& [geom, pose] : placed) Place(*data_, geom, pose);
}

int OverlapJudge::Collide(int tool_geom, int target_geom, const Eigen::Vector3d& displacement_m, mjContact* contacts) {
  Eigen::Map<Eigen::Vector3d>(data_->geom_xpos + 3 * tool_geom) =
      tool_position_m_[static_cast<std::size_t>(tool_geom)] + displacement_m;
  int first = tool_geom;
  int second = target_geom;
  if (model_->geom_type[first] > model_->geom_type[second]) std::swap(first, second);
  const mjfCollision collide = mjCOLLISIONFUNC[model_->geom_type[first]][model_->geom_type[second]];
  return collide(model_.get(), data_.get(), contacts, first, second, 0.0);
}

bool OverlapJudge::Overlap(int tool_geom, int target_geom, const Eigen::Vector3d& displacement_m) {
  std::array<mjContact, mjMAXCONPAIR> contacts;
  const int count = Collide(tool_geom, target_geom, displacement_m, contacts.data());
  for (int i = 0; i < count; ++i) {
    if (contacts[static_cast<std::size_t>(i)].dist < 0) return true;
  }
  return false;
}

bool OverlapJudge::Near(int tool_geom, int target_geom, const Eigen::Vector3d& displacement_m) const {
  if (model_->geom_type[target_geom] == mjGEOM_PLANE) return true;
  const double reach = model_->geom_rbound[tool_geom] + model_->geom_rbound[target_geom];
  const Eigen::Vector3d between = tool_position_m_[static_cast<std::size_t>(tool_geom)] + displacement_m -
                                  Eigen::Map<const Eigen::Vector3d>(data_->geom_xpos + 3 * target_geom);
  return between.squaredNorm() <= reach * reach;
}

bool OverlapJudge::Overlap(const Eigen::Vector3d& displacement_m) {
  for (const int tool_geom : tool_geoms_) {
    for (const int target_geom : target_geoms_) {
      if (Near(tool_geom, target_geom, displacement_m) && Overlap(tool_geom, target_geom, displacement_m)) return true;
    }
  }
  return false;
}

std::optional<OverlapJudge::Meeting> OverlapJudge::Meet(const Eigen::Vector3d& displacement_m) {
  Meeting deepest;
  std::array<mjContact, mjMAXCONPAIR> contacts;
  for (const int tool_geom : tool_geoms_) {
    for (const int target_geom : target_geoms_) {
      if (!Near(tool_geom, target_geom, displacement_m)) continue;
      const int count = Collide(tool_geom, target_geom, displacement_m, contacts.data());
      for (int i = 0; i < count; ++i) {
        const mjContact& contact = contacts[static_cast<std::size_t>(i)];
        if (-contact.dist <= deepest.depth_m) continue;
        deepest = {tool_geom, target_geom, Eigen::Map<const Eigen::Vector3d>(contact.pos), -contact.dist};
      }
    }
  }
  return deepest.tool_geom < 0 ? std::nullopt : std::optional(deepest);
}

}  // namespace feeler::env
