#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "feeler/evaluation/report/results_folder.h"

namespace feeler::evaluation {

/// An episode from one line of a records file. Throws std::invalid_argument with what is wrong with it.
ReportedEpisode ReadRecordLine(const std::string& line, nlohmann::json& record);

}  // namespace feeler::evaluation
