#include "feeler/evaluation/studies/noise_price_episodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "feeler/evaluation/harness/episode_figures.h"
#include "feeler/evaluation/harness/episode_sweep.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

/// A kind of noise as the world and as the planner call it.
struct StepNoise {
  const char* fault;
  const char* option;
  const char* title;
};
constexpr StepNoise kStepNoises[] = {{"missed-contact", "missed-contact", "missed contacts"},
                                     {"false-stop", "false-stop", "false stops"},
                                     {"spent-step", "slip", "spent steps"}};

struct PlannedFor {
  const char* name;
  const char* policy;
  bool ladder;
};
/// With fallbacks first: what they did not touch is taken over by the bare ones.
constexpr PlannedFor kPlanners[] = {{"known", "noisy", true},
                                    {"known bare", "noisy", false},
                                    {"not known", "database", true},
                                    {"not known bare", "database", false}};

struct PriceRow {
  const StepNoise* noise;
  double level;
  const PlannedFor* planner;
  EpisodeSetting setting;
};

/// Without noise there is nothing to know: that row stands once, for all kinds.
std::vector<PriceRow> PriceRowsOf(const NoisePriceEpisodesProtocol& protocol) {
  std::vector<PriceRow> rows;
  const auto add = [&](const StepNoise& noise, double level, const PlannedFor& planner) {
    EpisodeSetting setting;
    const std::string of = level > 0.0 ? fmt::format("{} {:g}", noise.fault, level) : "no noise";
    setting.name = fmt::format("{} {}", planner.name, of);
    setting.policy = planner.policy;
    setting.extents = protocol.extents;
    if (level > 0.0) setting.noise = fmt::format("{}={:g}", noise.fault, level);
    if (setting.policy == "noisy") setting.policy_options = {fmt::format("{}={:g}", noise.option, level)};
    setting.ladder = planner.ladder;
    if (!planner.ladder) setting.bare_of = rows.back().setting.name;
    setting.episodes = protocol.episodes;
    rows.push_back({&noise, level, &planner, std::move(setting)});
  };
  add(kStepNoises[0], 0.0, kPlanners[2]);
  add(kStepNoises[0], 0.0, kPlanners[3]);
  for (const StepNoise& noise : kStepNoises) {
    for (const double level : protocol.levels) {
      for (const PlannedFor& planner : kPlanners) add(noise, level, planner);
    }
  }
  return rows;
}

/// Insertions that were believed in and were none.
Rate WrongInsertions(const std::vector<json>& records) {
  const auto wrong = std::ranges::count_if(records, [](const json& record) {
    return record.at("believed").at("inserted").get<bool>() && !record.at("inserted").get<bool>();
  });
  return WilsonRate(static_cast<int>(wrong), static_cast<int>(records.size()));
}

void AddPriceRow(const PriceRow& row, const EpisodeStatistics& s, const Rate& wrong, ExperimentResult& result) {
  const char* noise = row.level > 0.0 ? row.noise->title : "none";
  std::vector<json> values = {noise, row.level, row.planner->name, wrong.successes, wrong.low, wrong.high};
  for (json& value : EpisodeValues(s)) values.push_back(std::move(value));
  result.table.rows.push_back(std::move(values));
  result.text += fmt::format("{:<16} {:>6g} {:<15} {} {:>6}\n", noise, row.level, row.planner->name, EpisodeLine(s),
                             wrong.successes);
  result.details["failures"].push_back(
      {{"setting", row.setting.name}, {"reasons", s.failures}, {"episodes", s.failed}});
}

}  // namespace

ExperimentResult RunNoisePriceEpisodesOf(const NoisePriceEpisodesProtocol& protocol, const ExperimentRequest& request) {
  const std::vector<PriceRow> rows = PriceRowsOf(protocol);
  std::vector<EpisodeSetting> settings;
  for (const PriceRow& row : rows) settings.push_back(row.setting);
  EpisodeSweep sweep(kNoisePriceEpisodesName, std::move(settings), request);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = sweep.SettingsJson();
  if (!sweep.Run()) return result;

  result.complete = true;
  result.table.columns = {"noise", "level", "policy", "wrong_insertions", "wrong_low", "wrong_high"};
  for (const std::string& column : EpisodeColumns()) result.table.columns.push_back(column);
  result.text = fmt::format(
      "Noise in the steps of the simulated world: plug, {} hypotheses, seed {}.\n\n{:<16} {:>6} {:<15} {} {:>6}\n",
      protocol.extents, request.seed, "noise", "level", "policy", EpisodeHeader(), "wrong");
  for (const StepNoise& noise : kStepNoises) {
    std::vector<EpisodePoint> points;
    Figure wrongs{fmt::format("{}: believed in wrongly", noise.title),
                  "probability a step",
                  "share of episodes",
                  false,
                  false,
                  {}};
    for (const PlannedFor& planner : kPlanners) wrongs.series.push_back({planner.name, {}});
    for (const PriceRow& row : rows) {
      if (row.level > 0.0 && row.noise != &noise) continue;
      const std::vector<json> records = sweep.Records(row.setting);
      const EpisodeStatistics s = StatisticsOf(records);
      const Rate wrong = WrongInsertions(records);
      points.push_back({row.planner->name, row.level, s});
      wrongs.series[static_cast<std::size_t>(row.planner - kPlanners)].points.push_back(
          {row.level, wrong.value, wrong.low, wrong.high});
      if (row.noise == &noise) AddPriceRow(row, s, wrong, result);
    }
    for (Figure& figure : EpisodeFigures(noise.title, "probability a step", false, points)) {
      result.figures.push_back(std::move(figure));
    }
    result.figures.push_back(std::move(wrongs));
  }
  return result;
}

ExperimentResult RunNoisePriceEpisodes(const ExperimentRequest& request) {
  NoisePriceEpisodesProtocol protocol;
  if (request.quick) {
    protocol.levels = {0.02};
    protocol.extents = "3x3x3";
    protocol.episodes = 3;
  }
  return RunNoisePriceEpisodesOf(protocol, request);
}

}  // namespace feeler::evaluation
