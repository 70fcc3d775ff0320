#include "feeler/evaluation/studies/perception.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "feeler/core/json_depth.h"
#include "feeler/env/model/task_file.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/evaluation/studies/perception_pictures.h"
#include "feeler/workflow/perception/calibrate.h"

namespace feeler::evaluation {
namespace {

/// The held-out samples whose estimates fall under one rule.
workflow::Calibration UnderRule(const workflow::Calibration& calibration, std::size_t rule) {
  workflow::Calibration part = calibration;
  std::erase_if(part.samples, [&](const workflow::CalibrationSample& sample) {
    return !sample.found || !sample.held_out ||
           static_cast<std::size_t>(HypothesesFor(calibration.table, sample.poses.world_T_estimate).rule) != rule;
  });
  return part;
}

std::vector<perception::PoseSample> Poses(const workflow::Calibration& part) {
  std::vector<perception::PoseSample> poses;
  for (const workflow::CalibrationSample& sample : part.samples) poses.push_back(sample.poses);
  return poses;
}

struct PerceptionRow {
  std::string range;
  workflow::ErrorSummary errors;
  perception::TableScore corrected, plain;
};

void Add(const PerceptionRow& row, ExperimentResult& result) {
  constexpr double kDegree = 57.29577951308232;
  const auto share = [](const perception::TableScore& score) {
    return score.samples > 0 ? static_cast<double>(score.covered) / score.samples : 0.0;
  };
  result.table.rows.push_back({row.range, row.errors.samples, 1e3 * row.errors.along_p95_m,
                               1e3 * row.errors.across_p95_m, 1e3 * row.errors.vertical_p95_m,
                               kDegree * row.errors.yaw_p95_rad, 1e3 * row.errors.largest_m, row.errors.gross,
                               share(row.corrected), row.corrected.mean_hypotheses, row.corrected.most_hypotheses,
                               share(row.plain), row.plain.mean_hypotheses});
  result.text += fmt::format(
      "{:<14} {:>6} {:>6.1f} {:>6.1f} {:>6.1f} {:>7.2f} {:>8.1f} {:>6} {:>9.2f} {:>7.0f} {:>10.2f} {:>7.0f}\n",
      row.range, row.errors.samples, 1e3 * row.errors.along_p95_m, 1e3 * row.errors.across_p95_m,
      1e3 * row.errors.vertical_p95_m, kDegree * row.errors.yaw_p95_rad, 1e3 * row.errors.largest_m, row.errors.gross,
      100.0 * share(row.corrected), row.corrected.mean_hypotheses, 100.0 * share(row.plain), row.plain.mean_hypotheses);
}

}  // namespace

ExperimentResult RunPerception(const ExperimentRequest& request) {
  workflow::CalibrationOptions options;
  options.poses = request.quick ? 80 : 1000;
  options.installations = 5;
  options.seed = request.seed;
  options.jobs = request.jobs;
  options.partial = PartialFile(request, kPerceptionName);
  options.progress = request.progress;
  options.cancellation = request.cancellation;
  const env::TaskModel task_model = env::LoadTask("plug");

  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"poses", options.poses},
                     {"installations", options.installations},
                     {"averaged_frames", options.perception.averaged_frames}};
  const workflow::Calibration calibration = workflow::Calibrate(task_model, options);
  if (!calibration.complete) return result;

  result.table.columns = {"distance",
                          "poses",
                          "along_p95_mm",
                          "across_p95_mm",
                          "vertical_p95_mm",
                          "yaw_p95_deg",
                          "largest_mm",
                          "above_30_mm",
                          "coverage",
                          "hypotheses_mean",
                          "hypotheses_max",
                          "coverage_without_bias",
                          "hypotheses_mean_without_bias"};
  result.text =
      fmt::format("{:<14} {:>6} {:>6} {:>6} {:>6} {:>7} {:>8} {:>6} {:>9} {:>7} {:>10} {:>7}\n", "distance m", "poses",
                  "along", "across", "up mm", "yaw deg", "largest", ">30 mm", "covered %", "hyp.", "no bias %", "hyp.");
  for (std::size_t rule = 0; rule < calibration.table.rules.size(); ++rule) {
    const workflow::Calibration part = UnderRule(calibration, rule);
    const perception::UncertaintyRule& own = calibration.table.rules[rule];
    Add({fmt::format("{:.2f} to {:.2f}", own.nearest_m, own.farthest_m), workflow::SummarizeErrors(part, false),
         ScoreTable(calibration.table, calibration.table.rules, Poses(part)),
         ScoreTable(calibration.table, calibration.table.plain_rules, Poses(part))},
        result);
  }
  Add({"all", workflow::SummarizeErrors(calibration, false), calibration.held_out, calibration.held_out_plain}, result);
  std::vector<double> cpu_s;
  for (const workflow::CalibrationSample& sample : calibration.samples) cpu_s.push_back(sample.cpu_s);
  result.text += fmt::format("95 % of errors; registration {:.0f} ms of CPU (median), {:.0f} ms (95 %); {} not found\n",
                             1e3 * Median(cpu_s), 1e3 * Quantile(cpu_s, 0.95), calibration.not_found);
  result.details = {{"report", ParseJsonText<nlohmann::json>(workflow::ReportJson(calibration, options))},
                    {"registration_cpu_s", {{"median", Median(cpu_s)}, {"p95", Quantile(cpu_s, 0.95)}}},
                    {"pictures", DrawPerception(task_model, calibration, options, request.out)}};
  result.complete = true;
  workflow::RemovePartial(options);
  return result;
}

}  // namespace feeler::evaluation
