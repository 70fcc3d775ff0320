#include "feeler/evaluation/registry.h"

#include <filesystem>

#include "feeler/core/error.h"
#include "feeler/evaluation/acceptance/acceptance_closed_loop.h"
#include "feeler/evaluation/acceptance/acceptance_contact_maps.h"
#include "feeler/evaluation/acceptance/acceptance_guarded_moves.h"
#include "feeler/evaluation/acceptance/acceptance_transfers.h"
#include "feeler/evaluation/paper/figure_tbl.h"
#include "feeler/evaluation/paper/table1_plug.h"
#include "feeler/evaluation/paper/table2_framework.h"
#include "feeler/evaluation/paper/table3_ablation.h"
#include "feeler/evaluation/paper/table4_pipe.h"
#include "feeler/evaluation/paper/visual_servoing.h"
#include "feeler/evaluation/studies/baselines.h"
#include "feeler/evaluation/studies/bounds.h"
#include "feeler/evaluation/studies/graded_bounds.h"
#include "feeler/evaluation/studies/noise.h"
#include "feeler/evaluation/studies/noise_price.h"
#include "feeler/evaluation/studies/noise_price_episodes.h"
#include "feeler/evaluation/studies/perception.h"
#include "feeler/evaluation/studies/pomdp_benchmarks.h"
#include "feeler/evaluation/studies/pomdp_experience.h"
#include "feeler/evaluation/studies/priors.h"
#include "feeler/evaluation/studies/spiral_tuning.h"

namespace feeler::evaluation {

namespace {

std::vector<Experiment> AllExperiments() {
  return {
      {kAcceptanceClosedLoopName, "episodes in physics at full size, with and without fallbacks, under every noise",
       RunAcceptanceClosedLoop},
      {kAcceptanceContactMapsName, "contact maps over orientation: time of the build, agreement with MuJoCo",
       RunAcceptanceContactMaps},
      {kAcceptanceGuardedMovesName, "guarded moves in physics against geometry", RunAcceptanceGuardedMoves},
      {kAcceptanceTransfersName, "transfers among obstacles in four scenes: planned, and carried out in physics",
       RunAcceptanceTransfers},
      {kBaselinesName,
       "all policies over the same episodes and sockets as uncertainty grows: success, time, path, force",
       RunBaselines},
      {kBoundsName, "lower and upper bound of the certified solver over time, closed and open socket", RunBounds, true},
      {kFigureTblName, "planning time and relative cost of touch-based localization against the number of hypotheses",
       RunFigureTbl, true},
      {kGradedBoundsName, "Tables I and III over bounds of graded strength: where the printed picture appears",
       RunGradedBounds},
      {kNoiseName, "sensor noise, joint friction and stiffness, a turned target: what breaks first", RunNoise},
      {kNoisePriceName, "what noise in the readings costs: policies that know of it, and those that do not",
       RunNoisePrice},
      {kNoisePriceEpisodesName, "the same in physics: insertions, wrong ones, seconds, with the noise known and not",
       RunNoisePriceEpisodes},
      {kPerceptionName, "registration and uncertainty table over the workspace: errors, coverage, hypotheses",
       RunPerception},
      {kPomdpBenchmarksName, "general POMDPs: proven intervals over time beside SARSOP's, and RTDP-Bel",
       RunPomdpBenchmarks, false, false, true},
      {kPomdpExperienceName, "families of general POMDPs: RTDP-Bel against E-RTDP-Bel with a similar problem's policy",
       RunPomdpExperience},
      {kPriorsName, "the camera's own errors as a prior: from the calibration to episodes, against equal weights",
       RunPriors},
      {kSpiralTuningName, "pitch, speed and force of the spiral search, per socket", RunSpiralTuning},
      {kTable1PlugName, "Table I: RTDP-Bel against E-RTDP-Bel on the plug, and the fast setting", RunTable1Plug, true,
       true},
      {kTable2FrameworkName, "Table II: success and execution time, targets anywhere in the workspace",
       RunTable2Framework},
      {kTable3AblationName, "Table III: rollout against naive experience, uncertainty against random order",
       RunTable3Ablation, true, true},
      {kTable4PipeName, "Table IV: RTDP-Bel against E-RTDP-Bel on the pipe, and the fast setting", RunTable4Pipe, true,
       true},
      {kVisualServoingName, "visual servoing in four scenes, by SIFT features and by the corners of red tape",
       RunVisualServoing},
  };
}

}  // namespace

std::string PartialFile(const ExperimentRequest& request, const std::string& name) {
  return request.out + "/" + name + ".partial.jsonl";
}

std::vector<std::string> PartialFilesOf(const ExperimentRequest& request, const std::string& name) {
  std::vector<std::string> files;
  for (const std::string& folder : request.from) files.push_back(folder + "/" + name + ".partial.jsonl");
  return files;
}

const std::vector<Experiment>& Experiments() {
  static const std::vector<Experiment> kExperiments = [] {
    std::vector<Experiment> all = AllExperiments();
    for (Experiment& experiment : all) {
      // Those whose cells and records are measured one by one; the others are minutes in all.
      for (const auto* name :
           {kAcceptanceClosedLoopName, kBaselinesName, kFigureTblName, kNoiseName, kNoisePriceEpisodesName,
            kSpiralTuningName, kTable1PlugName, kTable2FrameworkName, kTable3AblationName, kTable4PipeName}) {
        if (experiment.name == name) experiment.takes_shard = true;
      }
    }
    return all;
  }();
  return kExperiments;
}

std::string ExperimentNames() {
  std::string names;
  for (const Experiment& experiment : Experiments()) names += (names.empty() ? "" : ", ") + experiment.name;
  return names;
}

const Experiment& FindExperiment(const std::string& name) {
  for (const Experiment& experiment : Experiments()) {
    if (experiment.name == name) return experiment;
  }
  throw InputError("experiment", "unknown name \"" + name + "\"", "choose one of " + ExperimentNames());
}

ExperimentOutcome RunExperiment(const Experiment& experiment, const ExperimentRequest& request) {
  if (!request.task.empty() && !experiment.takes_task) {
    throw InputError("--task", "experiment " + experiment.name + " has its own", "leave it out");
  }
  if (!request.pomdps.empty() && !experiment.takes_pomdps) {
    throw InputError("--pomdps", "not used by " + experiment.name, "leave it out");
  }
  if (request.solver_seeds < 0 || (request.solver_seeds > 0 && !experiment.takes_solver_seeds)) {
    throw InputError("--solver-seeds", request.solver_seeds < 0 ? "negative" : "not used by " + experiment.name,
                     "leave it out");
  }
  if ((request.shard || !request.from.empty()) && !experiment.takes_shard) {
    throw InputError("--shard", "experiment " + experiment.name + " is measured in one go", "leave it out, and --from");
  }
  std::error_code error;
  std::filesystem::create_directories(request.out, error);
  if (error) throw InputError(request.out, "cannot be created: " + error.message(), "choose another folder");
  RequireOwnCsv(request.out, experiment.name);
  ExperimentResult result = experiment.run(request);
  ExperimentOutcome outcome{result.complete, PartialFile(request, experiment.name), result.text};
  if (!result.complete) return outcome;
  Manifest manifest{request.command, result.settings, result.seeds};
  manifest.settings["jobs"] = request.jobs.threads();
  result.details["manifest"] = ManifestJson(manifest);
  WriteExperiment(request.out, experiment.name, result.table, result.details, manifest, result.figures);
  return outcome;
}

}  // namespace feeler::evaluation
