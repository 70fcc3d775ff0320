#include "feeler/cli/db_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "feeler/cli/common/console.h"

namespace feeler::cli {

nlohmann::json InfoJson(const policies::DatabaseInfo& info) {
  nlohmann::json ratios = nlohmann::json::array();
  for (const policies::RatioBin& bin : info.ratios) {
    // JSON has no infinity: the last bin is open.
    ratios.push_back(
        {{"up_to", std::isfinite(bin.up_to) ? nlohmann::json(bin.up_to) : nlohmann::json()}, {"count", bin.count}});
  }
  return {{"problems", info.problems},
          {"solved", info.solved},
          {"ratio_mean", info.ratio_mean},
          {"ratio_max", info.ratio_max},
          {"expected_cost_mean", info.expected_cost_mean},
          {"cpu_s", info.cpu_s},
          {"wall_s", info.wall_s},
          {"bytes", info.bytes},
          {"policy_nodes", info.policy_nodes},
          {"statuses", info.statuses},
          {"ratios", ratios}};
}

void PrintInfo(const policies::DatabaseInfo& info, const std::string& unit) {
  Print("problems            {}\n", info.problems);
  Print("solved              {}\n", info.solved);
  for (const auto& [status, count] : info.statuses) Print("  {:<18}{}\n", status, count);
  Print("expected cost, mean {:.2f} {}\n", info.expected_cost_mean, unit);
  Print("certified ratio     mean {:.4f}, max {:.4f}\n", info.ratio_mean, info.ratio_max);
  std::int64_t largest = 1;
  for (const policies::RatioBin& bin : info.ratios) largest = std::max(largest, bin.count);
  double from = 1.0;
  for (const policies::RatioBin& bin : info.ratios) {
    const auto bar = static_cast<std::size_t>(40 * bin.count / largest);
    if (bin.count > 0) Print("  {:>5.2f} - {:<5.2f} {:>6} {}\n", from, bin.up_to, bin.count, std::string(bar, '#'));
    from = bin.up_to;
  }
  Print("policy nodes        {}\n", info.policy_nodes);
  Print("CPU time to build   {:.1f} s\n", info.cpu_s);
  Print("file                {:.2f} MB\n", static_cast<double>(info.bytes) / 1e6);
}

}  // namespace feeler::cli
