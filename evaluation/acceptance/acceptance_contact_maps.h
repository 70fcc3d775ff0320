#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kAcceptanceContactMapsName = "acceptance-contact-maps";

/// Contact maps over orientation, built anew: CPU time of the build, and how often MuJoCo's collision detection
/// disagrees on random places on and between lattice points, away from grazing.
ExperimentResult RunAcceptanceContactMaps(const ExperimentRequest& request);

}  // namespace feeler::evaluation
