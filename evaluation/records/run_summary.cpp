#include "feeler/evaluation/records/run_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace feeler::evaluation {

RunSummary Summarize(const std::vector<EpisodeSummaryRow>& rows) {
  RunSummary summary;
  summary.episodes = static_cast<int>(rows.size());
  int localized = 0;
  int inserted = 0;
  int ladder_used = 0;
  std::vector<double> times, moves, contacts, lengths, plan;
  for (const EpisodeSummaryRow& row : rows) {
    localized += row.localized ? 1 : 0;
    inserted += row.inserted ? 1 : 0;
    if (row.inserted) {
      times.push_back(row.sim_time_s);
    } else {
      ++summary.failures[row.reason.substr(0, row.reason.find(':'))];  // what follows differs from episode to episode
    }
    ladder_used += row.rungs.empty() ? 0 : 1;
    for (const std::string& rung : std::set<std::string>(row.rungs.begin(), row.rungs.end())) ++summary.rungs[rung];
    moves.push_back(row.moves);
    contacts.push_back(row.contacts);
    lengths.push_back(row.path_length_m);
    plan.push_back(row.plan_cpu_s);
    summary.peak_force_max_n = std::max(summary.peak_force_max_n, row.peak_force_n);
  }
  summary.localized = WilsonRate(localized, summary.episodes);
  summary.inserted = WilsonRate(inserted, summary.episodes);
  summary.ladder_used = WilsonRate(ladder_used, summary.episodes);
  summary.sim_time_mean_s = Mean(times);
  summary.sim_time_median_s = Median(times);
  summary.sim_time_max_s = times.empty() ? 0.0 : *std::max_element(times.begin(), times.end());
  summary.moves_mean = Mean(moves);
  summary.contacts_mean = Mean(contacts);
  summary.path_length_mean_m = Mean(lengths);
  summary.plan_cpu_s = Mean(plan);
  return summary;
}

nlohmann::json ToJson(const RunSummary& summary) {
  const auto interval = [](const Rate& rate) { return nlohmann::json{rate.low, rate.high}; };
  return {{"episodes", summary.episodes},
          {"localized", summary.localized.successes},
          {"localized_interval", interval(summary.localized)},
          {"inserted", summary.inserted.successes},
          {"inserted_interval", interval(summary.inserted)},
          {"sim_time_mean_s", summary.sim_time_mean_s},
          {"sim_time_median_s", summary.sim_time_median_s},
          {"sim_time_max_s", summary.sim_time_max_s},
          {"moves_mean", summary.moves_mean},
          {"contacts_mean", summary.contacts_mean},
          {"path_length_mean_m", summary.path_length_mean_m},
          {"peak_force_max_n", summary.peak_force_max_n},
          {"plan_cpu_s", summary.plan_cpu_s},
          {"ladder_used", summary.ladder_used.successes},
          {"ladder_used_rate", summary.ladder_used.value},
          {"rungs", summary.rungs},
          {"failures", summary.failures}};
}

std::string ToText(const RunSummary& summary) {
  const auto rate = [&](const Rate& r) {
    return fmt::format("{} of {} ({:.1f} %, 95 % interval {:.1f} to {:.1f} %)", r.successes, r.trials, 100 * r.value,
                       100 * r.low, 100 * r.high);
  };
  std::string text;
  text += fmt::format("localized        {}\n", rate(summary.localized));
  text += fmt::format("inserted         {}\n", rate(summary.inserted));
  text += fmt::format("simulated time   median {:.2f} s, longest {:.2f} s (start pose to inserted)\n",
                      summary.sim_time_median_s, summary.sim_time_max_s);
  text += fmt::format("moves, contacts  {:.1f}, {:.1f} per episode\n", summary.moves_mean, summary.contacts_mean);
  text += fmt::format("path length      {:.3f} m per episode\n", summary.path_length_mean_m);
  text += fmt::format("peak force       {:.1f} N at most\n", summary.peak_force_max_n);
  text += fmt::format("planning, CPU    {:.2f} ms per episode\n", 1000 * summary.plan_cpu_s);
  text += fmt::format("fallbacks        {}\n", rate(summary.ladder_used));
  for (const auto& [rung, count] : summary.rungs) text += fmt::format("  {:<16} in {} episodes\n", rung, count);
  for (const auto& [reason, count] : summary.failures) text += fmt::format("failed           {} x {}\n", count, reason);
  return text;
}

}  // namespace feeler::evaluation
