#include "feeler/policies/io/noisy_policy_json.h"

#include <nlohmann/json.hpp>

#include "feeler/policies/io/json_input.h"

namespace feeler::policies {
namespace {

using nlohmann::json;

json NodeJson(const planner::NoisyPolicy::Node& node) {
  if (node.ends()) {
    if (node.declared.empty()) return {{"gives_up", true}};
    return {{"declares", node.declared}, {"confidence", node.confidence}};
  }
  json outcomes = json::array();
  for (const planner::NoisyPolicy::Branch& branch : node.branches) {
    outcomes.push_back({{"cells", branch.outcome.cells},
                        {"contact", branch.outcome.contact},
                        {"probability", branch.probability},
                        {"next", branch.next}});
  }
  return {{"move", {{"direction", std::string(ToString(node.move.direction))}, {"cells", node.move.cells}}},
          {"outcomes", outcomes}};
}

}  // namespace

std::string FormatNoisyPolicy(const planner::NoisyProblem& noisy, const planner::NoisyResult& result,
                              const std::string& task) {
  json hypotheses = json::array();
  for (const planner::Hypothesis& h : noisy.problem.hypotheses) {
    hypotheses.push_back({h.offset.x(), h.offset.y(), h.offset.z(), h.orientation});
  }
  std::string text = json{{"task", task},
                          {"start", CellJson(noisy.problem.start)},
                          {"noise",
                           {{"missed_contact", noisy.noise.missed_contact},
                            {"false_stop", noisy.noise.false_stop},
                            {"slip", noisy.noise.slip}}},
                          {"confidence", noisy.declaration.confidence},
                          {"wrong_cost", noisy.WrongCost()},
                          {"expected_cost", result.evaluation.expected_cost},
                          {"lower_bound", result.lower_bound},
                          {"hypotheses", hypotheses},
                          {"root", result.policy.root}}
                         .dump();
  text.pop_back();
  text += ",\"nodes\":[";
  for (std::size_t n = 0; n < result.policy.nodes.size(); ++n) {
    text += (n == 0 ? "\n" : ",\n") + NodeJson(result.policy.nodes[n]).dump();
  }
  return text + "\n]}\n";
}

}  // namespace feeler::policies
