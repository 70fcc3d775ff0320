#include "feeler/execution/remote/ordered_faults.h"

#include <algorithm>
#include <charconv>
#include <iterator>

#include "feeler/core/error.h"

namespace feeler::execution {
namespace {

constexpr std::string_view kNames[kWireFaultCount] = {"drop",    "stall", "protective", "malformed", "half",
                                                      "version", "nan",   "backwards",  "jump"};

struct Measure {
  std::string_view name;
  double OrderedFaults::*field;
  double unit;  ///< of the number given
  double least;
  double most;
};
constexpr Measure kMeasures[] = {
    {"latency", &OrderedFaults::latency_s, 1e-3, 0.0, 1000.0}, {"jitter", &OrderedFaults::jitter_s, 1e-3, 0.0, 1000.0},
    {"stall-ms", &OrderedFaults::stall_s, 1e-3, 0.0, 10000.0}, {"slowed", &OrderedFaults::slowed, 1.0, 0.01, 1.0},
    {"bias", &OrderedFaults::bias_n, 1.0, -100.0, 100.0},
};

std::string Known() {
  std::string names;
  for (const std::string_view name : kNames) names += std::string(name) + "=SHARE, ";
  return names + "latency=MS, jitter=MS, stall-ms=MS, slowed=FACTOR, bias=N";
}

double NumberIn(std::string_view item, std::string_view text, double least, double most) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= least && value <= most)) {
    throw InputError("--faults", "'" + std::string(item) + "' has no sensible number",
                     "give " + std::to_string(least) + " to " + std::to_string(most));
  }
  return value;
}

}  // namespace

std::string_view ToString(WireFault fault) { return kNames[static_cast<int>(fault)]; }

bool OrderedFaults::any() const {
  return std::any_of(std::begin(share), std::end(share), [](double s) { return s > 0.0; });
}

OrderedFaults ParseOrderedFaults(const std::string& text) {
  OrderedFaults faults;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    const std::string_view item = std::string_view(text).substr(from, comma - from);
    from = comma + 1;
    const std::size_t equals = item.find('=');
    const std::string_view name = item.substr(0, equals);
    const std::string_view number = equals == std::string_view::npos ? "" : item.substr(equals + 1);
    const auto* kind = std::find(std::begin(kNames), std::end(kNames), name);
    if (kind != std::end(kNames)) {
      faults.share[kind - std::begin(kNames)] = NumberIn(item, number, 0.0, 1.0);
      continue;
    }
    const auto* measure =
        std::find_if(std::begin(kMeasures), std::end(kMeasures), [&](const Measure& m) { return m.name == name; });
    if (measure == std::end(kMeasures)) {
      throw InputError("--faults", "no fault is named '" + std::string(name) + "'", "known are " + Known());
    }
    faults.*measure->field = measure->unit * NumberIn(item, number, measure->least, measure->most);
  }
  return faults;
}

std::vector<PlannedFault> PlanFaults(const OrderedFaults& ordered, std::uint64_t seed, std::uint64_t episode) {
  constexpr std::size_t kMotions = 12;
  constexpr double kLatest_s = 0.2;
  std::vector<PlannedFault> planned;
  for (int kind = 0; kind < kWireFaultCount; ++kind) {
    RandomStream random(seed, episode, "wire fault " + std::string(kNames[kind]));
    const bool comes = random.Uniform(0.0, 1.0) < ordered.share[kind];
    PlannedFault fault{static_cast<WireFault>(kind), static_cast<int>(random.Index(kMotions)), 0.0};
    fault.after_s = random.Uniform(0.0, kLatest_s);
    if (comes) planned.push_back(fault);
  }
  return planned;
}

}  // namespace feeler::execution
