#include "feeler/policies/storage/meta.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/policies/io/bytes.h"
#include "feeler/policies/storage/file_checks.h"
#include "feeler/policies/storage/hash.h"

namespace feeler::policies {
namespace {

using nlohmann::json;

std::vector<AxisKind> ParseAxes(const std::string& text, const std::string& path) {
  std::vector<AxisKind> axes;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string word = text.substr(at, end - at);
    int kind = 0;
    while (kind < planner::kAxisKinds && ToString(static_cast<AxisKind>(kind)) != word) ++kind;
    if (kind == planner::kAxisKinds) throw Damaged(path, "table meta names an unknown axis");
    axes.push_back(static_cast<AxisKind>(kind));
    at = end + 1;
  }
  return axes;
}

json CostJson(const CostWeights& cost) {
  json per_cell = cost.per_cell;
  if (!cost.one_per_cell()) per_cell = {cost.PerCell(0), cost.PerCell(1), cost.PerCell(2)};
  return {{"per_cell", per_cell}, {"per_contact", cost.per_contact}, {"per_action", cost.per_action}};
}

CostWeights CostFrom(const json& cost) {
  const json& per_cell = cost.at("per_cell");
  if (!per_cell.is_array()) return {per_cell.get<double>(), cost.at("per_contact"), cost.at("per_action")};
  return CostPerAxis(per_cell.get<std::array<double, 3>>(), cost.at("per_contact"), cost.at("per_action"));
}

std::string ShardName(const std::optional<DatabaseShard>& shard) {
  return shard ? fmt::format("shard {} of {}", shard->index, shard->count) : "a whole family";
}

}  // namespace

std::string ShardText(const DatabaseShard& shard) {
  return json{{"index", shard.index},
              {"count", shard.count},
              {"problems", shard.problems},
              {"family", shard.family},
              {"digest", shard.digest}}
      .dump();
}

std::string MetaChecksum(const Meta& meta) {
  ByteWriter out;
  for (const auto& [key, value] : meta) {
    if (key == kMetaChecksum) continue;
    out.Text(key);
    out.Text(value);
  }
  return fmt::format("{:016x}", Hash64(out.bytes()));
}

Meta ReadMeta(const SqliteConnection& connection, const std::string& path) {
  Meta meta;
  SqliteStatement statement(connection, "SELECT key, value FROM meta");
  while (statement.Step()) meta[statement.Text(0)] = statement.Text(1);
  if (meta[kMetaChecksum] != MetaChecksum(meta)) throw Damaged(path, "table meta is altered");
  return meta;
}

void WriteMeta(const SqliteConnection& connection, const Meta& meta) {
  SqliteStatement statement(connection, "INSERT OR REPLACE INTO meta (key, value) VALUES (?, ?)");
  for (const auto& [key, value] : meta) {
    statement.Bind(1, std::string_view(key)).Bind(2, std::string_view(value)).Step();
    statement.Reset();
  }
}

std::string AxesText(const std::vector<AxisKind>& axes) {
  std::string text;
  for (const AxisKind axis : axes) text += (text.empty() ? "" : ",") + std::string(ToString(axis));
  return text;
}

Meta ToMeta(const DatabaseIdentity& identity) {
  const auto settings = ParseJsonText<json>(identity.settings);
  if (!settings.is_object()) throw std::invalid_argument("DatabaseIdentity: settings is not a JSON object");
  return {{"task", identity.task},
          {"fingerprint", identity.fingerprint},
          {"opening", identity.opening},
          {"goal", identity.goal},
          {"cost", CostJson(identity.cost).dump()},
          {"settings", settings.dump()},
          {"created_by", identity.created_by}};
}

DatabaseIdentity FromMeta(const Meta& meta, const std::string& path) {
  try {
    const auto cost = ParseJsonText<json>(meta.at("cost"));
    if (!ParseJsonText<json>(meta.at("settings")).is_object()) throw std::invalid_argument("settings");
    DatabaseIdentity identity{meta.at("task"), meta.at("fingerprint"), meta.at("opening"),   meta.at("goal"),
                              CostFrom(cost),  meta.at("settings"),    meta.at("created_by")};
    const auto axes = meta.find(kMetaAxes);
    if (axes != meta.end()) identity.axes = ParseAxes(axes->second, path);
    const auto shard = meta.find(kMetaShard);
    if (shard != meta.end()) {
      const auto part = ParseJsonText<json>(shard->second);
      identity.shard = {part.at("index"), part.at("count"), part.at("problems"), part.at("family"), part.at("digest")};
    }
    return identity;
  } catch (const std::exception&) {  // a key is missing or is not JSON
    throw Damaged(path, "table meta lacks an entry");
  }
}

void RequireSameIdentity(const Meta& stored, const DatabaseIdentity& identity, const std::string& path) {
  const Meta wanted = ToMeta(identity);
  // The fingerprint covers costs and goal, too: they are named first.
  for (const char* key : {"task", "cost", "opening", "goal", "fingerprint", "settings"}) {
    const std::string& have = stored.at(key);
    const std::string& want = wanted.at(key);
    if (have == want) continue;
    if (std::string_view(key) == "fingerprint") {
      throw InputError(path, "was made for another geometry of task " + identity.task + " (its fingerprint differs)",
                       "write to another file");
    }
    throw InputError(path, fmt::format("was made with another {} ({}, not {})", key, have, want),
                     "use the same settings to continue it, or write to another file");
  }
  const std::optional<DatabaseShard> shard = FromMeta(stored, path).shard;
  if (shard == identity.shard) return;
  if (ShardName(shard) != ShardName(identity.shard)) {
    throw InputError(path, fmt::format("holds {}, not {}", ShardName(shard), ShardName(identity.shard)),
                     "give the same --shard to continue it, or write to another file");
  }
  throw InputError(path, fmt::format("holds {} of another family", ShardName(shard)),
                   "give the same --family to continue it, or write to another file");
}

}  // namespace feeler::policies
