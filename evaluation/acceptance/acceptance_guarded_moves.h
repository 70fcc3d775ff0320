#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kAcceptanceGuardedMovesName = "acceptance-guarded-moves";

/// Guarded moves in physics against geometry: random starts around the target of the plug task, random directions and
/// lengths, without and with joint friction and force noise. How far the tool goes is compared with how far it could
/// go, which follows from the models alone (LineSweep, judged by MuJoCo's collision detection).
ExperimentResult RunAcceptanceGuardedMoves(const ExperimentRequest& request);

}  // namespace feeler::evaluation
