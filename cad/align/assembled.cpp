#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "feeler/cad/align/alignment.h"
#include "feeler/cad/align/directions.h"
#include "feeler/cad/align/play.h"
#include "feeler/cad/measure/sliding.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

/// Parts that overlap by less than this touch.
constexpr double kTouch_m = 5e-6;
/// What a tool may stand above its stop without a word.
constexpr double kStands_m = 2e-5;
/// Tilts that are told from none, and those that are no other direction.
constexpr double kLeastTilt_rad = 1e-3;
constexpr double kMostTilt_rad = 0.1;

/// The angle between two lines through one point.
double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
}

/// How far the tool leans against the target about the way in: the angle between those of their own directions that are
/// nearest to it; nothing where one of them has none.
std::optional<double> TiltOf(const TriangleMesh& tool, const TriangleMesh& target, const Eigen::Vector3d& way_in) {
  std::optional<double> least;
  for (const Eigen::Vector3d& a : ShapeDirections(tool)) {
    if (AngleBetween(a, way_in) > kMostTilt_rad) continue;
    for (const Eigen::Vector3d& b : ShapeDirections(target)) {
      if (AngleBetween(b, way_in) > kMostTilt_rad) continue;
      least = std::min(least.value_or(kMostTilt_rad), AngleBetween(a, b));
    }
  }
  return least;
}

void RequireUpright(const TriangleMesh& tool, const TriangleMesh& target, const Eigen::Vector3d& way_in) {
  const double tilt = TiltOf(tool, target, way_in).value_or(0.0);
  if (tilt < kLeastTilt_rad) return;
  throw InputError(
      "tool and target",
      fmt::format("as they are placed the tool leans by {:.2f} degrees against the hole, {:.3f} mm in 10 mm",
                  tilt / kDegree, 10 * std::tan(tilt)),
      "place them upright, or leave the placement out: how they go together is found, too");
}

struct Way {
  Eigen::Vector3d direction;  ///< out
  Alignment alignment;
  double to_stop_m = 0.0;  ///< how far the tool stands above what stops it; 0 where nothing does
};

/// Whether the tool comes out along a direction, with play, but little, to all sides. `apart`: it does not overlap the
/// target as it stands.
std::optional<Way> WayOut(const TriangleMesh& tool, const TriangleMesh& target, const Eigen::Vector3d& direction,
                          bool& apart) {
  const Pose turn = FrameOf(RotationToZ(direction), Eigen::Vector3d::Zero());
  const TriangleMesh turned_tool = Transformed(tool, turn);
  const TriangleMesh turned_target = Transformed(target, turn);
  const MeshTree tree(turned_target);
  const MeshSlide slide(turned_tool, tree);
  const Box tool_box = BoundsOf(turned_tool);
  const double out = BoundsOf(turned_target).sizes().z() + tool_box.sizes().z();
  // A tool that stands on the floor touches it: judged a little above.
  Eigen::Vector3d offset = kTouch_m * Eigen::Vector3d::UnitZ();
  if (slide.Overlap(offset)) return std::nullopt;
  apart = true;
  if (slide.Travel(offset, Eigen::Vector3d::UnitZ(), out) < out) return std::nullopt;
  Way way{direction, {}, 0.0};
  const double most = kMostSlack * std::min(tool_box.sizes().x(), tool_box.sizes().y());
  if (!Center(slide, most, offset, way.alignment.slack_m)) return std::nullopt;
  const double travel = slide.Travel(offset, -Eigen::Vector3d::UnitZ(), out);
  if (travel < out && travel > kTouch_m + kStands_m) way.to_stop_m = travel - kTouch_m;
  offset.z() = 0;
  way.alignment.frame_T_tool = FrameOf(turn.linear(), offset);
  way.alignment.frame_T_target = turn;
  if (offset.norm() > 2e-6)
    way.alignment.notes.push_back(fmt::format("the tool is moved by {:.3f}, {:.3f} mm to the middle of its play",
                                              1000 * offset.x(), 1000 * offset.y()));
  return way;
}

}  // namespace

Alignment AlignAssembled(const TriangleMesh& tool, const TriangleMesh& target) {
  std::optional<Way> best;
  bool apart = false;  // along some direction
  std::vector<Eigen::Vector3d> directions = CandidateDirections(target);
  for (const Eigen::Vector3d& d : CandidateDirections(tool)) {
    if (std::none_of(directions.begin(), directions.end(), [&](const auto& known) { return known.dot(d) > 0.99996; }))
      directions.push_back(d);
  }
  for (const Eigen::Vector3d& direction : directions) {
    std::optional<Way> way = WayOut(tool, target, direction, apart);
    if (!way || (best && best->alignment.slack_m <= way->alignment.slack_m * (1 + 1e-6))) continue;
    best = std::move(way);
  }
  if (!apart) {
    throw InputError("tool and target", "overlap as they are placed",
                     "place them as assembled, with clearance all around");
  }
  if (!best) {
    throw InputError("tool and target", "the tool does not come out along any axis with play, but little, to all sides",
                     "place them as assembled; the parts have to be in each other");
  }
  RequireUpright(tool, target, best->direction);
  Alignment alignment = std::move(best->alignment);
  if (best->to_stop_m > 0) {
    alignment.frame_T_tool.translation().z() -= best->to_stop_m;
    alignment.notes.push_back(
        fmt::format("as it is placed the tool stands {:.3f} mm above what stops it: it is taken down to that (if it is "
                    "meant to end higher, --set feeler_insertion_depth)",
                    1000 * best->to_stop_m));
  }
  return alignment;
}

}  // namespace feeler::cad
