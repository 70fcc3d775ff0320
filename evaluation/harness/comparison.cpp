#include "feeler/evaluation/harness/comparison.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace feeler::evaluation {
namespace {

constexpr double kLeastCpu_s = 1e-6;

double Cpu(const SolveRecord& record) { return std::max(record.cpu_s, kLeastCpu_s); }
double Expansions(const SolveRecord& record) {
  return static_cast<double>(std::max<std::int64_t>(record.expansions, 1));
}

double RatioOfCosts(const SolveRecord& other, const SolveRecord& base) {
  return base.expected_cost > 0.0 ? other.expected_cost / base.expected_cost : 1.0;
}

RelativeCost MeanOf(const std::vector<double>& ratios) {
  RelativeCost cost;
  for (const double ratio : ratios) cost.mean += ratio;
  cost.attempts = static_cast<int>(ratios.size());
  if (cost.attempts > 0) cost.mean /= cost.attempts;
  return cost;
}

}  // namespace

SolveRecord RecordOf(const planner::SolverResult& result) {
  return {std::string(planner::ToString(result.status)),
          result.complete(),
          result.complete() ? result.expected_cost : 0.0,
          std::isfinite(result.lower_bound) ? result.lower_bound : 0.0,
          result.expansions,
          result.cpu_s,
          result.wall_s};
}

nlohmann::json ToJson(const SolveRecord& record) {
  return {{"status", record.status},
          {"expected_cost", record.complete ? nlohmann::json(record.expected_cost) : nlohmann::json()},
          {"lower_bound", record.lower_bound},
          {"expansions", record.expansions},
          {"cpu_s", record.cpu_s},
          {"wall_s", record.wall_s}};
}

SolveRecord RecordFromJson(const nlohmann::json& document) {
  SolveRecord record;
  record.status = document.at("status").get<std::string>();
  record.complete = !document.at("expected_cost").is_null();
  if (record.complete) record.expected_cost = document.at("expected_cost").get<double>();
  record.lower_bound = document.at("lower_bound").get<double>();
  record.expansions = document.at("expansions").get<std::int64_t>();
  record.cpu_s = document.at("cpu_s").get<double>();
  record.wall_s = document.at("wall_s").get<double>();
  return record;
}

std::string ToString(BoundKind kind) {
  switch (kind) {
    case BoundKind::kExact: return "exact";
    case BoundKind::kLower: return "lower";
    case BoundKind::kUpper: return "upper";
    case BoundKind::kUnknown: return "unknown";
  }
  return "?";
}

Speedup SpeedupOf(const std::vector<SolveRecord>& base, const std::vector<SolveRecord>& other) {
  assert(base.size() == other.size());
  Speedup speedup;
  if (base.empty()) return speedup;
  double base_cpu = 0.0, other_cpu = 0.0, base_expansions = 0.0, other_expansions = 0.0;
  double log_cpu = 0.0, log_expansions = 0.0;
  bool base_cut = false, other_cut = false;
  for (std::size_t i = 0; i < base.size(); ++i) {
    base_cpu += Cpu(base[i]);
    other_cpu += Cpu(other[i]);
    base_expansions += Expansions(base[i]);
    other_expansions += Expansions(other[i]);
    log_cpu += std::log(Cpu(base[i]) / Cpu(other[i]));
    log_expansions += std::log(Expansions(base[i]) / Expansions(other[i]));
    base_cut |= !base[i].complete;
    other_cut |= !other[i].complete;
  }
  const auto count = static_cast<double>(base.size());
  speedup.cpu = base_cpu / other_cpu;
  speedup.expansions = base_expansions / other_expansions;
  speedup.cpu_geometric = std::exp(log_cpu / count);
  speedup.expansions_geometric = std::exp(log_expansions / count);
  speedup.bound = base_cut && other_cut ? BoundKind::kUnknown
                  : base_cut            ? BoundKind::kLower
                  : other_cut           ? BoundKind::kUpper
                                        : BoundKind::kExact;
  return speedup;
}

RelativeCost RelativeCostOf(const std::vector<SolveRecord>& base, const std::vector<SolveRecord>& other) {
  assert(base.size() == other.size());
  std::vector<double> ratios;
  for (std::size_t i = 0; i < base.size(); ++i) {
    if (base[i].complete && other[i].complete) ratios.push_back(RatioOfCosts(other[i], base[i]));
  }
  return MeanOf(ratios);
}

RelativeCost RelativeCostOfRest(const std::vector<SolveRecord>& reference, const std::vector<SolveRecord>& excluded,
                                const std::vector<SolveRecord>& other) {
  assert(reference.size() == other.size() && excluded.size() == other.size());
  std::vector<double> ratios;
  for (std::size_t i = 0; i < other.size(); ++i) {
    if (other[i].complete && reference[i].complete && !excluded[i].complete) {
      ratios.push_back(RatioOfCosts(other[i], reference[i]));
    }
  }
  return MeanOf(ratios);
}

}  // namespace feeler::evaluation
