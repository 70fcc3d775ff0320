#pragma once

#include <cstdint>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kNoisePriceEpisodesName = "noise-price-episodes";

/// How much of it is measured.
struct NoisePriceEpisodesProtocol {
  const char* extents = "7x7x7";
  std::vector<double> levels = {0.01, 0.02, 0.05};  ///< probabilities a step, ascending
  std::int64_t episodes = 25;                       ///< of each row
};

/// The price of noise in physics: missed contacts, false stops and spent steps, one kind at a time, drawn in the
/// simulated world. The policy that was planned for them beside the one that knows of none, on the same episodes, each
/// with and without fallbacks: insertions, insertions that were believed and were none, seconds.
ExperimentResult RunNoisePriceEpisodesOf(const NoisePriceEpisodesProtocol& protocol, const ExperimentRequest& request);
ExperimentResult RunNoisePriceEpisodes(const ExperimentRequest& request);

}  // namespace feeler::evaluation
