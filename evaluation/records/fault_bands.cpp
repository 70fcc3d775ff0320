#include "feeler/evaluation/records/fault_bands.h"

#include <fmt/format.h>

#include <algorithm>

namespace feeler::evaluation {
namespace {

constexpr int kBands = 4;

}  // namespace

void FaultBands::Add(const nlohmann::json& record) {
  const auto values = record.find("fault_values");
  if (values == record.end()) return;
  for (const auto& [fault, value] : values->items()) {
    seen_[fault].push_back(
        {value.get<double>(), record.at("inserted").get<bool>(), record.at("sim_time_s").get<double>()});
  }
}

nlohmann::json FaultBands::ToJson() const {
  nlohmann::json bands = nlohmann::json::array();
  for (const auto& [fault, all] : seen_) {
    const auto [least, most] = std::ranges::minmax_element(all, {}, &Seen::value);
    const double from = least->value;
    const double width = (most->value - from) / kBands;
    for (int band = 0; band < kBands; ++band) {
      int episodes = 0;
      int inserted = 0;
      double time_max_s = 0.0;
      for (const Seen& seen : all) {
        const int its = width > 0.0 ? std::min(kBands - 1, static_cast<int>((seen.value - from) / width)) : 0;
        if (its != band) continue;
        ++episodes;
        inserted += seen.inserted ? 1 : 0;
        time_max_s = std::max(time_max_s, seen.time_s);
      }
      if (episodes == 0) continue;
      bands.push_back({{"fault", fault},
                       {"from", from + band * width},
                       {"to", from + (band + 1) * width},
                       {"episodes", episodes},
                       {"inserted", inserted},
                       {"time_max_s", time_max_s}});
    }
  }
  return bands;
}

std::string FaultBands::ToText() const {
  std::string text;
  for (const auto& band : ToJson()) {
    text += fmt::format("{:<16} {:.2f} to {:.2f}: {} of {} inserted, {:.1f} s at most\n",
                        band["fault"].get<std::string>(), band["from"].get<double>(), band["to"].get<double>(),
                        band["inserted"].get<int>(), band["episodes"].get<int>(), band["time_max_s"].get<double>());
  }
  return text;
}

}  // namespace feeler::evaluation
