#include "feeler/workflow/episode/episode_perception.h"

#include <fmt/format.h>

#include "feeler/core/random.h"
#include "feeler/workflow/perception/perceive_table.h"

namespace feeler::workflow {

Pose WithKnownPlace(const Task& task, const Pose& world_T_estimate, const Pose& world_T_target) {
  Eigen::Vector3d known = (world_T_estimate.inverse() * world_T_target).translation();
  for (const UncertainAxis& axis : task.axes) {
    if (!axis.angular()) known[static_cast<int>(axis.kind)] = 0.0;
  }
  return world_T_estimate * Eigen::Translation3d(known);
}

EpisodeDraw DrawPerceived(const Task& task, const EpisodePerception& perception, const planner::ProblemFamily& family,
                          std::uint64_t seed, std::uint64_t episode, CameraCell& cell) {
  RandomStream places(seed, episode, "placement");
  const PlacementDraw placement = cell.DrawPlacement(places);
  EpisodeDraw draw;
  draw.rejected_placements = placement.rejected;
  draw.world_T_true = placement.world_T_target;
  draw.world_T_estimate = task.world_T_target;
  RandomStream picture(seed, episode, "picture");
  const Sight sight = cell.Look(placement.world_T_target, seed, 0, picture);
  const perception::Registration& found = sight.registration;
  draw.perception = PerceptionDraw{sight.distance_m, found.fitness, found.rms_m, found.points, sight.cpu_s};
  if (!found.found) {
    draw.failure = "target not found: " + found.reason;
    return draw;
  }
  const perception::PoseHypotheses hypotheses = HypothesesFor(perception.table, found.world_T_target);
  draw.world_T_estimate = WithKnownPlace(task, hypotheses.world_T_estimate, placement.world_T_target);
  const auto extents = SnapTo(family, task, hypotheses.counts);
  if (!extents) {
    draw.failure = "no policy: the database has no problem as large as the table asks for";
    return draw;
  }
  draw.extents = *extents;
  return draw;
}

bool TruthOutside(const Task& task, const EpisodeDraw& draw) {
  return !perception::Covers(task.axes, {draw.world_T_estimate, AxisExtents(task, draw.extents), 0, false},
                             draw.world_T_true);
}

}  // namespace feeler::workflow
