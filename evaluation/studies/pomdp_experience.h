#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"
#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::evaluation {

inline constexpr const char* kPomdpExperienceName = "pomdp-experience";

/// Problems that differ little from one another: all have the actions and observations of the first, whose policy is
/// the experience for the others.
struct PomdpFamily {
  std::string name;
  std::vector<planner::Pomdp> members;
  std::vector<double> epsilons;  ///< inflations of the heuristic, in costs to the goal
  int levels = 0;                ///< of the discretisation; 0: the protocol's
  std::int64_t expansion_limit = std::numeric_limits<std::int64_t>::max();  ///< a search, beside the protocol's
};

struct PomdpExperienceProtocol {
  int levels = 15;                           ///< of RTDP-Bel's discretisation
  std::int64_t expansion_limit = 2'000'000;  ///< a search
  double time_limit_s = 60.0;                ///< a search
};

/// RTDP-Bel without experience and E-RTDP-Bel with the policy of the first member on every other one: expansions, CPU
/// time and what the controllers are worth.
ExperimentResult RunPomdpExperienceOn(const std::vector<PomdpFamily>& families, const PomdpExperienceProtocol& protocol,
                                      const ExperimentRequest& request);

/// RockSample with a rock moved, Tag with a wall moved, noisy lattice problems with the slot moved.
ExperimentResult RunPomdpExperience(const ExperimentRequest& request);

}  // namespace feeler::evaluation
