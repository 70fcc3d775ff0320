#pragma once

#include <string>
#include <vector>

#include "feeler/evaluation/harness/episode_sweep.h"
#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kVisualServoingName = "visual-servoing";

/// A scene looked at with one kind of feature.
struct VisualServoingRow {
  std::string scene;     ///< for people
  std::string features;  ///< "SIFT" or "tape corners"
  std::string printed;   ///< the variant of the paper that it stands for; empty: none
  EpisodeSetting setting;
};
std::vector<VisualServoingRow> VisualServoingRows(bool quick);

/// What episodes with a camera came to, from their records alone.
struct VisualServoingStatistics {
  Rate inserted;
  Estimate time;   ///< median, start pose to verdict, inserted episodes, s
  Estimate error;  ///< median of the final position, in space, episodes that reached the goal, m
  double error_p95_m = 0.0;
  double pictures_median = 0.0;  ///< inserted episodes
  nlohmann::json failures;       ///< reason (numbers left out) -> episodes
};
VisualServoingStatistics VisualServoingStatisticsOf(const std::vector<nlohmann::json>& records);

/// Image-based visual servoing in four scenes that differ in looks alone, over the same episodes: insertions, time,
/// final error, pictures taken, reasons of failure, beside the paper's two printed rows; with pictures of what the
/// camera sees.
ExperimentResult RunVisualServoing(const ExperimentRequest& request);

}  // namespace feeler::evaluation
