#include "feeler/evaluation/records/scoring.h"

#include <algorithm>
#include <cmath>

namespace feeler::evaluation {

double PartialDepth(const Task& task, const env::InsertionLimits& limits, double depth_m, double lateral_m) {
  if (!std::isfinite(depth_m) || !(lateral_m <= limits.lateral_m) || !(task.insertion_depth_m > 0.0)) return 0.0;
  return std::clamp(depth_m / task.insertion_depth_m, 0.0, 1.0);
}

EpisodeScore ScoreOf(const env::InsertionEnv& environment) {
  const env::InsertionVerdict verdict = environment.Judge();
  const env::RobotStatistics& statistics = environment.robot().statistics();
  EpisodeScore score;
  score.success = verdict.inserted;
  score.reason = env::ToString(verdict.reason);
  score.partial_depth = PartialDepth(environment.task(), environment.limits(), verdict.depth_m, verdict.lateral_m);
  score.lateral_m = verdict.lateral_m;
  score.peak_force_n = statistics.peak_force_n;
  score.impulse_ns = statistics.impulse_ns;
  score.forbidden_contacts = statistics.forbidden_contacts;
  score.path_length_m = statistics.path_length_m;
  score.sim_time_s = environment.robot().Time();
  return score;
}

}  // namespace feeler::evaluation
