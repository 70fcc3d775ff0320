#include "feeler/policies/io/controller_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "feeler/core/error.h"
#include "feeler/policies/io/json_input.h"

namespace feeler::policies {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxNodes = 10'000'000;

std::map<std::string, std::uint32_t> Numbers(const std::vector<std::string>& names) {
  std::map<std::string, std::uint32_t> numbers;
  for (std::size_t i = 0; i < names.size(); ++i) numbers.emplace(names[i], static_cast<std::uint32_t>(i));
  return numbers;
}

}  // namespace

std::string FormatController(const planner::Pomdp& pomdp, const planner::PomdpController& controller, double value) {
  std::string text = json{{"pomdp", pomdp.name}, {"value", value}, {"root", controller.root}}.dump();
  text.pop_back();
  text += ",\"nodes\":[";
  for (std::size_t i = 0; i < controller.nodes.size(); ++i) {
    const planner::PomdpController::Node& node = controller.nodes[i];
    json next = json::object();
    for (const auto& branch : node.branches) next[pomdp.observations[branch.observation]] = branch.next;
    text += (i == 0 ? "\n" : ",\n") +
            json{{"action", pomdp.actions[node.action]}, {"next", next}, {"otherwise", node.otherwise}}.dump();
  }
  return text + "\n]}\n";
}

planner::PomdpController ParseController(std::string_view text, const std::string& where, const planner::Pomdp& pomdp) {
  const json document = ParseJson(text, where);
  const JsonField file(document, where);
  file.RequireKeys({"root", "nodes"}, {"pomdp", "value"});
  const JsonField nodes = file["nodes"];
  const std::size_t count = nodes.ListSize(1, kMaxNodes);
  const int last = static_cast<int>(count) - 1;
  const auto actions = Numbers(pomdp.actions);
  const auto observations = Numbers(pomdp.observations);
  planner::PomdpController controller;
  controller.root = static_cast<std::uint32_t>(file["root"].Integer(0, last));
  for (std::size_t i = 0; i < count; ++i) {
    const JsonField field = nodes[i];
    field.RequireKeys({"action", "next", "otherwise"});
    planner::PomdpController::Node node;
    const auto action = actions.find(field["action"].Text());
    if (action == actions.end()) field["action"].Fail("unknown action", "is the policy of another model?");
    node.action = action->second;
    node.otherwise = static_cast<std::uint32_t>(field["otherwise"].Integer(0, last));
    const json& next = document["nodes"][i]["next"];
    if (!next.is_object()) field["next"].Fail("is no object", "give a node for each observation");
    for (const auto& [name, number] : next.items()) {
      const auto observation = observations.find(name);
      if (observation == observations.end()) {
        field["next"].Fail(fmt::format("unknown observation \"{}\"", name), "is the policy of another model?");
      }
      const auto node_number = static_cast<std::uint32_t>(field["next"][name.c_str()].Integer(0, last));
      node.branches.push_back({observation->second, node_number});
    }
    std::ranges::sort(node.branches, {}, &planner::PomdpController::Branch::observation);
    controller.nodes.push_back(std::move(node));
  }
  return controller;
}

}  // namespace feeler::policies
