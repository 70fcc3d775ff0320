#include "feeler/workflow/perception/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"
#include "feeler/core/json_depth.h"
#include "feeler/core/random.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/perception/input_file.h"
#include "feeler/version.h"
#include "feeler/workflow/scale/ordered_pieces.h"

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

nlohmann::ordered_json EvidenceJson(const perception::MatchEvidence& evidence) {
  return {{"fitness", evidence.fitness},
          {"explained", evidence.explained},
          {"beyond", evidence.beyond},
          {"seen_through", evidence.seen_through},
          {"missing_m2", evidence.missing_m2}};
}

nlohmann::ordered_json ToJson(const CalibrationSample& sample) {
  return {{"index", sample.index},
          {"found", sample.found},
          {"distance_m", sample.distance_m},
          {"evidence", EvidenceJson(sample.evidence)},
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

/// Throws whatever for a line that is none.
CalibrationSample SampleFrom(const std::string& line, const std::string& path, const CalibrationOptions& options) {
  const auto json = ParseJsonText<nlohmann::json>(line);
  CalibrationSample sample;
  sample.index = json.at("index").get<std::int64_t>();
  sample.found = json.at("found").get<bool>();
  sample.distance_m = json.at("distance_m").get<double>();
  const nlohmann::json& evidence = json.at("evidence");
  sample.evidence = {evidence.at("fitness").get<double>(), evidence.at("explained").get<double>(),
                     evidence.at("beyond").get<double>(), evidence.at("seen_through").get<double>(),
                     evidence.at("missing_m2").get<double>()};
  sample.cpu_s = json.at("cpu_s").get<double>();
  sample.rejected = json.at("rejected").get<int>();
  sample.poses.world_T_true = perception::PoseAt(json, "true", path);
  sample.poses.world_T_estimate = perception::PoseAt(json, "estimate", path);
  Place(options, sample);
  sample.poses.installation = sample.installation;
  return sample;
}

using Samples = std::vector<std::optional<CalibrationSample>>;

/// The samples that an interrupted run left. A last line that is cut off is dropped.
Samples ReadPartial(const std::string& path, const std::string& settings, const CalibrationOptions& options) {
  Samples samples(2 * static_cast<std::size_t>(options.poses));
  std::ifstream in(path);
  std::string line;
  if (!in || !std::getline(in, line) || line != settings) return samples;
  while (std::getline(in, line)) {
    try {
      const CalibrationSample sample = SampleFrom(line, path, options);
      samples.at(static_cast<std::size_t>(sample.index)) = sample;
    } catch (const std::exception&) {
      continue;
    }
  }
  return samples;
}

/// Measured poses are continued, never replaced.
void RequireOwnPoses(const std::string& path, const std::string& settings) {
  std::ifstream in(path);
  std::string line;
  if (!in || !std::getline(in, line) || line == settings) return;
  throw InputError(path, "exists and holds no poses of a calibration with these settings: it is not overwritten",
                   "give the settings that it was made with, move it away, or choose another --out");
}

/// Adds what the shards hold.
void AddShards(const std::string& settings, const CalibrationOptions& options, Samples& samples) {
  std::vector<std::string> holders(samples.size());
  for (const std::string& path : options.from) {
    std::ifstream in(path);
    std::string line;
    std::error_code error;
    if (!in || !std::filesystem::is_regular_file(path, error)) {
      throw InputError(path, "cannot be read as a file", "give what feeler perceive calibrate --shard left");
    }
    if (!std::getline(in, line) || line != settings) {
      throw InputError(path, "is no shard of a calibration with these settings",
                       "give the task, --poses, --installations, --frames and --seed that it was made with");
    }
    for (std::size_t number = 2; std::getline(in, line); ++number) {
      const std::string where = fmt::format("{} line {}", path, number);
      try {
        const CalibrationSample sample = SampleFrom(line, path, options);
        const auto index = static_cast<std::size_t>(sample.index);
        if (!holders.at(index).empty()) {
          throw InputError(where, fmt::format("holds pose {}, as {} does", index, holders[index]),
                           "give each shard once");
        }
        holders[index] = path;
        samples[index] = sample;
      } catch (const InputError&) {
        throw;
      } catch (const std::exception&) {
        throw InputError(where, "is damaged", "run the shard again, it goes on");
      }
    }
  }
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
  sample.evidence = sight.registration;
  sample.cpu_s = sight.cpu_s;
  sample.rejected = placement.rejected;
  sample.poses = {sight.registration.world_T_target, placement.world_T_target, sample.installation};
  return sample;
}

/// Makes workers that take the pose of a number; a thread each, as a camera is.
auto SampleWorkers(const std::shared_ptr<const env::Scene>& scene, const std::shared_ptr<const TargetFinder>& finder,
                   const CalibrationOptions& options) {
  return [&scene, &finder, &options] {
    return [&options, cell = std::make_unique<CameraCell>(scene, finder, options.noise)](std::int64_t index) {
      return ToJson(Take(*cell, index, options)).dump();
    };
  };
}

std::vector<perception::PoseSample> Found(const std::vector<CalibrationSample>& samples, bool held_out) {
  std::vector<perception::PoseSample> found;
  for (const CalibrationSample& sample : samples) {
    if (sample.found && sample.held_out == held_out) found.push_back(sample.poses);
  }
  return found;
}

/// Sets the limits of the table by one half of the poses and by the negatives, and judges all of them by it.
void JudgeByEvidence(Calibration& calibration) {
  std::vector<perception::MatchEvidence> matches;
  for (const CalibrationSample& sample : calibration.samples) {
    if (sample.found && !sample.held_out) matches.push_back(sample.evidence);
  }
  std::vector<perception::MatchEvidence> negatives;
  for (const KnownNegative& negative : calibration.negatives) negatives.push_back(negative.evidence);
  perception::MatchLimits& limits = calibration.table.limits;
  limits = perception::LimitsFrom(matches, negatives);
  for (CalibrationSample& sample : calibration.samples) {
    sample.found = sample.found && limits.Allow(sample.evidence);
    calibration.not_found += sample.found ? 0 : 1;
  }
  for (KnownNegative& negative : calibration.negatives) {
    negative.found = negative.found && limits.Allow(negative.evidence);
  }
}

nlohmann::ordered_json WorstJson(const Calibration& calibration) {
  perception::MatchEvidence worst{1.0, 1.0, 0.0, 0.0, 0.0};
  for (const CalibrationSample& sample : calibration.samples) {
    if (!sample.found) continue;
    worst.fitness = std::min(worst.fitness, sample.evidence.fitness);
    worst.explained = std::min(worst.explained, sample.evidence.explained);
    worst.beyond = std::max(worst.beyond, sample.evidence.beyond);
    worst.seen_through = std::max(worst.seen_through, sample.evidence.seen_through);
    worst.missing_m2 = std::max(worst.missing_m2, sample.evidence.missing_m2);
  }
  return EvidenceJson(worst);
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

nlohmann::ordered_json NegativesJson(const std::vector<KnownNegative>& negatives) {
  nlohmann::ordered_json shown = nlohmann::ordered_json::array();
  for (const KnownNegative& n : negatives) {
    nlohmann::ordered_json one = {{"kind", n.kind}, {"what", n.what}, {"found", n.found}};
    one.update(EvidenceJson(n.evidence));
    shown.push_back(std::move(one));
  }
  const auto found = std::count_if(negatives.begin(), negatives.end(), [](const auto& n) { return n.found; });
  return {{"shown", negatives.size()}, {"found", found}, {"each", std::move(shown)}};
}

}  // namespace

std::string NegativesLine(const std::vector<KnownNegative>& negatives) {
  const auto count = [&](const char* kind) {
    return std::count_if(negatives.begin(), negatives.end(), [&](const auto& n) { return n.kind == kind; });
  };
  std::string taken;
  int found = 0;
  for (const KnownNegative& n : negatives) {
    if (!n.found) continue;
    ++found;
    taken += (taken.empty() ? ": " : ", ") + n.kind + " " + n.what;
  }
  return fmt::format(
      "known negatives: {} of {} are taken for the target ({} plates, {} boxes, {} parts of other tasks){}\n", found,
      negatives.size(), count("plate"), count("box"), count("part"), taken);
}

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
  Samples samples(2 * static_cast<std::size_t>(options.poses));
  if (!options.partial.empty()) {
    RequireOwnPoses(options.partial, settings);
    samples = ReadPartial(options.partial, settings, options);
  }
  AddShards(settings, options, samples);
  std::ofstream partial;
  if (!options.partial.empty()) {
    std::string kept = settings + "\n";
    for (const auto& sample : samples) {
      if (sample) kept += ToJson(*sample).dump() + "\n";
    }
    WriteFileAtomically(options.partial, kept);  // killed here, the samples of the run before stand
    partial.open(options.partial, std::ios::app);
    if (!partial) throw InputError(options.partial, "cannot be written", "choose another folder");
  }

  std::vector<std::int64_t> missing;
  const auto total = static_cast<std::int64_t>(samples.size());
  const std::vector<std::int64_t> own = NumbersOfShard(0, total, options.shard);
  for (const std::int64_t index : own) {
    if (!samples[static_cast<std::size_t>(index)]) missing.push_back(index);
  }
  const auto had = static_cast<std::int64_t>(own.size() - missing.size());
  const auto keep = [&](std::size_t i, const std::string& line) {
    samples[static_cast<std::size_t>(missing[i])] = SampleFrom(line, "pose", options);
    if (partial.is_open() && !(partial << line << "\n" << std::flush)) {
      throw InputError(options.partial, "cannot be written", "free some space");
    }
    const auto done = had + static_cast<std::int64_t>(i) + 1;
    if (options.progress) options.progress(done, static_cast<std::int64_t>(own.size()));
  };
  if (options.ranks != nullptr) options.ranks->Assemble(settings);
  try {
    RunPiecesInOrder(missing, options.jobs, options.ranks, SampleWorkers(scene, finder, options), keep,
                     options.cancellation);
  } catch (const Interrupted&) {  // NOLINT(bugprone-empty-catch): by ranks that did not end in time
  }
  calibration.table.camera_m = CameraCell(scene, finder, options.noise).eye_m();

  for (const auto& sample : samples) {
    if (sample) calibration.samples.push_back(*sample);
  }
  calibration.complete = calibration.samples.size() == samples.size() && !options.shard;
  if (!calibration.complete) return calibration;
  calibration.negatives = TryKnownNegatives(*finder, task_model, calibration.table.camera_m, options.cancellation);
  if (options.cancellation != nullptr && options.cancellation->cancelled()) {  // the poses are kept: run it again
    calibration.complete = false;
    return calibration;
  }

  JudgeByEvidence(calibration);
  const std::vector<perception::PoseSample> made_from = Found(calibration.samples, false);
  const std::vector<perception::PoseSample> held_out = Found(calibration.samples, true);
  perception::FitRules(made_from, options.table, calibration.table);
  calibration.made_from = ScoreTable(calibration.table, calibration.table.rules, made_from);
  calibration.held_out = ScoreTable(calibration.table, calibration.table.rules, held_out);
  calibration.held_out_plain = ScoreTable(calibration.table, calibration.table.plain_rules, held_out);
  return calibration;
}

void RemovePartial(const CalibrationOptions& options) {
  if (options.partial.empty() || options.shard) return;
  std::error_code ignored;
  std::filesystem::remove(options.partial, ignored);
}

void ServeCalibration(const env::TaskModel& task_model, const CalibrationOptions& options) {
  options.Validate();
  const auto scene = std::make_shared<const env::Scene>(env::BuildScene(task_model));
  const auto finder = std::make_shared<const TargetFinder>(task_model, options.perception);
  const std::string fingerprint = env::Fingerprint(task_model, env::Opening::kClosed);
  ServePieces(*options.ranks, SettingsJson(fingerprint, options).dump(), options.jobs,
              SampleWorkers(scene, finder, options));
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
  json["worst_match"] = WorstJson(calibration);
  json["negatives"] = NegativesJson(calibration.negatives);
  json["made_from"] = ScoreJson(calibration.made_from);
  json["held_out"] = ScoreJson(calibration.held_out);
  json["held_out_without_bias_correction"] = ScoreJson(calibration.held_out_plain);
  json["errors"] = ErrorsJson(SummarizeErrors(calibration, false));
  json["errors_without_bias"] = ErrorsJson(SummarizeErrors(calibration, true));
  return json.dump();
}

}  // namespace feeler::workflow
