#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "feeler/workflow/episode/episode_record.h"

namespace feeler::evaluation {

/// One line of a records file (docs/file-formats.md, "Episode records").
nlohmann::ordered_json ToJson(const workflow::EpisodeRecord& record);

/// The fields of a record that summaries and reports read.
struct EpisodeSummaryRow {
  std::string task;
  std::string policy;
  bool localized = false;
  bool inserted = false;
  std::string reason;
  double sim_time_s = 0.0;
  double path_length_m = 0.0;
  double moves = 0.0;
  double contacts = 0.0;
  double peak_force_n = 0.0;
  double plan_cpu_s = 0.0;
  std::vector<std::string> rungs;  ///< of the fallback ladder, in the order in which they were used
};
EpisodeSummaryRow SummaryRow(const workflow::EpisodeRecord& record);

/// Of a record as it stands in a file. Throws nlohmann::json::exception for another object.
EpisodeSummaryRow SummaryRow(const nlohmann::json& record);

/// Reads a records file, dry runs left out. Throws InputError naming file and line for a line that is no record.
std::vector<EpisodeSummaryRow> ReadRecords(const std::string& path);

}  // namespace feeler::evaluation
