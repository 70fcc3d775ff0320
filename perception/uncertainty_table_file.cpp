#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/perception/input_file.h"
#include "feeler/perception/uncertainty_table.h"

namespace feeler::perception {
namespace {

constexpr const char* kKind = "feeler uncertainty table";
constexpr std::size_t kMostRules = 1000;

nlohmann::ordered_json RulesJson(const std::vector<UncertaintyRule>& rules) {
  auto list = nlohmann::ordered_json::array();
  for (const UncertaintyRule& rule : rules) {
    nlohmann::ordered_json json = {{"nearest_m", rule.nearest_m}, {"farthest_m", rule.farthest_m}};
    json["bias_m"] = {rule.bias_m.x(), rule.bias_m.y(), rule.bias_m.z()};
    json["half"] = std::vector<double>(rule.half.data(), rule.half.data() + rule.half.size());
    if (rule.deviation.size() > 0) {
      json["deviation"] = std::vector<double>(rule.deviation.data(), rule.deviation.data() + rule.deviation.size());
    }
    json["samples"] = rule.samples;
    list.push_back(json);
  }
  return list;
}

AxisKind KindNamed(const std::string& name, const std::string& where) {
  for (const AxisKind kind : {AxisKind::kX, AxisKind::kY, AxisKind::kZ, AxisKind::kYaw, AxisKind::kPitch}) {
    if (name == ToString(kind)) return kind;
  }
  throw InputError(where, fmt::format("no axis is named '{}'", name.substr(0, 20)), "one of x, y, z, yaw, pitch");
}

const nlohmann::json& ListAt(const nlohmann::json& root, const char* key, std::size_t most, const std::string& where) {
  if (!root.is_object() || !root.contains(key) || !root.at(key).is_array() || root.at(key).empty() ||
      root.at(key).size() > most) {
    throw InputError(where, fmt::format("'{}' is not a list of 1 to {}", key, most), "see docs/file-formats.md");
  }
  return root.at(key);
}

/// One number for each axis, zero to `most`.
Eigen::VectorXd PerAxis(const nlohmann::json& item, const char* key, std::size_t axes, double most,
                        const std::string& where) {
  const nlohmann::json& list = ListAt(item, key, axes, where);
  if (list.size() != axes) {
    throw InputError(where, fmt::format("'{}' has not one number for each axis", key), "see docs/file-formats.md");
  }
  Eigen::VectorXd values(static_cast<Eigen::Index>(axes));
  for (std::size_t i = 0; i < axes; ++i) {
    const double value = list[i].is_number() ? list[i].get<double>() : -1.0;
    if (!(value >= 0.0 && value <= most)) {
      throw InputError(where, fmt::format("'{}' holds what is no extent", key), "see docs/file-formats.md");
    }
    values[static_cast<Eigen::Index>(i)] = value;
  }
  return values;
}

std::vector<UncertaintyRule> ParseRules(const nlohmann::json& root, const char* key, std::size_t axes,
                                        const std::string& where) {
  constexpr double kFarthest_m = 100.0;
  constexpr double kLargestHalf = 10.0;
  std::vector<UncertaintyRule> rules;
  for (const nlohmann::json& item : ListAt(root, key, kMostRules, where)) {
    const std::string inside = fmt::format("{}, {}[{}]", where, key, rules.size());
    UncertaintyRule rule;
    rule.nearest_m = NumberAt(item, "nearest_m", 0.0, kFarthest_m, inside);
    rule.farthest_m = NumberAt(item, "farthest_m", 0.0, kFarthest_m, inside);
    rule.bias_m = VectorAt(item, "bias_m", inside);
    rule.samples = IntegerAt(item, "samples", 0, 1 << 30, inside);
    rule.half = PerAxis(item, "half", axes, kLargestHalf, inside);
    if (item.contains("deviation")) rule.deviation = PerAxis(item, "deviation", axes, kLargestHalf, inside);
    if (!(rule.nearest_m < rule.farthest_m) || (!rules.empty() && rule.nearest_m != rules.back().farthest_m)) {
      throw InputError(inside, "the ranges of distance do not follow each other", "see docs/file-formats.md");
    }
    rules.push_back(rule);
  }
  return rules;
}

}  // namespace

std::string ToJson(const UncertaintyTable& table, const std::string& report_json) {
  nlohmann::ordered_json json;
  json["kind"] = kKind;
  json["version"] = UncertaintyTable::kVersion;
  json["task"] = table.task;
  json["fingerprint"] = table.fingerprint;
  json["axes"] = nlohmann::ordered_json::array();
  for (const UncertainAxis& axis : table.axes) {
    json["axes"].push_back({{"axis", std::string(ToString(axis.kind))},
                            {"resolution", axis.resolution},
                            {"min_cells", axis.min_cells},
                            {"max_cells", axis.max_cells}});
  }
  json["camera_m"] = {table.camera_m.x(), table.camera_m.y(), table.camera_m.z()};
  json["averaged_frames"] = table.averaged_frames;
  json["limits"] = {{"least_fitness", table.limits.least_fitness},
                    {"most_beyond", table.limits.most_beyond},
                    {"most_seen_through", table.limits.most_seen_through},
                    {"most_missing_m2", table.limits.most_missing_m2}};
  json["rules"] = RulesJson(table.rules);
  json["plain_rules"] = RulesJson(table.plain_rules);
  if (!report_json.empty()) json["report"] = ParseJsonText<nlohmann::ordered_json>(report_json);
  return json.dump(2) + "\n";
}

UncertaintyTable ParseTable(std::string_view text, const std::string& where) {
  const nlohmann::json root = ParseJson(text, where);
  if (!root.is_object() || root.value("kind", nlohmann::json()) != kKind) {
    throw InputError(where, "is not an uncertainty table", "make one with feeler perceive calibrate");
  }
  const int version = IntegerAt(root, "version", 0, 1 << 30, where);
  if (version != UncertaintyTable::kVersion) {
    throw InputError(where, fmt::format("is of version {}, this program reads {}", version, UncertaintyTable::kVersion),
                     "make it anew with feeler perceive calibrate");
  }
  UncertaintyTable table;
  table.task = TextAt(root, "task", where);
  table.fingerprint = TextAt(root, "fingerprint", where);
  constexpr std::size_t kMostAxes = 5;
  for (const nlohmann::json& item : ListAt(root, "axes", kMostAxes, where)) {
    UncertainAxis axis;
    axis.kind = KindNamed(TextAt(item, "axis", where), where);
    axis.resolution = NumberAt(item, "resolution", 1e-6, 10.0, where);
    axis.min_cells = IntegerAt(item, "min_cells", 1, 64, where);
    axis.max_cells = IntegerAt(item, "max_cells", axis.min_cells, 64, where);
    table.axes.push_back(axis);
  }
  table.camera_m = VectorAt(root, "camera_m", where);
  table.averaged_frames = IntegerAt(root, "averaged_frames", 1, 100000, where);
  if (root.contains("limits")) {
    const nlohmann::json& limits = root.at("limits");
    const std::string inside = where + ", limits";
    table.limits.least_fitness = NumberAt(limits, "least_fitness", 0.0, 1.0, inside);
    table.limits.most_beyond = NumberAt(limits, "most_beyond", 0.0, 1.0, inside);
    table.limits.most_seen_through = NumberAt(limits, "most_seen_through", 0.0, 1.0, inside);
    table.limits.most_missing_m2 = NumberAt(limits, "most_missing_m2", 0.0, 100.0, inside);
  }
  table.rules = ParseRules(root, "rules", table.axes.size(), where);
  table.plain_rules = ParseRules(root, "plain_rules", table.axes.size(), where);
  return table;
}

}  // namespace feeler::perception
