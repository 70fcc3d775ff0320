#include "feeler/evaluation/studies/spiral_tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "feeler/evaluation/harness/episode_figures.h"
#include "feeler/evaluation/harness/episode_sweep.h"
#include "feeler/policies/spiral/spiral_policy.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

struct SpiralRow {
  policies::SpiralTuning tuning;
  EpisodeSetting setting;
  EpisodeStatistics statistics;
};

std::vector<SpiralRow> SpiralRowsOf(bool quick) {
  struct Socket {
    const char* task;
    std::vector<double> pitch_mm;
    std::vector<double> speeds_mm_s;
  };
  // Around the clearance of the socket (0.5 and 0.2 mm), chamfer (1 and 0.3 mm) included, and wide
  // enough that the best lies within.
  std::vector<Socket> sockets = {{"plug", {1.0, 1.5, 2.0, 2.5, 3.5}, {40, 80, 120}},
                                 {"plug-tight", {0.3, 0.4, 0.6, 0.8, 1.1}, {20, 40, 80}}};
  std::vector<double> forces_n = {10, 20, 40};
  if (quick) {
    for (Socket& socket : sockets) {
      socket.pitch_mm = {socket.pitch_mm[1], socket.pitch_mm[3]};
      socket.speeds_mm_s = {40};
    }
    forces_n = {20};
  }
  std::vector<SpiralRow> rows;
  for (const Socket& socket : sockets) {
    for (const double pitch_mm : socket.pitch_mm) {
      for (const double speed_mm_s : socket.speeds_mm_s) {
        for (const double force_n : forces_n) {
          SpiralRow row;
          row.tuning = {1e-3 * pitch_mm, 1e-3 * speed_mm_s, force_n};
          row.setting.task = socket.task;
          row.setting.policy = "spiral";
          row.setting.extents = "7x7x7";
          row.setting.name = fmt::format("{} {:g}um {:g}mm-s {:g}N", socket.task, 1e3 * pitch_mm, speed_mm_s, force_n);
          row.setting.policy_options = {fmt::format("spiral-pitch={:g}", row.tuning.pitch_m),
                                        fmt::format("spiral-speed={:g}", row.tuning.speed_m_s),
                                        fmt::format("spiral-force={:g}", row.tuning.press_n)};
          row.setting.episodes = quick ? 3 : 25;
          rows.push_back(std::move(row));
        }
      }
    }
  }
  return rows;
}

/// Most insertions; of equals the least median time.
const SpiralRow* BestOf(const std::vector<SpiralRow>& rows, const std::string& task) {
  int most = 0;
  for (const SpiralRow& row : rows) {
    if (row.setting.task == task) most = std::max(most, row.statistics.inserted.successes);
  }
  const SpiralRow* best = nullptr;
  for (const SpiralRow& row : rows) {
    if (row.setting.task != task || row.statistics.inserted.successes < std::max(1, most)) continue;
    if (best == nullptr || row.statistics.sim_time.value < best->statistics.sim_time.value) best = &row;
  }
  return best;
}

}  // namespace

ExperimentResult RunSpiralTuning(const ExperimentRequest& request) {
  std::vector<SpiralRow> rows = SpiralRowsOf(request.quick);
  std::vector<EpisodeSetting> settings;
  for (const SpiralRow& row : rows) settings.push_back(row.setting);
  EpisodeSweep sweep(kSpiralTuningName, std::move(settings), request);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = sweep.SettingsJson();
  if (!sweep.Run()) return result;

  result.complete = true;
  result.table.columns = {"task", "pitch_mm", "speed_mm_s", "force_n"};
  for (const std::string& column : EpisodeColumns()) result.table.columns.push_back(column);
  result.text = fmt::format(
      "Spiral search, 7x7x7 hypotheses (14 mm), the same episodes for every tuning, seed {}.\n\n{:<11} {:>6} {:>6} "
      "{:>5} {}\n",
      request.seed, "task", "pitch", "mm/s", "N", EpisodeHeader());
  std::vector<EpisodePoint> points;
  for (SpiralRow& row : rows) {
    row.statistics = StatisticsOf(sweep.Records(row.setting));
    const policies::SpiralTuning& t = row.tuning;
    std::vector<json> values = {row.setting.task, 1e3 * t.pitch_m, 1e3 * t.speed_m_s, t.press_n};
    for (json& value : EpisodeValues(row.statistics)) values.push_back(std::move(value));
    result.table.rows.push_back(std::move(values));
    result.text += fmt::format("{:<11} {:>6.2f} {:>6.0f} {:>5.0f} {}\n", row.setting.task, 1e3 * t.pitch_m,
                               1e3 * t.speed_m_s, t.press_n, EpisodeLine(row.statistics));
    points.push_back({fmt::format("{}, {:.0f} mm/s, {:.0f} N", row.setting.task, 1e3 * t.speed_m_s, t.press_n),
                      1e3 * t.pitch_m, row.statistics});
  }
  result.text += "\nBest (most inserted, then least time):\n";
  for (const char* task : {"plug", "plug-tight"}) {
    const SpiralRow* best = BestOf(rows, task);
    if (best == nullptr) continue;
    const policies::SpiralTuning& t = best->tuning;
    result.text += fmt::format("  {:<11} pitch {:.2f} mm, {:.0f} mm/s, {:.0f} N\n", task, 1e3 * t.pitch_m,
                               1e3 * t.speed_m_s, t.press_n);
    result.details["best"].push_back(
        {{"task", task}, {"pitch_m", t.pitch_m}, {"speed_m_s", t.speed_m_s}, {"force_n", t.press_n}});
  }
  result.figures = EpisodeFigures("Spiral tuning", "pitch in mm", false, points);
  return result;
}

}  // namespace feeler::evaluation
