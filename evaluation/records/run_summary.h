#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "feeler/evaluation/records/episode_json.h"
#include "feeler/evaluation/records/statistics.h"

namespace feeler::evaluation {

/// What a set of episodes came to.
struct RunSummary {
  int episodes = 0;
  Rate localized;
  Rate inserted;
  double sim_time_mean_s = 0.0;    ///< over inserted episodes
  double sim_time_median_s = 0.0;  ///< over inserted episodes
  double sim_time_max_s = 0.0;     ///< over inserted episodes
  double moves_mean = 0.0;
  double contacts_mean = 0.0;
  double path_length_mean_m = 0.0;
  double peak_force_max_n = 0.0;
  double plan_cpu_s = 0.0;              ///< mean per episode
  Rate ladder_used;                     ///< episodes in which a fallback was tried
  std::map<std::string, int> rungs;     ///< rung -> episodes that used it
  std::map<std::string, int> failures;  ///< kind of reason (up to its colon) -> episodes not inserted
};

RunSummary Summarize(const std::vector<EpisodeSummaryRow>& rows);
nlohmann::json ToJson(const RunSummary& summary);
/// A table for people, a line per figure.
std::string ToText(const RunSummary& summary);

}  // namespace feeler::evaluation
