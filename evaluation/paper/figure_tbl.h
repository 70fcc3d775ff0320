#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kFigureTblName = "figure-tbl";

/// Planning time and relative cost against the number of hypotheses, for all policies that localize by touch.
///
/// Kinematic: the target stands exactly at a hypothesis, guarded moves return what the contact map says, nothing is
/// simulated. The cost of the database policy is exact over all hypotheses; every policy walks from the same truths,
/// all hypotheses where they are few, else a sample. Twice: with distance and with time as cost.
ExperimentResult RunFigureTbl(const ExperimentRequest& request);

}  // namespace feeler::evaluation
