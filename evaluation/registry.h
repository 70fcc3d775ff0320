#pragma once

#include <string>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

/// All experiments, by name.
const std::vector<Experiment>& Experiments();
/// "bounds, table1-plug, ...".
std::string ExperimentNames();
/// Throws InputError that lists the known names.
const Experiment& FindExperiment(const std::string& name);

struct ExperimentOutcome {
  bool complete = false;     ///< false: cancelled
  std::string partial_file;  ///< finished cells
  std::string text;          ///< the table for people
};

/// Runs an experiment, or goes on with one that was interrupted in the same folder, and writes NAME.csv, NAME.json and
/// manifest.json; the manifest stands in NAME.json too, so that several experiments may share a folder. Cancelled: the
/// finished cells are kept and no table is written. Throws InputError for a folder that cannot be written or that holds
/// the cells of other settings.
ExperimentOutcome RunExperiment(const Experiment& experiment, const ExperimentRequest& request);

}  // namespace feeler::evaluation
