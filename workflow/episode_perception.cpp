#include "workflow/episode_perception.h"

#include <fmt/format.h>

#include "core/random.h"
#include "workflow/perceive_table.h"

namespace feeler::workflow {

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
  draw.world_T_estimate = hypotheses.world_T_estimate;
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
