#pragma once

#include <vector>

#include "feeler/evaluation/harness/episode_sweep.h"
#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kAcceptanceClosedLoopName = "acceptance-closed-loop";

/// A row of the acceptance table: settings that are counted together, and what they must reach.
struct AcceptanceRow {
  std::string name;
  std::vector<EpisodeSetting> settings;
  double required_inserted = 0.0;  ///< rate, 0..1
};

/// The closed loop at its full size: the plug over four sizes, ideal and with friction; truth outside of the
/// hypotheses; falling in; wrong sizes and angles; the tight socket and the further parts. Each with and without the
/// fallback ladder. `quick`: a few episodes a row.
std::vector<AcceptanceRow> AcceptanceClosedLoopRows(bool quick);

ExperimentResult RunAcceptanceClosedLoop(const ExperimentRequest& request);

}  // namespace feeler::evaluation
