#include "feeler/evaluation/paper/table2_framework.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "feeler/evaluation/harness/episode_figures.h"
#include "feeler/evaluation/harness/episode_sweep.h"
#include "feeler/evaluation/harness/paper_results.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

struct Row {
  std::string name;
  std::size_t printed;  ///< row of the paper's table
  EpisodeSetting setting;
};

/// Rows of the paper's table.
constexpr std::size_t kPrintedPlug = 0;
constexpr std::size_t kPrintedPipe = 1;

std::vector<Row> RowsOf(bool quick) {
  std::vector<Row> rows;
  const auto add = [&](const std::string& name, std::size_t printed, const std::string& task, const std::string& cost,
                       bool ladder) {
    const bool plug = printed == kPrintedPlug;
    EpisodeSetting setting;
    setting.task = task;
    setting.cost = cost;
    setting.extents = plug ? (quick ? "2..4x2..4x2..4" : "2..15x2..15x2..15")
                           : (quick ? "2..4x2..4x2..3x2..3" : "2..10x2..10x2..6x2..6");
    setting.placement = "workspace";
    setting.ladder = ladder;
    setting.name = fmt::format("{} {} {}", task, cost, ladder ? "with ladder" : "bare");
    if (!ladder) setting.bare_of = fmt::format("{} {} with ladder", task, cost);
    setting.episodes = quick ? 8 : 200;
    rows.push_back({name, printed, std::move(setting)});
  };
  for (const char* cost : {"time", "distance"}) {
    add(fmt::format("plug, policies that save {}", cost), kPrintedPlug, "plug", cost, true);
    add(fmt::format("plug, policies that save {}, without fallbacks", cost), kPrintedPlug, "plug", cost, false);
  }
  for (const char* task : {"pipe-into-elbow", "elbow-onto-pipe"}) {
    add(task, kPrintedPipe, task, "distance", true);
    add(fmt::format("{}, without fallbacks", task), kPrintedPipe, task, "distance", false);
  }
  return rows;
}

}  // namespace

ExperimentResult RunTable2Framework(const ExperimentRequest& request) {
  const std::vector<Row> rows = RowsOf(request.quick);
  std::vector<EpisodeSetting> settings;
  for (const Row& row : rows) settings.push_back(row.setting);
  EpisodeSweep sweep(kTable2FrameworkName, std::move(settings), request);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = sweep.SettingsJson();
  if (!sweep.Run()) return result;

  result.complete = true;
  const json& printed_rows = PaperResults().at("table2_framework").at("rows");
  result.table.columns = {"row", "printed_success_percent", "printed_execution_time_s", "rejected_placements"};
  for (const std::string& column : EpisodeColumns()) result.table.columns.push_back(column);
  result.text = fmt::format(
      "Table II: success and execution time, targets anywhere in the workspace, seed {}. Seconds: start pose to "
      "verdict.\n\n{:<50} {} {:>9} {:>8} {:>10}\n",
      request.seed, "row", EpisodeHeader(), "rejected", "paper %", "paper s");
  for (const Row& row : rows) {
    const EpisodeStatistics s = StatisticsOf(sweep.Records(row.setting));
    const json& printed = printed_rows.at(row.printed);
    std::vector<json> values = {row.name, printed.at(1), printed.at(2), s.rejected_placements};
    for (json& value : EpisodeValues(s)) values.push_back(std::move(value));
    result.table.rows.push_back(std::move(values));
    result.text += fmt::format("{:<50} {} {:>9} {:>8} {:>10}\n", row.name, EpisodeLine(s), s.rejected_placements,
                               printed.at(1).get<double>(), printed.at(2).get<double>());
    result.details["failures"].push_back({{"row", row.name}, {"reasons", s.failures}, {"episodes", s.failed}});
  }
  result.text += "\nPipes: x, y, yaw and pitch uncertain; policies that save distance; one insertion an episode.\n";
  result.details["paper_note"] = PaperResults().at("table2_framework").at("note");
  return result;
}

}  // namespace feeler::evaluation
