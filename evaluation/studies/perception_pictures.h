#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "feeler/env/scene/scene.h"
#include "feeler/workflow/perception/calibrate.h"

namespace feeler::evaluation {

/// Draws one of the held-out samples of a calibration into `folder`: what the camera sees, the measured points with the
/// registered model, and the same from above with the box of hypotheses and the truth. Returns the list of pictures
/// (`file`, `caption`) for the details of an experiment.
nlohmann::json DrawPerception(const env::TaskModel& task_model, const workflow::Calibration& calibration,
                              const workflow::CalibrationOptions& options, const std::string& folder);

}  // namespace feeler::evaluation
