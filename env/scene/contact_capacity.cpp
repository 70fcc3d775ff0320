#include "feeler/env/scene/contact_capacity.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/env/model/task_pieces.h"
#include "feeler/env/scene/scene.h"
#include "feeler/planner/contact/convex_shape.h"

namespace feeler::env {
namespace {

constexpr int kRowsPerContact = 4;
constexpr int kRowsOfRobot = 24;  // friction and limits of joints, and what touches the bench
constexpr int kMostRows = 4000;
constexpr double kOverlap_m = 0.0005;  // how far a touch presses in
constexpr double kNear_m = 0.001;      // boxes around turned pieces, and pieces that stand on a slant

struct Bounds {
  Eigen::AlignedBox3d box;
  bool is_box = false;
};

Eigen::AlignedBox3d BoxAround(const planner::ConvexPiece& piece) {
  const planner::ConvexShape shape(piece);
  Eigen::AlignedBox3d box;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) box.extend(shape.Support(sign * Eigen::Vector3d::Unit(axis)));
  }
  return box;
}

std::vector<Bounds> BoundsOf(const std::vector<planner::ConvexPiece>& pieces) {
  std::vector<Bounds> bounds;
  for (const planner::ConvexPiece& piece : pieces) {
    bounds.push_back({BoxAround(piece), piece.kind == planner::ShapeKind::kBox});
  }
  return bounds;
}

int ContactsAt(const Eigen::Vector3d& tool_at, const std::vector<Bounds>& tool, const std::vector<Bounds>& target) {
  int contacts = 0;
  for (const Bounds& mine : tool) {
    Eigen::AlignedBox3d box = mine.box.translated(tool_at);
    box.min() -= Eigen::Vector3d::Constant(kNear_m);
    box.max() += Eigen::Vector3d::Constant(kNear_m);
    for (const Bounds& theirs : target) {
      if (box.intersects(theirs.box)) contacts += mine.is_box && theirs.is_box ? 4 : 1;
    }
  }
  return contacts;
}

}  // namespace

ContactCapacity CapacityFor(const TaskModel& task_model) {
  const TaskPieces pieces = PiecesOf(task_model, Opening::kOpen);
  const std::vector<Bounds> tool = BoundsOf(pieces.tool);
  const std::vector<Bounds> target = BoundsOf(pieces.target);
  Eigen::AlignedBox3d whole;
  for (const Bounds& piece : tool) whole.extend(piece.box);
  int most = 0;
  for (const Bounds& piece : target) {
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d at = piece.box.center() - whole.center();
      at[axis] = piece.box.max()[axis] - whole.min()[axis] - kOverlap_m;
      most = std::max(most, ContactsAt(at, tool, target));
      at[axis] = piece.box.min()[axis] - whole.max()[axis] + kOverlap_m;
      most = std::max(most, ContactsAt(at, tool, target));
    }
  }
  const Eigen::Vector3d inward = UnitVector(task_model.task.insertion);
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    most = std::max(most, ContactsAt(share * task_model.task.insertion_depth_m * inward, tool, target));
  }
  const SceneOptions least;
  ContactCapacity capacity;
  capacity.rows = std::clamp(kRowsPerContact * most + kRowsOfRobot, least.max_constraints, kMostRows);
  capacity.contacts = std::max(least.max_contacts, capacity.rows / kRowsPerContact);
  return capacity;
}

}  // namespace feeler::env
