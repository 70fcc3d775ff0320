#include "workflow/episode_draw.h"

#include "core/error.h"
#include "core/random.h"
#include "env/insertion_env.h"

namespace feeler::workflow {

std::vector<int> AxisExtents(const Task& task, const planner::Extents& cuboid) {
  std::vector<int> extents;
  for (const UncertainAxis& axis : task.axes) {
    extents.push_back(axis.angular() ? axis.max_cells : cuboid[static_cast<int>(axis.kind)]);
  }
  return extents;
}

EpisodeDraw DrawEpisode(const Task& task, const planner::ProblemFamily& family, std::uint64_t seed,
                        std::uint64_t episode) {
  if (family.problems.empty()) throw InputError("episodes", "no problem to draw from", "give --extents or a database");
  EpisodeDraw draw;
  RandomStream problem(seed, episode, "problem");
  draw.extents = family.problems[problem.Index(family.problems.size())];
  draw.world_T_estimate = task.world_T_target;

  RandomStream truth(seed, episode, "true pose");
  draw.world_T_true = env::DrawTruePose(task, draw.world_T_estimate, AxisExtents(task, draw.extents), truth);
  return draw;
}

}  // namespace feeler::workflow
