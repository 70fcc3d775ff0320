#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "feeler/evaluation/harness/database_table.h"

namespace feeler::evaluation {

inline constexpr const char* kBoundsName = "bounds";
ExperimentResult RunBounds(const ExperimentRequest& request);

struct BoundsProtocol {
  std::vector<std::string> extents = {"3x3x3", "5x5x5", "7x7x7", "11x11x11", "15x15x15"};
  double time_limit_s = 60.0;
  double gap = 1.0;
  std::int64_t expansion_limit = std::numeric_limits<std::int64_t>::max();
};

/// Anytime curves of the certified solver in the fast setting: for each socket (its name and case) and cuboid the
/// bounds over time.
ExperimentResult RunBoundsOn(const std::vector<std::pair<std::string, PlanningCase>>& sockets,
                             const BoundsProtocol& protocol, const ExperimentRequest& request);

}  // namespace feeler::evaluation
