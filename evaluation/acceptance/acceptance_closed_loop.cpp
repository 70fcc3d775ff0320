#include "feeler/evaluation/acceptance/acceptance_closed_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace feeler::evaluation {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 4> kSizes = {"3x3x3", "7x7x7", "11x11x11", "15x15x15"};
constexpr double kTightConfirmLimit_m = 0.00015;

struct Condition {
  const char* name;
  const char* task;
  const char* cost;
  const char* noise;
  const char* extents;  ///< null: the four sizes
  double required_bare;
  double required_ladder;
  std::int64_t episodes;  ///< per size
};

// Policies save seconds, but for one row whose policies save distance, as the paper's do. 7 cells an axis where the
// table does not ask for the four sizes.
constexpr Condition kConditions[] = {
    {"ideal", "plug", "time", "ideal", nullptr, 0.995, 0.999, 250},
    {"ideal distance", "plug", "distance", "ideal", nullptr, 0.995, 0.999, 250},
    {"friction", "plug", "time", "friction", nullptr, 0.0, 0.99, 250},
    {"truth outside", "plug", "time", "outside", "7x7x7", 0.0, 0.99, 300},
    {"fall-in", "plug", "time", "fall-in", "7x7x7", 0.0, 0.99, 300},
    {"housing oversize", "plug", "time", "oversize", "7x7x7", 0.0, 0.99, 300},
    {"yaw error 2 deg", "plug", "time", "yaw-2", "7x7x7", 0.0, 0.99, 300},
    {"yaw error 3 deg", "plug", "time", "yaw-3", "7x7x7", 0.0, 0.95, 300},
    {"plug-tight", "plug-tight", "time", "ideal", "7x7x7", 0.0, 0.99, 300},
    {"round-peg", "round-peg", "time", "ideal", "7x7x7", 0.0, 0.97, 300},
    {"rectangular-plug", "rectangular-plug", "time", "ideal", "7x7x7", 0.0, 0.97, 300},
    {"plug-fine", "plug-fine", "time", "ideal", "7x7x7", 0.0, 0.97, 300},
    {"plug-two-axes", "plug-two-axes", "time", "ideal", "7x7x1", 0.0, 0.97, 300},
    {"plug-flush", "plug-flush", "time", "ideal", "7x7x7", 0.0, 0.0, 300},
};

AcceptanceRow MakeRow(const Condition& condition, bool ladder, bool quick) {
  AcceptanceRow row;
  row.name = fmt::format("{} {}", condition.name, ladder ? "with ladder" : "bare");
  row.required_inserted = ladder ? condition.required_ladder : condition.required_bare;
  const std::vector<std::string> sizes = condition.extents == nullptr
                                             ? std::vector<std::string>(kSizes.begin(), kSizes.end())
                                             : std::vector<std::string>{condition.extents};
  for (const std::string& size : sizes) {
    EpisodeSetting setting;
    setting.name = row.name + " " + size;
    setting.task = condition.task;
    setting.cost = condition.cost;
    setting.extents = size;
    setting.noise = condition.noise;
    setting.ladder = ladder;
    if (!ladder) setting.bare_of = fmt::format("{} with ladder {}", condition.name, size);
    setting.episodes = quick ? 4 : condition.episodes;
    row.settings.push_back(std::move(setting));
  }
  return row;
}

std::string Percent(double rate) { return fmt::format("{:.2f}", 100.0 * rate); }

}  // namespace

std::vector<AcceptanceRow> AcceptanceClosedLoopRows(bool quick) {
  std::vector<AcceptanceRow> rows;
  for (const Condition& condition : kConditions) {
    for (const bool ladder : {true, false}) rows.push_back(MakeRow(condition, ladder, quick));
  }
  AcceptanceRow tight = MakeRow({"tight confirm", "plug", "time", "ideal", "7x7x7", 0.0, 0.99, 300}, true, quick);
  for (EpisodeSetting& setting : tight.settings) setting.confirm_limit_m = kTightConfirmLimit_m;
  rows.push_back(std::move(tight));
  return rows;
}

ExperimentResult RunAcceptanceClosedLoop(const ExperimentRequest& request) {
  const std::vector<AcceptanceRow> rows = AcceptanceClosedLoopRows(request.quick);
  std::vector<EpisodeSetting> settings;
  for (const AcceptanceRow& row : rows) settings.insert(settings.end(), row.settings.begin(), row.settings.end());
  EpisodeSweep sweep(kAcceptanceClosedLoopName, std::move(settings), request);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = sweep.SettingsJson();
  if (!sweep.Run()) return result;

  result.complete = true;
  result.table.columns = {"row",         "size",          "episodes",   "inserted",     "rate",
                          "low",         "high",          "required",   "localized",    "ladder_use",
                          "time_mean_s", "time_median_s", "time_max_s", "error_p50_mm", "error_p95_mm",
                          "moves",       "contacts",      "path_m",     "peak_force_n", "cpu_s"};
  result.text = fmt::format(
      "The closed loop in physics, seed {}. Times: start pose to verdict, inserted episodes. Errors: of the final "
      "position across the insertion.\n\n{:<30} {:<9} {:>9} {:>8} {:>16} {:>8} {:>9} {:>21} {:>15} {:>7} {:>6}\n",
      request.seed, "row", "size", "inserted", "%", "95 % interval", "required", "ladder %", "mean/median/max s",
      "p50/p95 mm", "moves", "CPU s");
  const auto add = [&](const AcceptanceRow& row, const std::string& size, const std::vector<json>& records,
                       bool judged) {
    const EpisodeStatistics s = StatisticsOf(records);
    result.table.rows.push_back({row.name,
                                 size,
                                 s.inserted.trials,
                                 s.inserted.successes,
                                 s.inserted.value,
                                 s.inserted.low,
                                 s.inserted.high,
                                 judged ? json(row.required_inserted) : json(),
                                 s.localized.successes,
                                 s.ladder_used.value,
                                 s.sim_time_mean_s,
                                 s.sim_time_median_s,
                                 s.sim_time_max_s,
                                 1e3 * s.lateral_error_median_m,
                                 1e3 * s.lateral_error_p95_m,
                                 s.moves_mean,
                                 s.contacts_mean,
                                 s.path_length_mean_m,
                                 s.peak_force_max_n,
                                 s.cpu_mean_s});
    const std::string verdict = !judged || row.required_inserted == 0.0
                                    ? "-"
                                    : fmt::format("{:g} {}", 100.0 * row.required_inserted,
                                                  s.inserted.value >= row.required_inserted ? "yes" : "NO");
    result.text +=
        fmt::format("{:<30} {:<9} {:>4}/{:<4} {:>8} {:>16} {:>8} {:>9} {:>21} {:>15} {:>7.1f} {:>6.2f}\n", row.name,
                    size, s.inserted.successes, s.inserted.trials, Percent(s.inserted.value),
                    fmt::format("{} .. {}", Percent(s.inserted.low), Percent(s.inserted.high)), verdict,
                    Percent(s.ladder_used.value),
                    fmt::format("{:.2f}/{:.2f}/{:.2f}", s.sim_time_mean_s, s.sim_time_median_s, s.sim_time_max_s),
                    fmt::format("{:.2f}/{:.2f}", 1e3 * s.lateral_error_median_m, 1e3 * s.lateral_error_p95_m),
                    s.moves_mean, s.cpu_mean_s);
    result.details["rows"].push_back(
        {{"row", row.name}, {"size", size}, {"failures", s.failures}, {"failed_episodes", s.failed}});
  };
  for (const AcceptanceRow& row : rows) {
    std::vector<json> all;
    for (const EpisodeSetting& setting : row.settings) {
      const std::vector<json> records = sweep.Records(setting);
      if (row.settings.size() > 1) add(row, setting.extents, records, false);
      all.insert(all.end(), records.begin(), records.end());
    }
    add(row, row.settings.size() > 1 ? "all" : row.settings.front().extents, all, true);
  }
  return result;
}

}  // namespace feeler::evaluation
