#include "feeler/policies/io/policy_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "feeler/core/error.h"
#include "feeler/policies/io/json_input.h"
#include "feeler/policies/io/policy_check.h"

namespace feeler::policies {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxPolicyHypotheses = std::size_t{1} << 20;

json NodeJson(const PolicyFileNode& node) {
  if (node.is_leaf()) return json{{"hypotheses", node.hypotheses}};
  json outcomes = json::array();
  for (const PolicyFileNode::Branch& branch : node.outcomes) {
    outcomes.push_back({{"cells", branch.outcome.cells}, {"contact", branch.outcome.contact}, {"next", branch.next}});
  }
  const json move = {{"direction", ToString(node.move.direction)}, {"cells", node.move.cells}};
  return {{"move", move}, {"outcomes", outcomes}};
}

PolicyFileNode ReadNode(const JsonField& field, int node_count, int hypothesis_count) {
  PolicyFileNode node;
  if (field.Has("hypotheses")) {
    field.RequireKeys({"hypotheses"});
    const JsonField list = field["hypotheses"];
    const std::size_t count = list.ListSize(1, static_cast<std::size_t>(hypothesis_count));
    for (std::size_t i = 0; i < count; ++i) node.hypotheses.push_back(list[i].Integer(0, hypothesis_count - 1));
    return node;
  }
  field.RequireKeys({"move", "outcomes"});
  const JsonField move = field["move"];
  move.RequireKeys({"direction", "cells"});
  const auto direction = ParseDirection(move["direction"].Text());
  if (!direction) move["direction"].Fail("is not one of +x -x +y -y +z -z", "choose one of them");
  node.move = {*direction, move["cells"].Integer(1, kMaxMoveCells)};
  const JsonField outcomes = field["outcomes"];
  const std::size_t count = outcomes.ListSize(1, static_cast<std::size_t>(node.move.cells) + 1);
  std::set<int> seen;
  for (std::size_t i = 0; i < count; ++i) {
    const JsonField item = outcomes[i];
    item.RequireKeys({"cells", "contact", "next"});
    PolicyFileNode::Branch branch;
    branch.outcome = {item["cells"].Integer(0, node.move.cells), item["contact"].Boolean()};
    branch.next = item["next"].Integer(0, node_count - 1);
    if (branch.outcome.contact != (branch.outcome.cells < node.move.cells)) {
      item["contact"].Fail("contradicts the distance", "contact is true exactly when fewer cells were travelled");
    }
    if (!seen.insert(branch.outcome.cells).second) item["cells"].Fail("is an outcome listed already", "remove one");
    node.outcomes.push_back(branch);
  }
  return node;
}

/// Every node is reached, there is no cycle, and every hypothesis ends in exactly one leaf, on exactly one path.
void CheckPaths(const PolicyFile& file, const JsonField& nodes) {
  planner::PolicyGraph graph;  // only its edges
  graph.nodes.resize(file.nodes.size());
  for (std::size_t i = 0; i < file.nodes.size(); ++i) {
    for (const PolicyFileNode::Branch& branch : file.nodes[i].outcomes) {
      graph.nodes[i].branches.push_back({branch.outcome, static_cast<std::uint32_t>(branch.next), Cell::Zero(), 0.0});
    }
  }
  const auto order = ChildrenFirst(graph);
  if (!order) nodes.Fail("has a cycle", "let every branch end in a leaf");
  std::vector<int> paths(file.nodes.size(), 0);
  paths[static_cast<std::size_t>(file.root)] = 1;
  std::vector<int> leaf_of(file.hypotheses.size(), -1);
  for (auto it = order->rbegin(); it != order->rend(); ++it) {
    const PolicyFileNode& node = file.nodes[*it];
    if (paths[*it] == 0) nodes[*it].Fail("is never reached from the root", "remove it");
    for (const PolicyFileNode::Branch& branch : node.outcomes) {
      int& count = paths[static_cast<std::size_t>(branch.next)];
      count = std::min(2, count + paths[*it]);
    }
    if (node.is_leaf() && paths[*it] > 1) nodes[*it].Fail("is a leaf reached on two paths", "give each path its leaf");
    for (const int hypothesis : node.hypotheses) {
      int& leaf = leaf_of[static_cast<std::size_t>(hypothesis)];
      if (leaf >= 0)
        nodes[*it].Fail(fmt::format("lists hypothesis {}, which ends in node {} too", hypothesis, leaf),
                        "list each once");
      leaf = static_cast<int>(*it);
    }
  }
  const auto lost = std::find(leaf_of.begin(), leaf_of.end(), -1);
  if (lost != leaf_of.end())
    nodes.Fail(fmt::format("has no leaf for hypothesis {}", lost - leaf_of.begin()), "add it to a leaf");
}

}  // namespace

PolicyFile ToPolicyFile(const planner::Problem& problem, const planner::PolicyGraph& policy, const std::string& task) {
  const planner::ExpandedPolicy expanded = planner::ExpandPolicy(problem, policy);
  PolicyFile file;
  file.task = task;
  file.start = problem.start;
  file.expected_cost = expanded.expected_cost;
  file.lower_bound = expanded.lower_bound;
  bool oriented = false;
  for (const planner::Hypothesis& h : problem.hypotheses) {
    file.hypotheses.push_back(h.offset);
    file.orientations.push_back(h.orientation);
    oriented |= h.orientation != 0;
  }
  if (!oriented) file.orientations.clear();
  for (const planner::ExpandedNode& expanded_node : expanded.nodes) {
    PolicyFileNode node;
    if (expanded_node.is_leaf()) {
      node.hypotheses = expanded_node.hypotheses;
    } else {
      node.move = expanded_node.move;
      for (const planner::ExpandedBranch& branch : expanded_node.outcomes) {
        node.outcomes.push_back({branch.outcome, branch.next});
      }
    }
    file.nodes.push_back(std::move(node));
  }
  return file;
}

planner::PolicyGraph ToPolicy(const PolicyFile& file, const planner::Problem& problem, const std::string& where) {
  const auto differs = [&](const char* what) {
    return InputError(where, fmt::format("the {} is not that of the problem", what),
                      "give the problem it was made for");
  };
  if (file.start != problem.start) throw differs("start");
  if (file.hypotheses.size() != problem.hypotheses.size()) throw differs("number of hypotheses");
  double total_weight = 0.0;
  for (std::size_t i = 0; i < file.hypotheses.size(); ++i) {
    const int orientation = file.orientations.empty() ? 0 : file.orientations[i];
    const planner::Hypothesis& h = problem.hypotheses[i];
    if (file.hypotheses[i] != h.offset || orientation != h.orientation) throw differs("list of hypotheses");
    total_weight += h.weight;
  }
  planner::PolicyGraph policy;
  policy.root = static_cast<std::uint32_t>(file.root);
  policy.nodes.resize(file.nodes.size());
  for (std::size_t i = 0; i < file.nodes.size(); ++i) {
    const PolicyFileNode& node = file.nodes[i];
    if (!node.is_leaf()) policy.nodes[i].move = node.move;
    for (const int h : node.hypotheses) {
      const planner::Hypothesis& hypothesis = problem.hypotheses[static_cast<std::size_t>(h)];
      policy.nodes[i].leaf.push_back({hypothesis.offset, hypothesis.orientation});
    }
    for (const PolicyFileNode::Branch& branch : node.outcomes) {
      policy.nodes[i].branches.push_back({branch.outcome, static_cast<std::uint32_t>(branch.next), Cell::Zero(), 0.0});
    }
  }
  std::vector<double> weight(file.nodes.size(), 0.0);
  const auto order = ChildrenFirst(policy);
  if (!order) throw InputError(where, "the policy has a cycle", "make it again");
  for (const std::uint32_t i : *order) {
    planner::PolicyNode& node = policy.nodes[i];
    for (const int h : file.nodes[i].hypotheses) {
      weight[i] += problem.hypotheses[static_cast<std::size_t>(h)].weight / total_weight;
    }
    for (const planner::PolicyBranch& branch : node.branches) weight[i] += weight[branch.next];
    for (planner::PolicyBranch& branch : node.branches) {
      branch.probability = weight[branch.next] / weight[i];
      node.expected_cost += branch.probability * (problem.cost.Of(branch.outcome, node.move.direction) +
                                                  policy.nodes[branch.next].expected_cost);
    }
  }
  policy.expected_cost = policy.nodes[policy.root].expected_cost;
  policy.lower_bound = std::min(file.lower_bound, policy.expected_cost);
  return policy;
}

std::string FormatPolicyFile(const PolicyFile& file) {
  std::string text = "{\n";
  const auto add = [&](const char* key, const json& value) {
    text += fmt::format(" \"{}\": {},\n", key, value.dump(-1, ' ', false, json::error_handler_t::replace));
  };
  add("task", file.task);
  add("start", CellJson(file.start));
  add("expected_cost", file.expected_cost);
  add("lower_bound", file.lower_bound);
  json hypotheses = json::array();
  for (std::size_t i = 0; i < file.hypotheses.size(); ++i) {
    hypotheses.push_back(CellJson(file.hypotheses[i]));
    if (!file.orientations.empty()) hypotheses.back().push_back(file.orientations[i]);
  }
  add("hypotheses", hypotheses);
  add("root", file.root);
  text += " \"nodes\": [\n";
  for (std::size_t i = 0; i < file.nodes.size(); ++i) {
    text += "  " + NodeJson(file.nodes[i]).dump() + (i + 1 < file.nodes.size() ? ",\n" : "\n");
  }
  return text + " ]\n}\n";
}

PolicyFile ParsePolicyFile(std::string_view text, const std::string& where) {
  const json parsed = ParseJson(text, where);
  const JsonField document(parsed, where);
  document.RequireKeys({"task", "start", "expected_cost", "lower_bound", "hypotheses", "root", "nodes"});
  PolicyFile file;
  file.task = document["task"].Text();
  file.start = document["start"].AsCell(-kMaxPolicyOffset, kMaxPolicyOffset);
  file.expected_cost = document["expected_cost"].Number(0.0);
  file.lower_bound = document["lower_bound"].Number(0.0);
  const JsonField hypotheses = document["hypotheses"];
  const std::size_t hypothesis_count = hypotheses.ListSize(1, kMaxPolicyHypotheses);
  std::set<std::tuple<int, int, int, int>> seen;
  bool oriented = false;
  for (std::size_t i = 0; i < hypothesis_count; ++i) {
    const JsonField item = hypotheses[i];
    const std::size_t length = item.ListSize(3, 4);
    const auto number = [&](std::size_t axis) { return item[axis].Integer(-kMaxPolicyOffset, kMaxPolicyOffset); };
    const Cell offset(number(0), number(1), number(2));
    const int orientation = length == 4 ? item[3].Integer(0, kMaxPolicyOffset) : 0;
    oriented |= length == 4;
    if (!seen.emplace(offset.x(), offset.y(), offset.z(), orientation).second)
      item.Fail("is listed already", "remove one");
    file.hypotheses.push_back(offset);
    file.orientations.push_back(orientation);
  }
  if (!oriented) file.orientations.clear();
  const JsonField nodes = document["nodes"];
  const auto node_count = static_cast<int>(nodes.ListSize(1, kMaxPolicyNodes));
  file.root = document["root"].Integer(0, node_count - 1);
  for (std::size_t i = 0; i < static_cast<std::size_t>(node_count); ++i) {
    file.nodes.push_back(ReadNode(nodes[i], node_count, static_cast<int>(hypothesis_count)));
  }
  CheckPaths(file, nodes);
  return file;
}

PolicyFile ReadPolicyFile(const std::string& path) { return ParsePolicyFile(ReadTextFile(path), path); }

}  // namespace feeler::policies
