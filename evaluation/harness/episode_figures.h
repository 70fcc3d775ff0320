#pragma once

#include <string>
#include <vector>

#include "feeler/evaluation/harness/episode_sweep.h"
#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

/// What several experiments in physics show of a setting.
struct EpisodePoint {
  std::string series;
  double x = 0.0;
  EpisodeStatistics statistics;
};

/// Success, seconds, path length and peak force against x, one figure each; series in order of first appearance. A
/// point without an inserted episode is left out where only those count.
std::vector<Figure> EpisodeFigures(const std::string& title, const std::string& x_label, bool x_log,
                                   const std::vector<EpisodePoint>& points);

/// Columns that describe the statistics of a setting, and their values.
std::vector<std::string> EpisodeColumns();
std::vector<nlohmann::json> EpisodeValues(const EpisodeStatistics& statistics);
/// The same for people: a header and a line (without line ends).
std::string EpisodeHeader();
std::string EpisodeLine(const EpisodeStatistics& statistics);

}  // namespace feeler::evaluation
