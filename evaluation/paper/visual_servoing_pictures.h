#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"
#include "feeler/evaluation/paper/visual_servoing.h"

namespace feeler::evaluation {

/// What the wrist camera sees in the scene of a row: the goal that was taught, and the start pose of an episode with
/// the features that were found in it and the way each has to go. Writes PNG files into OUT/visual-servoing/; returns
/// {"file" (relative to OUT), "caption"} of each. Throws InputError when the machine cannot render.
std::vector<nlohmann::json> WriteVisualServoingPictures(const VisualServoingRow& row, const ExperimentRequest& request);

}  // namespace feeler::evaluation
