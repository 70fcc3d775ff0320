#include "feeler/cad/align/alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>

#include "feeler/cad/align/directions.h"
#include "feeler/cad/align/play.h"
#include "feeler/cad/align/trials.h"
#include "feeler/cad/measure/sliding.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kAbove_m = 1e-3;

struct Found {
  Trial trial;
  Eigen::Vector3d offset;
  double engaged_m;
  double slack_m;
  double engaged_m3 = 0.0;   ///< of material in the other part's holes: of two pins both count
  Eigen::Vector2d middle{};  ///< of that material, in the frame of the turned target
  Eigen::Vector3d mouth{};   ///< in CAD coordinates of the target
};

/// Area of the loops around material of one section that lie in holes of the other, and the box around them.
double AreaInHoles(const std::vector<SlabLoop>& inside, const std::vector<SlabLoop>& around, Eigen::AlignedBox2d& box) {
  double area = 0;
  for (const SlabLoop& loop : inside) {
    if (SignedArea(loop) < 0) continue;
    const bool held = std::any_of(around.begin(), around.end(), [&](const SlabLoop& hole) {
      return SignedArea(hole) < 0 && Encloses(hole, loop.front().middle);
    });
    if (!held) continue;
    area += SignedArea(loop);
    box.extend(BoundsOf(loop));
  }
  return area;
}

/// The same of both parts in each other's holes, at a height.
double AreaInHoles(const TriangleMesh& a, const TriangleMesh& b, double height_m, Eigen::AlignedBox2d& box) {
  const std::vector<SlabLoop> of_a = SectionAt(a, height_m);
  const std::vector<SlabLoop> of_b = SectionAt(b, height_m);
  return AreaInHoles(of_a, of_b, box) + AreaInHoles(of_b, of_a, box);
}

std::optional<Found> Verify(const Turned& tool_part, const Turned& target, const Trial& trial) {
  Pose roll = Pose::Identity();
  roll.linear() = Roll(trial.roll_rad);
  const TriangleMesh tool = Transformed(tool_part.mesh, roll);
  const Box tool_box = BoundsOf(tool);
  const Box target_box = BoundsOf(target.mesh);
  const MeshSlide slide(tool, *target.tree);
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  const double clear = target_box.max().z() - tool_box.min().z() + kAbove_m;
  const double through = target_box.sizes().z() + tool_box.sizes().z() + 2 * kAbove_m;
  Eigen::Vector3d offset(trial.place.x(), trial.place.y(), clear);
  Found found{trial, offset, 0, 0};
  const double most_slack = std::max(kMostSlack * trial.size_m, 3e-4);
  for (int round = 0; round < 3; ++round) {
    // What of the target's feature the tool reaches; a tool that goes through stops where the hole ends.
    const double travel = slide.Travel(offset, down, through);
    double depth = trial.high_m - (tool_box.min().z() + offset.z() - travel);
    depth = std::min(depth, std::min(trial.high_m - trial.low_m, tool_box.sizes().z()));
    if (depth < kLeastEngaged_m) return std::nullopt;
    Eigen::Vector3d in = offset;
    in.z() = trial.high_m - tool_box.min().z() - depth + std::min(1e-4, 0.1 * depth);
    // The feature's own depth may be less than that of the way: the tool may not stand in the floor.
    in.z() = std::max(in.z(), offset.z() - travel + 1e-5);
    if (!Center(slide, most_slack, in, found.slack_m)) return std::nullopt;
    found.engaged_m = depth;
    found.offset = in;
    offset.head<2>() = in.head<2>();
    if (slide.Travel(in, Eigen::Vector3d::UnitZ(), through) < through) return std::nullopt;  // not the way it came
  }
  // Down to where it stops, or as deep as they are in each other at most.
  const double rest = slide.Travel(found.offset, down, through);
  const double bottom = std::min(found.offset.z() - (trial.low_m - tool_box.min().z()), rest);
  found.offset.z() -= rest < through ? rest : std::max(bottom, 0.0);
  found.engaged_m = trial.high_m - (tool_box.min().z() + found.offset.z());
  TriangleMesh in = tool;
  for (Eigen::Vector3d& point : in.points) point += found.offset;
  Eigen::AlignedBox2d held;
  double height = found.engaged_m;
  double area = AreaInHoles(in, target.mesh, trial.high_m - 0.5 * height, held);
  if (area == 0) {  // a tool that stands far out of a thin plate
    height = std::min(height, trial.high_m - trial.low_m);
    area = AreaInHoles(in, target.mesh, trial.high_m - 0.5 * height, held);
  }
  found.engaged_m3 = height * area;
  found.middle = held.isEmpty() ? BoundsOf(in).center().head<2>().eval() : held.center();
  found.mouth = target.rotation.transpose() * Eigen::Vector3d(found.middle.x(), found.middle.y(), trial.high_m);
  return found;
}

/// How near the choice is to the CAD frames as they are; of equals the least.
double Strangeness(const Found& found) {
  return 16.0 * static_cast<double>(found.trial.target) + 4.0 * static_cast<double>(found.trial.tool) +
         std::min(found.trial.roll_rad, 2 * kPi - found.trial.roll_rad);
}

/// Whether two ways in lead to one place: what is in holes lies there, or the tool stands there. Two holes lie a size
/// apart at least; the ends of a tool, with a key and without, have their middles in one hole at different places.
bool OneMouth(const Found& a, const Found& b) {
  constexpr double kPartOfSize = 0.25;
  if (a.trial.target != b.trial.target) return false;
  const double near_m =
      std::max(5e-4 + 2 * std::min(a.slack_m, b.slack_m), kPartOfSize * std::min(a.trial.size_m, b.trial.size_m));
  if ((a.middle - b.middle).norm() <= near_m) return true;
  return a.trial.tool == b.trial.tool && a.trial.roll_rad == b.trial.roll_rad &&
         (a.offset - b.offset).head<2>().norm() <= near_m;
}

std::string InMillimetres(const Eigen::Vector3d& p) {
  return fmt::format("{:.2f},{:.2f},{:.2f}", 1000 * p.x() + 0.0, 1000 * p.y() + 0.0, 1000 * p.z() + 0.0);
}

[[noreturn]] void NoFit(const Miss& miss, bool tried) {
  constexpr double kNone_m = 1e-6;
  if (miss.too_wide_m < kNone_m) {
    throw InputError(
        "tool and target",
        fmt::format("have no clearance: {:.4f} x {:.4f} mm goes into a hole of {:.4f} x {:.4f} mm",
                    1000 * miss.inner.x(), 1000 * miss.inner.y(), 1000 * miss.hole.x(), 1000 * miss.hole.y()),
        "a fit without play cannot be simulated with rigid parts: make the hole larger by what the parts "
        "have in truth");
  }
  if (tried) {
    throw InputError("tool and target",
                     "sections of one fit into holes of the other, but no way in leads there along an axis",
                     "give the assembled poses with --aligned, or --tool-pose and --target-pose");
  }
  if (!std::isfinite(miss.too_wide_m)) {
    throw InputError("tool and target", "do not fit: no section of one is near the size of a hole of the other",
                     "are both in the same --unit, and is it these two that mate?");
  }
  throw InputError(
      "tool and target",
      fmt::format("do not fit: the nearest is {:.3f} x {:.3f} mm for a hole of {:.3f} x {:.3f} mm, {:.3f} mm too wide",
                  1000 * miss.inner.x(), 1000 * miss.inner.y(), 1000 * miss.hole.x(), 1000 * miss.hole.y(),
                  1000 * miss.too_wide_m),
      "check the sizes and the --unit; where the hole is open at a side, give the assembled poses: --aligned");
}

/// Of ways that differ by a small turn alone, that with the most play: the others are it, turned as far as play allows.
void KeepUnturned(std::vector<Found>& found) {
  constexpr double kSmall_rad = 5.0 * kPi / 180.0;
  constexpr double kMore_m = 1e-6;
  const std::vector<Found> all = found;
  std::erase_if(found, [&](const Found& f) {
    return std::any_of(all.begin(), all.end(), [&](const Found& other) {
      const double turn_rad = std::remainder(f.trial.roll_rad - other.trial.roll_rad, 2.0 * kPi);
      return other.trial.tool == f.trial.tool && std::abs(turn_rad) < kSmall_rad && OneMouth(f, other) &&
             other.slack_m > f.slack_m + kMore_m && other.engaged_m >= 0.9 * f.engaged_m;
    });
  });
}

/// Of what fits, the tightest; of equals the deepest.
std::vector<const Found*> BestFits(const std::vector<Found>& found) {
  // What has little in the other part's holes went there by chance.
  double most = 0;
  for (const Found& f : found) most = std::max(most, f.engaged_m3);
  double tightest = std::numeric_limits<double>::infinity();
  const auto by_chance = [&](const Found& f) { return f.engaged_m3 < 0.7 * most; };
  for (const Found& f : found) {
    if (!by_chance(f)) tightest = std::min(tightest, f.slack_m);
  }
  const auto as_tight = [&](const Found& f) { return !by_chance(f) && f.slack_m <= 1.25 * tightest + 5e-6; };
  double deepest = 0;
  for (const Found& f : found) {
    if (as_tight(f)) deepest = std::max(deepest, f.engaged_m);
  }
  std::vector<const Found*> best;
  for (const Found& f : found) {
    if (as_tight(f) && f.engaged_m >= 0.9 * deepest) best.push_back(&f);
  }
  return best;
}

[[noreturn]] void NoMouthNear(const Eigen::Vector3d& place, const std::vector<Found>& found) {
  std::string mouths;
  std::vector<const Found*> named;
  for (const Found* fit : BestFits(found)) {
    if (std::any_of(named.begin(), named.end(), [&](const Found* known) { return OneMouth(*fit, *known); })) continue;
    named.push_back(fit);
    mouths += (mouths.empty() ? "" : " and ") + InMillimetres(fit->mouth);
  }
  throw InputError("--mouth", fmt::format("no mouth near {} mm", InMillimetres(place)),
                   fmt::format("the tool fits at {} mm", mouths));
}

/// Of equal fits those in the mouth that was asked for.
void KeepNearest(const Eigen::Vector3d& place, std::vector<const Found*>& fits) {
  const Found& nearest = **std::min_element(fits.begin(), fits.end(), [&](const Found* a, const Found* b) {
    return (a->mouth - place).norm() < (b->mouth - place).norm() - 1e-9;
  });
  std::erase_if(fits, [&](const Found* fit) { return !OneMouth(*fit, nearest); });
}

}  // namespace

Alignment FindAlignment(const TriangleMesh& tool, const TriangleMesh& target, const AlignOptions& options) {
  std::vector<Turned> tools;
  std::vector<Turned> targets;
  // The first direction of a tool is its CAD frame's -z: it comes down.
  for (const Eigen::Vector3d& d : CandidateDirections(tool)) tools.push_back(TurnedPart(tool, RotationToZ(d)));
  for (const Eigen::Vector3d& d : CandidateDirections(target)) targets.push_back(TurnedPart(target, RotationToZ(d)));
  Miss miss;
  const std::vector<Trial> trials = TrialsOf(tools, targets, miss);
  if (trials.empty()) NoFit(miss, false);
  std::vector<Found> found;
  for (const Trial& trial : trials) {
    Turned& turned = targets[trial.target];
    if (!turned.tree) turned.tree = std::make_unique<MeshTree>(turned.mesh);
    if (auto result = Verify(tools[trial.tool], turned, trial)) found.push_back(*result);
  }
  if (found.empty()) NoFit(miss, true);
  KeepUnturned(found);
  if (options.mouth) {
    const std::vector<Found> all = found;
    std::erase_if(found,
                  [&](const Found& f) { return (f.mouth - *options.mouth).norm() >= 0.5 * f.trial.size_m + 2e-3; });
    if (found.empty()) NoMouthNear(*options.mouth, all);
  }
  std::vector<const Found*> equals = BestFits(found);
  if (options.mouth) KeepNearest(*options.mouth, equals);
  // Of equals that nearest to the CAD frames.
  const Found* best = equals.front();
  for (const Found* fit : equals) {
    if (Strangeness(*fit) < Strangeness(*best) - 1e-9) best = fit;
  }
  for (const Found* other : equals) {
    if (other->trial.target != best->trial.target || OneMouth(*other, *best)) continue;
    throw InputError("target",
                     fmt::format("two mouths fit as well: at {} and at {} mm", InMillimetres(best->mouth),
                                 InMillimetres(other->mouth)),
                     "choose one with --mouth X,Y,Z");
  }
  Alignment alignment;
  if (equals.size() > 1)
    alignment.notes.push_back(fmt::format(
        "the parts go together in {} ways that are alike; taken is the one nearest to the CAD frames", equals.size()));
  const Turned& chosen_target = targets[best->trial.target];
  Eigen::Vector3d offset = best->offset;
  double roll_rad = best->trial.roll_rad;
  if (best->trial.roll_is_about)
    CenterRoll(tools[best->trial.tool].mesh, *chosen_target.tree, best->middle, offset, roll_rad);
  alignment.frame_T_tool = FrameOf(Roll(roll_rad) * tools[best->trial.tool].rotation, offset);
  alignment.frame_T_target = FrameOf(chosen_target.rotation, Eigen::Vector3d::Zero());
  alignment.tool_has_opening = best->trial.tool_has_opening;
  alignment.engaged_m = best->engaged_m;
  alignment.slack_m = best->slack_m;
  return alignment;
}

}  // namespace feeler::cad
