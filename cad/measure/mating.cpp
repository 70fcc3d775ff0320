#include "feeler/cad/measure/mating.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "feeler/cad/measure/sliding.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

constexpr double kPi = std::numbers::pi;
/// Play may grow by this, or by a quarter of the tool's width, from a lead-in; more is no mouth.
constexpr double kLargestLeadIn_m = 2e-3;
constexpr int kProfileSteps = 32;
/// Just inside the mouth.
constexpr double kJustInside_m = 5e-5;

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

class Player {
 public:
  Player(const TriangleMesh& tool, const MeshTree& target)
      : slide_(tool, target), size_m_(BoundsOf(tool).sizes().head<2>().minCoeff()) {}

  /// Half the play along x and y with the tool lifted by `lift_m`; stops counting at `most_m`.
  Eigen::Vector2d Half(double lift_m, double most_m) const {
    Eigen::Vector2d half;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
      half[axis] = 0.5 * (slide_.Travel(lift_m * kUp, unit, most_m) + slide_.Travel(lift_m * kUp, -unit, most_m));
    }
    return half;
  }
  const MeshSlide& slide() const { return slide_; }
  double size_m() const { return size_m_; }

 private:
  MeshSlide slide_;
  double size_m_;
};

/// The lift at which the tool leaves the mouth: its play jumps there.
double LiftToMouth(const Player& player, double seated_m, double out_m) {
  const Eigen::Vector2d seated = player.Half(seated_m, 1e-2);
  const double growth = std::max(kLargestLeadIn_m, 0.25 * player.size_m());
  const double most = seated.maxCoeff() + growth + 1e-4;
  const auto bounded = [&](double lift) {
    const Eigen::Vector2d half = player.Half(lift, most);
    return half.x() < seated.x() + growth && half.y() < seated.y() + growth;
  };
  double in = seated_m;
  double out = out_m;
  const int steps = 64;
  for (int i = 1; i <= steps; ++i) {
    const double lift = seated_m + (out_m - seated_m) * i / steps;
    if (bounded(lift)) {
      in = lift;
      continue;
    }
    out = lift;
    break;
  }
  while (out - in > 2e-7) {
    const double middle = 0.5 * (in + out);
    (bounded(middle) ? in : out) = middle;
  }
  return out;
}

/// A level of the mesh very near to a height, or the height.
double SnappedToLevel(const TriangleMesh& mesh, double height_m) {
  double best = 2e-6;
  double snapped = height_m;
  for (const Eigen::Vector3d& p : mesh.points) {
    if (std::abs(p.z() - height_m) < best) {
      best = std::abs(p.z() - height_m);
      snapped = p.z();
    }
  }
  return snapped;
}

/// The largest share of the play along each axis alone, `half_m`, with which the tool displaced along both at once
/// still enters.
Eigen::Vector2d MouthPlay(const Player& player, double lift_m, const Eigen::Vector2d& half_m) {
  double share = 1.0;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector3d way((corner % 2 == 0 ? 1 : -1) * half_m.x(), (corner / 2 == 0 ? 1 : -1) * half_m.y(), 0);
    share = std::min(share, player.slide().Travel(lift_m * kUp, way.normalized(), way.norm()) / way.norm());
  }
  return share * half_m;
}

TriangleMesh TurnedAboutZ(const TriangleMesh& mesh, double angle) {
  Pose turn = Pose::Identity();
  turn.linear() = Eigen::AngleAxisd(angle, kUp).toRotationMatrix();
  return Transformed(mesh, turn);
}

void MeasureTurns(const TriangleMesh& tool, const MeshTree& target, double lift_m, Mating& mating) {
  const auto fits = [&](double degrees) {
    const TriangleMesh turned = TurnedAboutZ(tool, degrees * kPi / 180);
    return !MeshSlide(turned, target).Overlap(lift_m * kUp);
  };
  mating.round = true;
  for (int degrees = 10; degrees < 360 && mating.round; degrees += 10) mating.round = fits(degrees);
  for (const int degrees : {60, 72, 90, 120, 144, 180, 216, 240, 270, 288, 300}) {
    if (mating.round || fits(degrees)) mating.turns_deg.push_back(degrees);
  }
}

/// Holes of one part that hold material of the other, at a height.
std::vector<SlabLoop> HolesAround(const std::vector<SlabLoop>& around, const std::vector<SlabLoop>& inside) {
  std::vector<SlabLoop> holes;
  for (const SlabLoop& hole : around) {
    if (SignedArea(hole) > 0) continue;
    const bool holds = std::any_of(inside.begin(), inside.end(), [&](const SlabLoop& loop) {
      return SignedArea(loop) > 0 && Encloses(hole, loop.front().middle);
    });
    if (holds) holes.push_back(hole);
  }
  return holes;
}

/// Direction of the longest side of the loops, folded into +-45 degrees; 0 where none stands out.
double EdgeAngle(const std::vector<SlabLoop>& loops) {
  double longest = 0;
  double angle = 0;
  double perimeter = 0;
  for (const SlabLoop& raw : loops) {
    const SlabLoop loop = Simplified(raw, [](const SlabPoint&) { return 1e-6; });
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d e = loop[(i + 1) % loop.size()].middle - loop[i].middle;
      perimeter += e.norm();
      if (e.norm() <= longest + 1e-7) continue;
      longest = e.norm();
      angle = std::atan2(e.y(), e.x());
    }
  }
  if (longest < 0.08 * perimeter) return 0;
  angle -= kPi / 2 * std::round(angle / (kPi / 2));
  return std::abs(angle) < 1e-6 ? 0 : angle;
}

void FindOpenings(const TriangleMesh& tool, const TriangleMesh& target, Mating& mating) {
  // A little below the rim, the tool fully in; both in the frame of the target.
  const double below = std::min(0.02 * mating.depth_m, 5e-5);
  TriangleMesh in = tool;
  for (Eigen::Vector3d& p : in.points) p.z() -= mating.depth_m;
  std::vector<SlabLoop> holes = HolesAround(SectionAt(target, -below), SectionAt(in, -below));
  if (!holes.empty()) {
    mating.tool_has_opening = false;
    mating.openings = std::move(holes);
    mating.opening_low_m = mating.through ? BoundsOf(target).min().z() : -mating.depth_m;
    mating.opening_high_m = 0;
    return;
  }
  // The tool's own mouth: a little above its lower end, which stands depth_m below the rim.
  const double above = -mating.depth_m + below;
  holes = HolesAround(SectionAt(in, above), SectionAt(target, above));
  if (holes.empty()) return;
  mating.tool_has_opening = true;
  mating.openings = std::move(holes);
  mating.opening_low_m = 0;
  mating.opening_high_m = mating.through ? BoundsOf(tool).max().z() : mating.depth_m;
}

/// Across: what of the tool is below the rim when it is in, and of the target above where the tool then ends. (A hub is
/// wider than the shaft that it goes over, a block wider than the plug that it takes.)
Box MatingBox(const TriangleMesh& tool, const TriangleMesh& target, const Mating& mating) {
  const Box reach = BoundsOf(tool);
  Box box;
  const double margin = std::max(5e-4, 3 * mating.clearance_m.maxCoeff());
  for (int t = 0; t < tool.size(); ++t) {
    const Box triangle = BoundsOf(tool, t);
    if (triangle.min().z() <= mating.depth_m) box.extend(triangle);
  }
  Box stands;
  for (int t = 0; t < target.size(); ++t) {
    const Box triangle = BoundsOf(target, t);
    if (triangle.max().z() > kJustInside_m - mating.depth_m) stands.extend(triangle);
  }
  box = box.intersection(Box(stands.min().array() - margin, stands.max().array() + margin));
  box.min().z() = -mating.depth_m;
  box.max().z() = std::min(mating.depth_m, reach.max().z());
  for (const SlabLoop& loop : mating.openings) {
    for (const SlabPoint& p : loop) {
      box.extend(Eigen::Vector3d(p.middle.x(), p.middle.y(), 0));
    }
  }
  return {box.min().array() - margin, box.max().array() + margin};
}

}  // namespace

Mating MeasureMating(const TriangleMesh& tool_cad, const TriangleMesh& target_cad, const Pose& frame_T_tool,
                     const Pose& frame_T_target, bool tool_has_opening_hint) {
  Mating mating;
  mating.tool_has_opening = tool_has_opening_hint;
  TriangleMesh tool = Transformed(tool_cad, frame_T_tool);
  TriangleMesh target = Transformed(target_cad, frame_T_target);
  // Axes along the sides of what mates.
  Pose turn = Pose::Identity();
  const auto turn_parts = [&](double angle) {
    turn.linear() = Eigen::AngleAxisd(-angle, kUp).toRotationMatrix();
    tool = Transformed(tool, turn);
    target = Transformed(target, turn);
  };
  const double middle =
      0.5 * (BoundsOf(tool).min().z() + std::min(BoundsOf(tool).max().z(), BoundsOf(target).max().z()));
  if (const double angle = EdgeAngle(SectionAt(tool, middle)); angle != 0) turn_parts(angle);

  const MeshTree tree(target);
  const Player player(tool, tree);
  const double down = player.slide().Travel(Eigen::Vector3d::Zero(), -kUp, 1e-3);
  mating.through = down >= 1e-3;
  const double out = BoundsOf(target).max().z() - BoundsOf(tool).min().z() + 1e-4;
  const double seated = mating.through ? 0.0 : std::min(2e-5, 0.01 * out);
  const double lift = LiftToMouth(player, seated, out);
  // The rim is where the tool's lower end leaves.
  const double rim = SnappedToLevel(target, BoundsOf(tool).min().z() + lift);
  mating.depth_m = rim - BoundsOf(tool).min().z();
  if (mating.depth_m < 2e-4) {
    throw InputError("tool and target", "the tool is in by less than 0.2 mm: there is nothing to insert",
                     "place them as assembled");
  }
  mating.clearance_m = Eigen::Vector2d::Constant(1.0);
  for (int i = 0; i <= kProfileSteps; ++i) {
    const double depth = kJustInside_m + (mating.depth_m - seated - kJustInside_m) * i / kProfileSteps;
    const Eigen::Vector2d half = player.Half(mating.depth_m - depth, 1e-2);
    mating.profile.push_back({depth, half});
    if (2 * depth >= mating.depth_m || mating.depth_m < 2e-3) mating.clearance_m = mating.clearance_m.cwiseMin(half);
  }
  if (mating.clearance_m.minCoeff() < 1e-6) {
    throw InputError("tool and target",
                     fmt::format("have no clearance: {:.4f} x {:.4f} mm a side", 1000 * mating.clearance_m.x(),
                                 1000 * mating.clearance_m.y()),
                     "an interference fit cannot be simulated with rigid parts");
  }
  mating.lead_in_m = (mating.profile.front().half_m - mating.clearance_m).cwiseMax(0.0);
  mating.mouth_play_m = MouthPlay(player, mating.depth_m - kJustInside_m, mating.profile.front().half_m);

  // Origin: x and y in the middle of the opening, or of what goes in, as the sections say; z at the rim.
  TriangleMesh in = tool;
  const double at = rim - std::min(0.02 * mating.depth_m, 5e-5);
  std::vector<SlabLoop> mouth = HolesAround(SectionAt(target, at), SectionAt(in, at));
  if (mouth.empty()) mouth = SectionAt(tool, BoundsOf(tool).min().z() + 0.5 * mating.depth_m);
  Eigen::AlignedBox2d across;
  for (const SlabLoop& loop : mouth) across.extend(BoundsOf(loop));
  Pose shift = Pose::Identity();
  shift.translation() = Eigen::Vector3d(-across.center().x(), -across.center().y(), -rim);
  for (int k = 0; k < 3; ++k) {
    if (std::abs(shift.translation()[k]) < 1e-9) shift.translation()[k] = 0;
  }
  mating.frame_T_target = shift * turn * frame_T_target;
  Pose lifted = shift;
  lifted.translation().z() += mating.depth_m;
  mating.frame_T_tool = lifted * turn * frame_T_tool;
  tool = Transformed(tool_cad, mating.frame_T_tool);
  target = Transformed(target_cad, mating.frame_T_target);
  const MeshTree moved(target);
  MeasureTurns(tool, moved, -mating.depth_m + std::max(seated, 0.02 * mating.depth_m), mating);
  FindOpenings(tool, target, mating);
  mating.mating_box = MatingBox(tool, target, mating);
  return mating;
}

}  // namespace feeler::cad
