#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace feeler::evaluation {

/// Something in a results folder that could not be used, or not as it stands. The rest is reported all the same.
struct Fault {
  std::string where;  ///< file, and line where there is one
  std::string what;
  std::string mend;
};
std::string ToString(const Fault& fault);

/// What NAME.json and NAME.csv say.
struct ReportedExperiment {
  std::string name;
  std::string folder;      ///< relative to the results folder; empty: itself
  nlohmann::json columns;  ///< as in NAME.json
  nlohmann::json rows;
  nlohmann::json manifest;  ///< null if there is none
  nlohmann::json figures;  ///< [{title, x_label, y_label, x_log, y_log, series: [{name, points: [{x, y, low, high}]}]}]
  nlohmann::json pictures;  ///< [{source (data: URL), caption}]
  nlohmann::json details;   ///< failures and what else the page shows: {title, failures: [{row, failures}]}
};

/// One episode of a records file.
struct ReportedEpisode {
  nlohmann::json row;  ///< what tables and plots need
  std::string replay;  ///< one line of JSON, or empty
  bool inserted = false;
  bool ladder = false;  ///< a fallback was used
  std::string started;  ///< when its run began, on a robot; empty: a simulation, which seed and number tell apart
  bool dry = false;     ///< nothing moved: no episode to report
};

/// A records file with the lines that could be read, dry runs left out.
struct ReportedRecords {
  std::string file;  ///< relative to the results folder
  std::string task, policy, noise;
  std::uint64_t seed = 0;
  std::vector<ReportedEpisode> episodes;
};

struct Results {
  std::vector<ReportedExperiment> experiments;   ///< by folder and name
  std::vector<ReportedRecords> records;          ///< by file
  std::map<std::string, nlohmann::json> scenes;  ///< by task (docs/file-formats.md, "Scenes")
  std::vector<Fault> faults;
};

/// Reads NAME.csv, NAME.json, manifest.json, the records (*.jsonl) and scenes (*.scene.json) of a folder and the
/// folders in it; what else is there is left alone. Throws InputError if the folder is missing, not a folder, or holds
/// neither an experiment nor a record.
Results ReadResults(const std::string& folder);

}  // namespace feeler::evaluation
