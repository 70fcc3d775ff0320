#include "feeler/evaluation/paper/visual_servoing.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <regex>

#include "feeler/evaluation/harness/paper_results.h"
#include "feeler/evaluation/paper/visual_servoing_pictures.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

struct Scene {
  const char* name;
  const char* task;
  bool tape;  ///< corners of the tape instead of SIFT
  const char* printed;
};

constexpr Scene kScenes[] = {
    {"black on black", "plug-black", false, "SIFT, black port on black"},
    {"black on white", "plug-black-on-white", false, ""},
    {"textured", "plug-textured", false, ""},
    {"red tape", "plug-red-tape", false, ""},
    {"red tape", "plug-red-tape", true, "red tape corners"},
};

struct Printed {
  int successes = 0;
  int runs = 0;
  json time_s;
};

std::optional<Printed> PrintedRowOf(const std::string& variant) {
  for (const json& row : PaperResults().at("visual_servoing").at("rows")) {
    if (row[0] == variant) return Printed{row[1].get<int>(), row[2].get<int>(), row[3]};
  }
  return std::nullopt;
}

/// Reasons that differ in numbers alone are one.
std::string Kind(const std::string& reason) {
  static const std::regex kNumber("-?[0-9]+(\\.[0-9]+)?");
  return std::regex_replace(reason, kNumber, "#");
}

}  // namespace

std::vector<VisualServoingRow> VisualServoingRows(bool quick) {
  std::vector<VisualServoingRow> rows;
  for (const Scene& scene : kScenes) {
    VisualServoingRow row;
    row.scene = scene.name;
    row.features = scene.tape ? "tape corners" : "SIFT";
    row.printed = scene.printed;
    row.setting.task = scene.task;
    row.setting.policy = scene.tape ? "visual-servoing-tape" : "visual-servoing-sift";
    row.setting.name = fmt::format("{} {}", scene.task, scene.tape ? "tape" : "sift");
    row.setting.extents = "15x15x15";
    row.setting.ladder = false;
    row.setting.episodes = quick ? 3 : 100;
    rows.push_back(std::move(row));
  }
  return rows;
}

VisualServoingStatistics VisualServoingStatisticsOf(const std::vector<json>& records) {
  VisualServoingStatistics statistics;
  statistics.failures = json::object();
  int inserted = 0;
  std::vector<double> times, errors, pictures;
  for (const json& record : records) {
    if (record.at("inserted").get<bool>()) {
      ++inserted;
      times.push_back(record.at("sim_time_s").get<double>());
      pictures.push_back(record.at("pictures").get<double>());
    } else {
      json& count = statistics.failures[Kind(record.at("reason").get<std::string>())];
      count = count.is_null() ? 1 : count.get<int>() + 1;
    }
    const json& error = record.at("error");
    if (error.is_object()) {
      errors.push_back(std::hypot(error.at("lateral_m").get<double>(), error.at("vertical_m").get<double>()));
    }
  }
  statistics.inserted = WilsonRate(inserted, static_cast<int>(records.size()));
  statistics.time = BootstrapMedian(times);
  statistics.error = BootstrapMedian(errors);
  statistics.error_p95_m = Quantile(errors, 0.95);
  statistics.pictures_median = Median(pictures);
  return statistics;
}

ExperimentResult RunVisualServoing(const ExperimentRequest& request) {
  const std::vector<VisualServoingRow> rows = VisualServoingRows(request.quick);
  std::vector<EpisodeSetting> settings;
  for (const VisualServoingRow& row : rows) settings.push_back(row.setting);
  EpisodeSweep sweep(kVisualServoingName, std::move(settings), request);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = sweep.SettingsJson();
  if (!sweep.Run()) return result;

  result.table.columns = {"scene",
                          "features",
                          "episodes",
                          "inserted",
                          "rate",
                          "low",
                          "high",
                          "time_median_s",
                          "error_median_mm",
                          "error_p95_mm",
                          "pictures_median",
                          "paper_successes",
                          "paper_runs",
                          "paper_time_s"};
  result.text = fmt::format(
      "Image-based visual servoing in scenes that differ in looks alone, seed {}. The same episodes in each row: the "
      "port "
      "anywhere\nwithin 15 mm of where it is expected, along each axis. Seconds: start pose to verdict, inserted "
      "episodes. Error: of the "
      "final position,\nepisodes that reached their goal. Paper: successes of runs, seconds.\n\n{:<15} {:<13} {:>9} "
      "{:>8} {:>16} {:>9} {:>16} {:>9} "
      "{:>16}\n",
      request.seed, "scene", "features", "inserted", "%", "95 % interval", "median s", "p50/p95 mm", "pictures",
      "paper");
  for (const VisualServoingRow& row : rows) {
    if (request.cancellation != nullptr && request.cancellation->cancelled()) return result;
    const VisualServoingStatistics s = VisualServoingStatisticsOf(sweep.Records(row.setting));
    const std::optional<Printed> printed = PrintedRowOf(row.printed);
    result.table.rows.push_back(
        {row.scene, row.features, s.inserted.trials, s.inserted.successes, s.inserted.value, s.inserted.low,
         s.inserted.high, s.inserted.successes > 0 ? json(s.time.value) : json(),
         s.error.value > 0.0 ? json(1e3 * s.error.value) : json(),
         s.error.value > 0.0 ? json(1e3 * s.error_p95_m) : json(),
         s.inserted.successes > 0 ? json(s.pictures_median) : json(), printed ? json(printed->successes) : json(),
         printed ? json(printed->runs) : json(), printed ? printed->time_s : json()});
    result.text += fmt::format(
        "{:<15} {:<13} {:>4}/{:<4} {:>8.1f} {:>16} {:>9} {:>16} {:>9} {:>16}\n", row.scene, row.features,
        s.inserted.successes, s.inserted.trials, 100.0 * s.inserted.value,
        fmt::format("{:.1f} .. {:.1f}", 100.0 * s.inserted.low, 100.0 * s.inserted.high),
        s.inserted.successes > 0 ? fmt::format("{:.2f}", s.time.value) : "-",
        s.error.value > 0.0 ? fmt::format("{:.2f}/{:.2f}", 1e3 * s.error.value, 1e3 * s.error_p95_m) : "-",
        s.inserted.successes > 0 ? fmt::format("{:.0f}", s.pictures_median) : "-",
        printed ? fmt::format("{} of {}{}", printed->successes, printed->runs,
                              printed->time_s.is_number() ? fmt::format(", {} s", printed->time_s.get<double>()) : "")
                : "-");
    for (const auto& [reason, count] : s.failures.items()) {
      result.text += fmt::format("{:<15} {:>4} x {}\n", "", count.get<int>(), reason);
    }
    result.details["rows"].push_back({{"row", row.scene + ", " + row.features},
                                      {"size", row.setting.extents},
                                      {"failures", s.failures},
                                      {"time_s", {s.time.value, s.time.low, s.time.high}},
                                      {"error_m", {s.error.value, s.error.low, s.error.high}}});
    for (json& picture : WriteVisualServoingPictures(row, request)) {
      result.details["pictures"].push_back(std::move(picture));
    }
  }
  result.complete = true;
  return result;
}

}  // namespace feeler::evaluation
