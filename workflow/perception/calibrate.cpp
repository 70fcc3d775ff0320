#include "feeler/workflow/perception/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/json_depth.h"
#include "feeler/core/random.h"
#include "feeler/core/worker_pool.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/perception/input_file.h"
#include "feeler/version.h"

namespace feeler::workflow {
namespace {

using perception::PoseJson;

nlohmann::ordered_json SettingsJson(const std::string& fingerprint, const CalibrationOptions& options) {
  return {{"fingerprint", fingerprint},
          {"poses", options.poses},
          {"installations", options.installations},
          {"seed", options.seed},
          {"averaged_frames", options.perception.averaged_frames},
          {"version", FEELER_VERSION}};
}

nlohmann::ordered_json ToJson(const CalibrationSample& sample) {
  return {{"index", sample.index},
          {"found", sample.found},
          {"distance_m", sample.distance_m},
          {"fitness", sample.fitness},
          {"cpu_s", sample.cpu_s},
          {"rejected", sample.rejected},
          {"true", PoseJson(sample.poses.world_T_true)},
          {"estimate", PoseJson(sample.poses.world_T_estimate)}};
}

/// Which half and which installation a sample belongs to.
void Place(const CalibrationOptions& options, CalibrationSample& sample) {
  sample.held_out = sample.index >= options.poses;
  sample.installation = static_cast<int>(sample.index % options.poses % options.installations) +
                        (sample.held_out ? options.installations : 0);
}

/// The samples that an interrupted run left; none if it had other settings. A last line that is cut off is dropped.
std::vector<std::optional<CalibrationSample>> ReadPartial(const std::string& path, const std::string& settings,
                                                          const CalibrationOptions& options) {
  std::vector<std::optional<CalibrationSample>> samples(2 * static_cast<std::size_t>(options.poses));
  std::ifstream in(path);
  std::string line;
  if (!in || !std::getline(in, line) || line != settings) return samples;
  while (std::getline(in, line)) {
    try {
      if (IsNestedDeeper(line)) continue;
      const auto json = nlohmann::json::parse(line);
      CalibrationSample sample;
      sample.index = json.at("index").get<std::int64_t>();
      sample.found = json.at("found").get<bool>();
      sample.distance_m = json.at("distance_m").get<double>();
      sample.fitness = json.at("fitness").get<double>();
      sample.cpu_s = json.at("cpu_s").get<double>();
      sample.rejected = json.at("rejected").get<int>();
      sample.poses.world_T_true = perception::PoseAt(json, "true", path);
      sample.poses.world_T_estimate = perception::PoseAt(json, "estimate", path);
      Place(options, sample);
      sample.poses.installation = sample.installation;
      samples.at(static_cast<std::size_t>(sample.index)) = sample;
    } catch (const std::exception&) {
      continue;
    }
  }
  return samples;
}

CalibrationSample Take(CameraCell& cell, std::int64_t index, const CalibrationOptions& options) {
  CalibrationSample sample;
  sample.index = index;
  Place(options, sample);
  const auto key = static_cast<std::uint64_t>(index);
  RandomStream places(options.seed, key, "calibration place");
  const PlacementDraw placement = cell.DrawPlacement(places);
  RandomStream noise(options.seed, key, "calibration picture");
  const Sight sight =
      cell.Look(placement.world_T_target, options.seed, static_cast<std::uint64_t>(sample.installation), noise);
  sample.found = sight.registration.found;
  sample.distance_m = sight.distance_m;
  sample.fitness = sight.registration.fitness;
  sample.cpu_s = sight.cpu_s;
  sample.rejected = placement.rejected;
  sample.poses = {sight.registration.world_T_target, placement.world_T_target, sample.installation};
  return sample;
}

std::vector<perception::PoseSample> Found(const std::vector<CalibrationSample>& samples, bool held_out) {
  std::vector<perception::PoseSample> found;
  for (const CalibrationSample& sample : samples) {
    if (sample.found && sample.held_out == held_out) found.push_back(sample.poses);
  }
  return found;
}

double P95(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  constexpr double kShare = 0.95;
  const auto index = static_cast<std::size_t>(std::ceil(kShare * static_cast<double>(values.size()))) - 1;
  return values[index];
}

nlohmann::ordered_json ScoreJson(const perception::TableScore& score) {
  return {{"samples", score.samples},
          {"covered", score.covered},
          {"coverage", score.samples > 0 ? static_cast<double>(score.covered) / score.samples : 0.0},
          {"mean_hypotheses", score.mean_hypotheses},
          {"most_hypotheses", score.most_hypotheses},
          {"largest_counts", score.largest_counts},
          {"clamped", score.clamped}};
}

nlohmann::ordered_json ErrorsJson(const ErrorSummary& errors) {
  return {{"samples", errors.samples},
          {"along_p95_m", errors.along_p95_m},
          {"across_p95_m", errors.across_p95_m},
          {"vertical_p95_m", errors.vertical_p95_m},
          {"yaw_p95_rad", errors.yaw_p95_rad},
          {"largest_m", errors.largest_m},
          {"gross", errors.gross}};
}

}  // namespace

void CalibrationOptions::Validate() const {
  constexpr int kMostPoses = 1000000;
  if (poses < static_cast<int>(perception::kLeastSamples) || poses > kMostPoses) {
    throw InputError("calibration", fmt::format("{} poses", poses),
                     fmt::format("give {} to {}", perception::kLeastSamples, kMostPoses));
  }
  if (installations < 1 || installations > poses) {
    throw InputError("calibration", fmt::format("{} installations for {} poses", installations, poses),
                     "give at least 1 and at most as many as poses");
  }
  noise.Validate();
}

Calibration Calibrate(const env::TaskModel& task_model, const CalibrationOptions& options) {
  options.Validate();
  const auto scene = std::make_shared<const env::Scene>(env::BuildScene(task_model));
  const auto finder = std::make_shared<const TargetFinder>(task_model, options.perception);
  Calibration calibration;
  calibration.table.task = task_model.task.name;
  calibration.table.fingerprint = env::Fingerprint(task_model, env::Opening::kClosed);
  calibration.table.axes = task_model.task.axes;
  calibration.table.averaged_frames = options.perception.averaged_frames;

  const std::string settings = SettingsJson(calibration.table.fingerprint, options).dump();
  std::vector<std::optional<CalibrationSample>> samples(2 * static_cast<std::size_t>(options.poses));
  std::ofstream partial;
  if (!options.partial.empty()) {
    samples = ReadPartial(options.partial, settings, options);
    std::string kept = settings + "\n";
    for (const auto& sample : samples) {
      if (sample) kept += ToJson(*sample).dump() + "\n";
    }
    WriteFileAtomically(options.partial, kept);  // killed here, the samples of the run before stand
    partial.open(options.partial, std::ios::app);
    if (!partial) throw InputError(options.partial, "cannot be written", "choose another folder");
  }

  std::vector<std::size_t> missing;
  for (std::size_t index = 0; index < samples.size(); ++index) {
    if (!samples[index]) missing.push_back(index);
  }
  const auto had = static_cast<std::int64_t>(samples.size() - missing.size());
  std::mutex mutex;  // guards camera_m, which all see at the same place
  Eigen::Vector3d camera_m = Eigen::Vector3d::Zero();
  const auto make_worker = [&] {
    auto cell = std::make_unique<CameraCell>(scene, finder, options.noise);
    {
      const std::lock_guard lock(mutex);
      camera_m = cell->eye_m();
    }
    return [&, cell = std::move(cell)](std::size_t i) {
      return Take(*cell, static_cast<std::int64_t>(missing[i]), options);
    };
  };
  const auto keep = [&](std::size_t i, const CalibrationSample& sample) {
    samples[missing[i]] = sample;
    if (partial.is_open() && !(partial << ToJson(sample).dump() << "\n" << std::flush)) {
      throw InputError(options.partial, "cannot be written", "free some space");
    }
    const auto done = had + static_cast<std::int64_t>(i) + 1;
    if (options.progress) options.progress(done, static_cast<std::int64_t>(samples.size()));
  };
  RunInOrder(missing.size(), options.jobs, make_worker, keep, options.cancellation);

  for (const auto& sample : samples) {
    if (sample) calibration.samples.push_back(*sample);
  }
  calibration.table.camera_m = camera_m;
  for (const CalibrationSample& sample : calibration.samples) calibration.not_found += sample.found ? 0 : 1;
  calibration.complete = calibration.samples.size() == samples.size();
  if (!calibration.complete) return calibration;

  const std::vector<perception::PoseSample> made_from = Found(calibration.samples, false);
  const std::vector<perception::PoseSample> held_out = Found(calibration.samples, true);
  perception::FitRules(made_from, options.table, calibration.table);
  calibration.made_from = ScoreTable(calibration.table, calibration.table.rules, made_from);
  calibration.held_out = ScoreTable(calibration.table, calibration.table.rules, held_out);
  calibration.held_out_plain = ScoreTable(calibration.table, calibration.table.plain_rules, held_out);
  if (!options.partial.empty()) {
    partial.close();
    std::error_code ignored;
    std::filesystem::remove(options.partial, ignored);
  }
  return calibration;
}

ErrorSummary SummarizeErrors(const Calibration& calibration, bool correct) {
  constexpr double kGross_m = 0.03;
  ErrorSummary summary;
  std::vector<double> along, across, vertical, turn;
  for (const CalibrationSample& sample : calibration.samples) {
    if (!sample.held_out || !sample.found) continue;
    const Pose estimate = correct ? HypothesesFor(calibration.table, sample.poses.world_T_estimate).world_T_estimate
                                  : sample.poses.world_T_estimate;
    const Pose& truth = sample.poses.world_T_true;
    const Eigen::Vector3d error = estimate.translation() - truth.translation();
    const Eigen::Vector3d seen =
        perception::ViewAxes(calibration.table.camera_m, truth.translation()).transpose() * error;
    along.push_back(std::abs(seen.x()));
    across.push_back(std::abs(seen.y()));
    vertical.push_back(std::abs(seen.z()));
    turn.push_back(Eigen::AngleAxisd(truth.linear().transpose() * estimate.linear()).angle());
    summary.largest_m = std::max(summary.largest_m, error.norm());
    summary.gross += error.norm() > kGross_m ? 1 : 0;
    ++summary.samples;
  }
  summary.along_p95_m = P95(along);
  summary.across_p95_m = P95(across);
  summary.vertical_p95_m = P95(vertical);
  summary.yaw_p95_rad = P95(turn);
  return summary;
}

std::string ReportJson(const Calibration& calibration, const CalibrationOptions& options) {
  nlohmann::ordered_json json = SettingsJson(calibration.table.fingerprint, options);
  json["not_found"] = calibration.not_found;
  json["made_from"] = ScoreJson(calibration.made_from);
  json["held_out"] = ScoreJson(calibration.held_out);
  json["held_out_without_bias_correction"] = ScoreJson(calibration.held_out_plain);
  json["errors"] = ErrorsJson(SummarizeErrors(calibration, false));
  json["errors_without_bias"] = ErrorsJson(SummarizeErrors(calibration, true));
  return json.dump();
}

}  // namespace feeler::workflow
