#include "feeler/evaluation/harness/episode_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

namespace feeler::evaluation {

std::vector<Figure> EpisodeFigures(const std::string& title, const std::string& x_label, bool x_log,
                                   const std::vector<EpisodePoint>& points) {
  std::vector<Figure> figures;
  const auto add = [&](const std::string& what, const std::string& y_label,
                       const std::function<Estimate(const EpisodeStatistics&)>& value, bool inserted_only) {
    Figure figure{title + ": " + what, x_label, y_label, x_log, false, {}};
    for (const EpisodePoint& point : points) {
      auto series = std::find_if(figure.series.begin(), figure.series.end(),
                                 [&](const FigureSeries& s) { return s.name == point.series; });
      if (series == figure.series.end()) series = figure.series.insert(series, {point.series, {}});
      if (inserted_only && point.statistics.inserted.successes == 0) continue;
      const Estimate y = value(point.statistics);
      series->points.push_back({point.x, y.value, y.low, y.high});
    }
    figures.push_back(std::move(figure));
  };
  add(
      "success", "inserted, share of episodes",
      [](const EpisodeStatistics& s) {
        return Estimate{s.inserted.value, s.inserted.low, s.inserted.high};
      },
      false);
  add(
      "time", "simulated seconds, median", [](const EpisodeStatistics& s) { return s.sim_time; }, true);
  add(
      "path", "path of the tool in m, median", [](const EpisodeStatistics& s) { return s.path_length; }, true);
  add(
      "force", "peak force in N, median", [](const EpisodeStatistics& s) { return s.peak_force; }, false);
  return figures;
}

std::vector<std::string> EpisodeColumns() {
  return {"episodes",        "inserted",          "rate",           "rate_low",      "rate_high",
          "localized",       "time_median_s",     "time_low_s",     "time_high_s",   "path_median_m",
          "path_low_m",      "path_high_m",       "force_median_n", "force_low_n",   "force_high_n",
          "force_max_n",     "impulse_median_ns", "forbidden_mean", "contacts_mean", "moves_mean",
          "plan_cpu_mean_s", "ladder_use"};
}

std::vector<nlohmann::json> EpisodeValues(const EpisodeStatistics& s) {
  return {s.inserted.trials,   s.inserted.successes,      s.inserted.value,  s.inserted.low,
          s.inserted.high,     s.localized.successes,     s.sim_time.value,  s.sim_time.low,
          s.sim_time.high,     s.path_length.value,       s.path_length.low, s.path_length.high,
          s.peak_force.value,  s.peak_force.low,          s.peak_force.high, s.peak_force_max_n,
          s.impulse_median_ns, s.forbidden_contacts_mean, s.contacts_mean,   s.moves_mean,
          s.plan_cpu_mean_s,   s.ladder_used.value};
}

std::string EpisodeHeader() {
  return fmt::format("{:>9} {:>7} {:>17} {:>21} {:>9} {:>7} {:>7} {:>9}", "inserted", "%", "95 % interval",
                     "seconds, median", "path, m", "N", "N max", "plan, ms");
}

std::string EpisodeLine(const EpisodeStatistics& s) {
  return fmt::format("{:>4}/{:<4} {:>7.1f} {:>17} {:>21} {:>9.3f} {:>7.1f} {:>7.0f} {:>9.2f}", s.inserted.successes,
                     s.inserted.trials, 100.0 * s.inserted.value,
                     fmt::format("[{:.1f}, {:.1f}]", 100.0 * s.inserted.low, 100.0 * s.inserted.high),
                     s.inserted.successes > 0
                         ? fmt::format("{:.2f} [{:.2f}, {:.2f}]", s.sim_time.value, s.sim_time.low, s.sim_time.high)
                         : "-",
                     s.path_length.value, s.peak_force.value, s.peak_force_max_n, 1e3 * s.plan_cpu_mean_s);
}

}  // namespace feeler::evaluation
