#include "feeler/policies/io/lattice_problem_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <tuple>

#include "feeler/policies/io/json_input.h"

namespace feeler::policies {
namespace {

using nlohmann::json;
using planner::Hypothesis;
using planner::LatticeProblemData;

constexpr int kMaxSize = 1 << 16;
constexpr int kMaxCoordinate = 1 << 16;
constexpr int kMaxMoveLength = 1024;
constexpr std::int64_t kMaxDisplacements = std::int64_t{1} << 26;
constexpr std::size_t kMaxCells = std::size_t{1} << 22;
/// Pairs of tool and target cell, each of which blocks a displacement.
constexpr std::size_t kMaxCellPairs = std::size_t{1} << 30;
constexpr std::size_t kMaxHypotheses = std::size_t{1} << 20;
/// Pairs of tool cell and hypothesis up to which a blocked start is looked for here (the planner looks again).
constexpr std::size_t kMaxStartChecks = std::size_t{1} << 27;

using Key = std::tuple<int, int, int>;
Key KeyOf(const Cell& c) { return {c.x(), c.y(), c.z()}; }

std::vector<Cell> ReadCells(const JsonField& list) {
  const std::size_t count = list.ListSize(1, kMaxCells);
  std::vector<Cell> cells;
  cells.reserve(count);
  for (std::size_t i = 0; i < count; ++i) cells.push_back(list[i].AsCell(-kMaxCoordinate, kMaxCoordinate));
  return cells;
}

std::vector<Hypothesis> ReadHypotheses(const JsonField& list) {
  const std::size_t count = list.ListSize(1, kMaxHypotheses);
  std::vector<Hypothesis> hypotheses;
  std::vector<std::pair<Key, std::size_t>> seen;
  for (std::size_t i = 0; i < count; ++i) {
    const JsonField item = list[i];
    item.ListSize(4, 4);
    Hypothesis hypothesis;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      hypothesis.offset[static_cast<Eigen::Index>(axis)] = item[axis].Integer(-kMaxCoordinate, kMaxCoordinate);
    }
    const JsonField weight = item[3];
    hypothesis.weight = weight.Number(0.0);
    if (hypothesis.weight == 0.0) weight.Fail("is 0, not a positive weight", "leave the hypothesis out");
    seen.emplace_back(KeyOf(hypothesis.offset), i);
    hypotheses.push_back(hypothesis);
  }
  std::sort(seen.begin(), seen.end());
  for (std::size_t i = 1; i < seen.size(); ++i) {
    if (seen[i].first != seen[i - 1].first) continue;
    list[seen[i].second].Fail(fmt::format("is the same hypothesis as hypotheses[{}]", seen[i - 1].second),
                              "leave one out and add their weights");
  }
  return hypotheses;
}

std::vector<int> ReadMoveLengths(const JsonField& list) {
  const std::size_t count = list.ListSize(1, kMaxMoveLength);
  std::vector<int> lengths;
  for (std::size_t i = 0; i < count; ++i) {
    lengths.push_back(list[i].Integer(1, kMaxMoveLength));
    if (i > 0 && lengths[i] <= lengths[i - 1]) list[i].Fail("is not greater than the length before it", "sort them");
  }
  return lengths;
}

CostWeights ReadCost(const JsonField& object) {
  object.RequireKeys({}, {"per_cell", "per_contact", "per_action"});
  CostWeights cost;
  if (object.Has("per_contact")) cost.per_contact = object["per_contact"].Number(0.0);
  if (object.Has("per_action")) cost.per_action = object["per_action"].Number(0.0);
  if (object.Has("per_cell") && object["per_cell"].IsList()) {
    const JsonField list = object["per_cell"];
    list.ListSize(3, 3);
    std::array<double, 3> per_cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) per_cell[axis] = list[axis].Number(0.0);
    cost = CostPerAxis(per_cell, cost.per_contact, cost.per_action);
  } else if (object.Has("per_cell")) {
    cost.per_cell = object["per_cell"].Number(0.0);
  }
  if (cost.per_cell + cost.per_action <= 0.0) object.Fail("makes moves free", "set per_cell or per_action above 0");
  return cost;
}

planner::Noise ReadNoise(const JsonField& object, const std::string& where) {
  object.RequireKeys({}, {"missed_contact", "false_stop", "slip"});
  planner::Noise noise;
  if (object.Has("missed_contact")) noise.missed_contact = object["missed_contact"].Number(0.0);
  if (object.Has("false_stop")) noise.false_stop = object["false_stop"].Number(0.0);
  if (object.Has("slip")) noise.slip = object["slip"].Number(0.0);
  planner::Validate(noise, where + ", noise");
  return noise;
}

void CheckStart(const LatticeProblemData& data, const JsonField& document) {
  const JsonField start = document["start"];
  for (int axis = 0; axis < 3; ++axis) {
    if (data.start[axis] < data.size[axis]) continue;
    start[static_cast<std::size_t>(axis)].Fail(
        fmt::format("is {}, outside the workspace of {} cells", data.start[axis], data.size[axis]),
        "give a cell inside, from 0 to size - 1");
  }
  if (data.tool.size() > kMaxStartChecks / data.hypotheses.size()) return;
  std::vector<Key> target;
  target.reserve(data.target.size());
  for (const Cell& cell : data.target) target.push_back(KeyOf(cell));
  std::sort(target.begin(), target.end());
  for (std::size_t i = 0; i < data.hypotheses.size(); ++i) {
    for (const Cell& cell : data.tool) {
      if (!std::binary_search(target.begin(), target.end(), KeyOf(cell + data.start - data.hypotheses[i].offset))) {
        continue;
      }
      start.Fail(fmt::format("is blocked: the tool overlaps the target of hypotheses[{}]", i),
                 "start where every hypothesis is free");
    }
  }
}

/// The contact map covers every r - h: so many displacements must fit in memory.
void CheckDisplacements(const LatticeProblemData& data, const JsonField& document) {
  std::int64_t displacements = 1;
  for (int axis = 0; axis < 3; ++axis) {
    int low = kMaxCoordinate, high = -kMaxCoordinate;
    for (const Hypothesis& h : data.hypotheses) {
      low = std::min(low, h.offset[axis]);
      high = std::max(high, h.offset[axis]);
    }
    displacements *= std::int64_t{data.size[axis]} + high - low;
  }
  if (displacements <= kMaxDisplacements) return;
  document["size"].Fail(fmt::format("and the spread of the hypotheses give {} displacements, more than {}",
                                    displacements, kMaxDisplacements),
                        "use a smaller workspace or larger cells");
}

template <typename Items, typename ToJson>
std::string FormatList(const Items& items, const ToJson& to_json) {
  std::string text = "[";
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) text += i % 8 == 0 ? ",\n  " : ",";
    text += to_json(items[i]).dump();
  }
  return text + "]";
}

}  // namespace

LatticeProblemData ParseLatticeProblem(std::string_view text, const std::string& where) {
  const json parsed = ParseJson(text, where);
  const JsonField document(parsed, where);
  document.RequireKeys({"name", "size", "start", "tool", "target", "hypotheses"},
                       {"move_lengths", "cost", "goal", "insertable_spread", "noise"});
  LatticeProblemData data;
  data.name = document["name"].Text();
  data.size = document["size"].AsCell(1, kMaxSize);
  data.start = document["start"].AsCell(0, kMaxSize);
  data.tool = ReadCells(document["tool"]);
  data.target = ReadCells(document["target"]);
  if (data.tool.size() > kMaxCellPairs / data.target.size()) {
    document["tool"].Fail("and target have too many cells together", "use larger cells, or the surface cells only");
  }
  data.hypotheses = ReadHypotheses(document["hypotheses"]);
  if (document.Has("move_lengths")) data.move_lengths = ReadMoveLengths(document["move_lengths"]);
  if (document.Has("cost")) data.cost = ReadCost(document["cost"]);
  if (document.Has("goal")) {
    const JsonField goal = document["goal"];
    const std::string kind = goal.Text();
    if (kind != "singleton" && kind != "insertable")
      goal.Fail("is neither \"singleton\" nor \"insertable\"", "choose one of them");
    data.goal = kind == "singleton" ? GoalKind::kSingleton : GoalKind::kInsertable;
  }
  if (document.Has("insertable_spread")) {
    const JsonField spread = document["insertable_spread"];
    if (data.goal != GoalKind::kInsertable) spread.Fail("has no meaning without goal \"insertable\"", "remove it");
    data.insertable_spread = spread.AsCell(0, kMaxCoordinate);
  }
  if (document.Has("noise")) data.noise = ReadNoise(document["noise"], where);
  CheckDisplacements(data, document);
  CheckStart(data, document);
  return data;
}

LatticeProblemData ReadLatticeProblem(const std::string& path) { return ParseLatticeProblem(ReadTextFile(path), path); }

std::string FormatLatticeProblem(const LatticeProblemData& data) {
  std::string text = "{\n";
  const auto add = [&](const char* key, const std::string& value) {
    if (text.size() > 2) text += ",\n";
    text += fmt::format(" \"{}\": {}", key, value);
  };
  add("name", json(data.name).dump(-1, ' ', false, json::error_handler_t::replace));
  add("size", CellJson(data.size).dump());
  add("start", CellJson(data.start).dump());
  add("tool", FormatList(data.tool, CellJson));
  add("target", FormatList(data.target, CellJson));
  add("hypotheses", FormatList(data.hypotheses, [](const Hypothesis& h) {
        return json::array({h.offset.x(), h.offset.y(), h.offset.z(), h.weight});
      }));
  add("move_lengths", json(data.move_lengths).dump());
  json per_cell = data.cost.per_cell;
  if (!data.cost.one_per_cell()) per_cell = {data.cost.PerCell(0), data.cost.PerCell(1), data.cost.PerCell(2)};
  add("cost", json{{"per_cell", per_cell}, {"per_contact", data.cost.per_contact}, {"per_action", data.cost.per_action}}
                  .dump());
  if (data.goal == GoalKind::kInsertable) {
    add("goal", "\"insertable\"");
    add("insertable_spread", CellJson(data.insertable_spread).dump());
  }
  if (data.noise.any()) {
    add("noise", json{{"missed_contact", data.noise.missed_contact},
                      {"false_stop", data.noise.false_stop},
                      {"slip", data.noise.slip}}
                     .dump());
  }
  return text + "\n}\n";
}

}  // namespace feeler::policies
