#include "feeler/evaluation/studies/baselines.h"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "feeler/evaluation/harness/episode_figures.h"
#include "feeler/evaluation/harness/episode_sweep.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

constexpr double kCell_m = 0.002;

struct Competitor {
  const char* name;  ///< in tables and figures
  const char* policy;
  const char* cost;
};

// The greedy policies that weigh costs do so for either cost; the others do not look at it.
constexpr Competitor kCompetitors[] = {
    {"database", "database", "distance"},
    {"database, time", "database", "time"},
    {"online, time", "online", "time"},
    {"tbl", "tbl", "distance"},
    {"tbl-per-cost", "tbl-per-cost", "distance"},
    {"tbl-per-cost, time", "tbl-per-cost", "time"},
    {"tbl-submodular", "tbl-submodular", "distance"},
    {"tbl-submodular, time", "tbl-submodular", "time"},
    {"random", "random", "distance"},
    {"hybrid, time", "hybrid", "time"},
    {"spiral", "spiral", "distance"},
    {"open-loop", "open-loop", "distance"},
};

struct Row {
  const Competitor* competitor;
  int cells;
  EpisodeSetting setting;
};

std::vector<Row> RowsOf(bool quick) {
  const std::vector<int> sizes = quick ? std::vector<int>{3, 11} : std::vector<int>{2, 3, 5, 7, 11, 15};
  std::vector<Row> rows;
  for (const char* task : {"plug", "plug-tight"}) {
    for (const Competitor& competitor : kCompetitors) {
      for (const int n : sizes) {
        EpisodeSetting setting;
        setting.task = task;
        setting.policy = competitor.policy;
        setting.cost = competitor.cost;
        setting.extents = fmt::format("{0}x{0}x{0}", n);
        setting.name = fmt::format("{} {} {} {}", task, competitor.policy, competitor.cost, setting.extents);
        // A deterministic budget, so that records can be compared; about a second at the largest size.
        if (setting.policy == "online") setting.policy_options = {"online-expansions=3000"};
        setting.episodes = quick ? 3 : 40;
        rows.push_back({&competitor, n, std::move(setting)});
      }
    }
  }
  return rows;
}

/// Among policies that succeed about as often as the best (their intervals overlap), the fastest.
std::string WinnerOf(const std::vector<std::pair<std::string, EpisodeStatistics>>& field) {
  double best_low = 0.0;
  for (const auto& [name, s] : field) best_low = std::max(best_low, s.inserted.low);
  std::string winner = "-";
  double least = 0.0;
  for (const auto& [name, s] : field) {
    if (s.inserted.successes == 0 || s.inserted.high < best_low) continue;
    if (winner != "-" && s.sim_time.value >= least) continue;
    winner = name;
    least = s.sim_time.value;
  }
  return winner;
}

}  // namespace

ExperimentResult RunBaselines(const ExperimentRequest& request) {
  const std::vector<Row> rows = RowsOf(request.quick);
  std::vector<EpisodeSetting> settings;
  for (const Row& row : rows) settings.push_back(row.setting);
  EpisodeSweep sweep(kBaselinesName, std::move(settings), request);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = sweep.SettingsJson();
  if (!sweep.Run()) return result;

  result.complete = true;
  result.table.columns = {"task", "policy", "cells_per_axis", "uncertainty_mm"};
  for (const std::string& column : EpisodeColumns()) result.table.columns.push_back(column);
  result.text = fmt::format(
      "All policies over the same episodes in physics, seed {}. Uncertainty: the width of the box where the target may "
      "stand,\nalong each axis. Seconds: start pose to verdict, inserted episodes.\n\n{:<11} {:<21} {:>6} {}\n",
      request.seed, "task", "policy", "mm", EpisodeHeader());
  std::map<std::pair<std::string, int>, std::vector<std::pair<std::string, EpisodeStatistics>>> fields;
  std::map<std::string, std::vector<EpisodePoint>> points;
  for (const Row& row : rows) {
    const EpisodeStatistics s = StatisticsOf(sweep.Records(row.setting));
    const double width_mm = 1e3 * kCell_m * row.cells;
    std::vector<json> values = {row.setting.task, row.competitor->name, row.cells, width_mm};
    for (json& value : EpisodeValues(s)) values.push_back(std::move(value));
    result.table.rows.push_back(std::move(values));
    result.text +=
        fmt::format("{:<11} {:<21} {:>6.0f} {}\n", row.setting.task, row.competitor->name, width_mm, EpisodeLine(s));
    result.details["failures"].push_back(
        {{"setting", row.setting.name}, {"reasons", s.failures}, {"episodes", s.failed}});
    points[row.setting.task].push_back({row.competitor->name, width_mm, s});
    fields[{row.setting.task, row.cells}].emplace_back(row.competitor->name, s);
  }
  result.text += "\nFastest among those that succeed as often as the best (overlapping intervals):\n";
  for (const auto& [where, field] : fields) {
    const std::string winner = WinnerOf(field);
    result.text += fmt::format("  {:<11} {:>3.0f} mm  {}\n", where.first, 1e3 * kCell_m * where.second, winner);
    result.details["winners"].push_back({{"task", where.first}, {"cells_per_axis", where.second}, {"policy", winner}});
  }
  for (const auto& [task, of_task] : points) {
    for (Figure& figure : EpisodeFigures(task, "uncertainty per axis in mm", false, of_task)) {
      result.figures.push_back(std::move(figure));
    }
  }
  return result;
}

}  // namespace feeler::evaluation
