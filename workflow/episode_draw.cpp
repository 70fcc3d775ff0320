#include "workflow/episode_draw.h"

#include "core/error.h"
#include "core/random.h"

namespace feeler::workflow {

EpisodeDraw DrawEpisode(const Task& task, const planner::ProblemFamily& family, std::uint64_t seed,
                        std::uint64_t episode) {
  if (family.problems.empty()) throw InputError("episodes", "no problem to draw from", "give --extents or a database");
  EpisodeDraw draw;
  RandomStream problem(seed, episode, "problem");
  draw.extents = family.problems[problem.Index(family.problems.size())];
  draw.world_T_estimate = task.world_T_target;

  RandomStream truth(seed, episode, "true pose");
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  for (const UncertainAxis& axis : task.axes) {
    // One draw per axis, whatever its kind, so that a task's other axes do not shift the stream.
    const double unit = truth.Uniform(-0.5, 0.5);
    if (axis.angular()) continue;
    const int index = static_cast<int>(axis.kind);
    offset_m[index] = unit * draw.extents[index] * task.cell_m;
  }
  draw.world_T_true = draw.world_T_estimate;
  draw.world_T_true.translation() += draw.world_T_estimate.linear() * offset_m;
  return draw;
}

}  // namespace feeler::workflow
