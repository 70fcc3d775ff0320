#pragma once

#include <string>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"
#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::evaluation {

inline constexpr const char* kPomdpBenchmarksName = "pomdp-benchmarks";

/// What is solved, and for how long.
struct PomdpBenchmarksProtocol {
  double time_limit_s = 60.0;      ///< of the search between bounds, a model
  double bel_time_limit_s = 20.0;  ///< of RTDP-Bel, a model
  int levels = 15;                 ///< of its discretisation
  int episodes = 10000;            ///< of its controller
};

/// Each model by the search between bounds (its interval, beside SARSOP's where that is printed) and by RTDP-Bel (the
/// exact value of its controller, and that in episodes). Finished models are kept in the folder.
ExperimentResult RunPomdpBenchmarksOn(const std::vector<planner::Pomdp>& models,
                                      const PomdpBenchmarksProtocol& protocol, const ExperimentRequest& request);

/// Tiger and RockSample by their published descriptions, and every .pomdp and .pomdpx of ExperimentRequest::pomdps.
/// Throws InputError for a folder that is not there or a file that cannot be read.
ExperimentResult RunPomdpBenchmarks(const ExperimentRequest& request);

}  // namespace feeler::evaluation
