#include "feeler/evaluation/studies/noise.h"

#include <fmt/format.h>

#include <map>
#include <utility>
#include <vector>

#include "feeler/evaluation/harness/episode_figures.h"
#include "feeler/evaluation/harness/episode_sweep.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

struct Kind {
  const char* noise;  ///< workflow::ParseFaults, before the "="
  const char* title;
  const char* unit;
  std::vector<double> levels;  ///< harder and harder; all but the first of stiffness start with none
};

const std::vector<Kind>& Kinds() {
  static const std::vector<Kind> kKinds = {
      {"force-noise", "noise of the force sensor", "N", {0, 1, 2, 4, 6}},
      {"joint-friction", "joint friction", "Nm", {0, 3, 6, 10, 15}},
      {"stiffness", "joint stiffness", "Nm/rad", {200000, 50000, 30000, 20000, 10000}},
      {"yaw", "turned target", "deg", {0, 1, 2, 3, 4, 6}},
  };
  return kKinds;
}

struct NoiseCompetitor {
  const char* name;
  const char* policy;
  bool ladder;
};
constexpr NoiseCompetitor kNoiseCompetitors[] = {{"database", "database", true},
                                                 {"database, bare", "database", false},
                                                 {"tbl", "tbl", true},
                                                 {"spiral", "spiral", false}};

struct NoiseRow {
  const Kind* kind;
  double level;
  const NoiseCompetitor* competitor;
  EpisodeSetting setting;
};

std::vector<NoiseRow> NoiseRowsOf(bool quick) {
  std::vector<NoiseRow> rows;
  for (const Kind& kind : Kinds()) {
    for (std::size_t i = 0; i < kind.levels.size(); ++i) {
      if (quick && i % 3 != 1) continue;
      for (const NoiseCompetitor& competitor : kNoiseCompetitors) {
        EpisodeSetting setting;
        setting.policy = competitor.policy;
        setting.cost = "time";
        setting.extents = "7x7x7";
        setting.noise = fmt::format("{}={:g}", kind.noise, kind.levels[i]);
        setting.ladder = competitor.ladder;
        setting.name = fmt::format("{} {} {:g}", competitor.name, kind.noise, kind.levels[i]);
        std::erase(setting.name, ',');
        if (!competitor.ladder && setting.policy == "database") {
          setting.bare_of = fmt::format("database {} {:g}", kind.noise, kind.levels[i]);
        }
        setting.episodes = quick ? 3 : 60;
        rows.push_back({&kind, kind.levels[i], &competitor, std::move(setting)});
      }
    }
  }
  return rows;
}

}  // namespace

ExperimentResult RunNoise(const ExperimentRequest& request) {
  const std::vector<NoiseRow> rows = NoiseRowsOf(request.quick);
  std::vector<EpisodeSetting> settings;
  for (const NoiseRow& row : rows) settings.push_back(row.setting);
  EpisodeSweep sweep(kNoiseName, std::move(settings), request);
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = sweep.SettingsJson();
  if (!sweep.Run()) return result;

  result.complete = true;
  result.table.columns = {"noise", "level", "unit", "policy"};
  for (const std::string& column : EpisodeColumns()) result.table.columns.push_back(column);
  result.text = fmt::format("What breaks first: plug, 7x7x7 hypotheses (14 mm), seed {}.\n\n{:<16} {:>14} {:<15} {}\n",
                            request.seed, "noise", "level", "policy", EpisodeHeader());
  std::map<const Kind*, std::vector<EpisodePoint>> points;
  std::map<std::pair<const Kind*, std::string>, double> breaks;  // the first level with fewer than 95 % inserted
  for (const NoiseRow& row : rows) {
    const EpisodeStatistics s = StatisticsOf(sweep.Records(row.setting));
    std::vector<json> values = {row.kind->noise, row.level, row.kind->unit, row.competitor->name};
    for (json& value : EpisodeValues(s)) values.push_back(std::move(value));
    result.table.rows.push_back(std::move(values));
    result.text += fmt::format("{:<16} {:>14} {:<15} {}\n", row.kind->noise,
                               fmt::format("{:g} {}", row.level, row.kind->unit), row.competitor->name, EpisodeLine(s));
    result.details["failures"].push_back(
        {{"setting", row.setting.name}, {"reasons", s.failures}, {"episodes", s.failed}});
    points[row.kind].push_back({row.competitor->name, row.level, s});
    if (s.inserted.value < 0.95) breaks.try_emplace({row.kind, row.competitor->name}, row.level);
  }
  result.text += "\nFirst level with fewer than 95 % inserted:\n";
  for (const Kind& kind : Kinds()) {
    result.text += fmt::format("  {:<26}", kind.title);
    for (const NoiseCompetitor& competitor : kNoiseCompetitors) {
      const auto found = breaks.find({&kind, competitor.name});
      const std::string level = found == breaks.end() ? "none" : fmt::format("{:g} {}", found->second, kind.unit);
      result.text += fmt::format(" {}: {};", competitor.name, level);
      result.details["breaks"].push_back({{"noise", kind.noise},
                                          {"policy", competitor.name},
                                          {"level", found == breaks.end() ? json() : json(found->second)}});
    }
    result.text += "\n";
    const bool log = std::string(kind.noise) == "stiffness";
    for (Figure& figure :
         EpisodeFigures(kind.title, fmt::format("{} in {}", kind.title, kind.unit), log, points[&kind])) {
      result.figures.push_back(std::move(figure));
    }
  }
  return result;
}

}  // namespace feeler::evaluation
