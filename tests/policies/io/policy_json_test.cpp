// Laws of the policy file and of row verification:
// - parse(format(f)) = f; policy -> file -> policy evaluates to the same exact cost under the problem;
// - the file has the keys of the format and no other, leaves in indices of the problem's hypotheses;
// - each broken law is one InputError naming the node; mutated files are refused or lawful;
// - VerifyRow accepts optimal policies and finds any changed cost, move, branch or leaf.
#include "feeler/policies/io/policy_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "feeler/core/error.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/policies/storage/verify.h"
#include "tests/policies/brute_force.h"
#include "tests/policies/random_policy.h"

namespace feeler::policies {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(PolicyFile, RoundTripsAndKeepsTheExactCost) {
  for (const bool weighted : {false, true}) {
    const planner::Problem problem = planner::MakeLatticeProblem(SmallProblemData(weighted));
    BruteForce oracle(problem);
    const planner::PolicyGraph policy = oracle.MakePolicy();
    const planner::PolicyEvaluation evaluation = planner::Evaluate(problem, policy);
    ASSERT_EQ(evaluation.fault, "");
    EXPECT_NEAR(evaluation.expected_cost, oracle.Value(), 1e-9);
    const PolicyFile file = ToPolicyFile(problem, policy, "small");
    const std::string text = FormatPolicyFile(file);
    EXPECT_EQ(FormatPolicyFile(ParsePolicyFile(text, "again")), text);
    const planner::PolicyGraph back = ToPolicy(ParsePolicyFile(text, "again"), problem, "again");
    EXPECT_EQ(planner::Evaluate(problem, back).fault, "");
    EXPECT_NEAR(back.expected_cost, policy.expected_cost, 1e-9);
    EXPECT_NEAR(planner::Evaluate(problem, back).expected_cost, policy.expected_cost, 1e-9);
  }
}

TEST(PolicyFile, HasExactlyTheKeysOfTheFormat) {
  const planner::Problem problem = planner::MakeLatticeProblem(SmallProblemData(false));
  const json file = json::parse(FormatPolicyFile(ToPolicyFile(problem, BruteForce(problem).MakePolicy(), "small")));
  ASSERT_EQ(file.size(), 7U);
  EXPECT_EQ(file["task"], "small");
  EXPECT_EQ(file["start"], json::array({0, 6, 0}));
  EXPECT_EQ(file["root"], 0);
  EXPECT_EQ(file["hypotheses"][1], json::array({0, 1, 0}));
  std::vector<int> leaves;
  for (const json& node : file["nodes"]) {
    if (node.contains("hypotheses")) {
      ASSERT_EQ(node.size(), 1U);
      ASSERT_EQ(node["hypotheses"].size(), 1U);
      leaves.push_back(node["hypotheses"][0]);
      continue;
    }
    ASSERT_EQ(node.size(), 2U);
    EXPECT_TRUE(node["move"]["direction"].is_string());
    for (const json& outcome : node["outcomes"]) {
      EXPECT_EQ(outcome.size(), 3U);
      EXPECT_EQ(outcome["contact"].get<bool>(), outcome["cells"].get<int>() < node["move"]["cells"].get<int>());
    }
  }
  EXPECT_THAT(leaves, testing::UnorderedElementsAre(0, 1, 2, 3, 4, 5));
}

json SamplePolicy() {
  return json::parse(R"({"task":"t","start":[0,0,0],"expected_cost":1.5,"lower_bound":1.25,"root":0,
    "hypotheses":[[0,0,0],[1,0,0],[2,0,0]],
    "nodes":[{"move":{"direction":"+x","cells":4},"outcomes":[{"cells":2,"contact":true,"next":1},
                                                             {"cells":4,"contact":false,"next":2}]},
             {"hypotheses":[0]},
             {"move":{"direction":"-z","cells":1},"outcomes":[{"cells":0,"contact":true,"next":3},
                                                             {"cells":1,"contact":false,"next":4}]},
             {"hypotheses":[2]},{"hypotheses":[1]}]})");
}

std::string ErrorOf(const json& file) {
  try {
    ParsePolicyFile(file.dump(), "p.json");
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "accepted " << file.dump();
  return "";
}

TEST(PolicyFile, NamesEachBrokenLaw) {
  ASSERT_NO_THROW(ParsePolicyFile(SamplePolicy().dump(), "p.json"));
  const std::vector<std::pair<const char*, std::function<void(json&)>>> cases = {
      {"p.json: \"task\" is missing", [](json& j) { j.erase("task"); }},
      {"unknown key \"author\"", [](json& j) { j["author"] = 1; }},
      {"root: is 5, not in 0..4", [](json& j) { j["root"] = 5; }},
      {"is never reached",
       [](json& j) {
         j["root"] = 2, j["nodes"][3]["hypotheses"] = {0, 2};
       }},
      {"nodes: has a cycle", [](json& j) { j["nodes"][2]["outcomes"][0]["next"] = 0; }},
      {"nodes[0].move.direction: ", [](json& j) { j["nodes"][0]["move"]["direction"] = "up"; }},
      {"nodes[0].move.cells: is 0", [](json& j) { j["nodes"][0]["move"]["cells"] = 0; }},
      {"outcomes[0].contact: contradicts", [](json& j) { j["nodes"][0]["outcomes"][0]["contact"] = false; }},
      {"outcomes[1].cells: is 5", [](json& j) { j["nodes"][0]["outcomes"][1]["cells"] = 5; }},
      {"outcomes[1].next: is 7", [](json& j) { j["nodes"][0]["outcomes"][1]["next"] = 7; }},
      {"listed already", [](json& j) { j["nodes"][2]["outcomes"][1] = j["nodes"][2]["outcomes"][0]; }},
      {"nodes: has no leaf for hypothesis 2",
       [](json& j) {
         j["hypotheses"].push_back({9, 9, 9});
         j["nodes"][3]["hypotheses"] = {3};
       }},
      {"ends in node", [](json& j) { j["nodes"][3]["hypotheses"] = {1}; }},
      {"nodes[3].hypotheses: has 0 elements", [](json& j) { j["nodes"][3]["hypotheses"] = json::array(); }},
      {"nodes[3].hypotheses[0]: is 3", [](json& j) { j["nodes"][3]["hypotheses"] = {3}; }},
      {"hypotheses[2]: is listed already",
       [](json& j) {
         j["hypotheses"][2] = {0, 0, 0};
       }},
      {"reached on two paths",
       [](json& j) {
         j["nodes"][2]["outcomes"][1]["next"] = 1;
         j["nodes"].erase(4);
         j["nodes"][1]["hypotheses"] = {0, 1};
       }},
      {"lower_bound: is \"x\"", [](json& j) { j["lower_bound"] = "x"; }},
      {"expected_cost: is -1", [](json& j) { j["expected_cost"] = -1; }},
      {"nodes[4]: has the unknown key \"move\"", [](json& j) { j["nodes"][4]["move"] = 1; }},
  };
  for (const auto& [text, breaks] : cases) {
    json broken = SamplePolicy();
    breaks(broken);
    EXPECT_THAT(ErrorOf(broken), HasSubstr(text));
  }
}

TEST(PolicyFile, SurvivesTwentyThousandMutations) {
  const std::string whole = SamplePolicy().dump();
  int accepted = 0;
  for (std::uint64_t episode = 0; episode < 20000; ++episode) {
    RandomStream random(1, episode, "mutation");
    try {
      const PolicyFile file = ParsePolicyFile(Mutate(whole, random), "p.json");
      ASSERT_EQ(FormatPolicyFile(ParsePolicyFile(FormatPolicyFile(file), "again")), FormatPolicyFile(file));
      ++accepted;
    } catch (const InputError&) {
    }
  }
  EXPECT_GT(accepted, 50);
}

TEST(VerifyRow, AcceptsTheOptimumAndFindsEveryChange) {
  const planner::Problem problem = planner::MakeLatticeProblem(SmallProblemData(true));
  StoredProblem row;
  row.policy = BruteForce(problem).MakePolicy();
  row.expected_cost = row.policy->expected_cost;
  row.lower_bound = row.policy->lower_bound;
  EXPECT_EQ(VerifyRow(row, problem).fault, "");
  EXPECT_NEAR(VerifyRow(row, problem).replayed_cost, row.expected_cost, 1e-9);
  const auto inner = [](StoredProblem& r) -> planner::PolicyNode& { return r.policy->nodes[r.policy->root]; };
  const std::vector<std::function<void(StoredProblem&)>> changes = {
      [&](StoredProblem& r) {
        inner(r).expected_cost += 1e-6;
        r.policy->expected_cost = r.expected_cost = inner(r).expected_cost;
      },
      [&](StoredProblem& r) { inner(r).move.direction = Opposite(inner(r).move.direction); },
      [&](StoredProblem& r) {
        for (planner::PolicyNode& node : r.policy->nodes) {
          if (node.is_leaf()) node.leaf[0].offset.x() += 1;
        }
      },
      [&](StoredProblem& r) {
        for (planner::PolicyNode& node : r.policy->nodes) {
          if (node.branches.size() > 1) std::swap(node.branches[0].next, node.branches[1].next);
        }
      },
      [&](StoredProblem& r) {
        for (planner::PolicyNode& node : r.policy->nodes) {
          if (!node.is_leaf() && &node != &inner(r)) {
            node.expected_cost += 1e-6;
            break;
          }
        }
      }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    StoredProblem changed = row;
    changes[i](changed);
    EXPECT_FALSE(VerifyRow(changed, problem).valid()) << "change " << i;
  }
  row.policy.reset();
  EXPECT_TRUE(VerifyRow(row, problem).valid());
}

}  // namespace
}  // namespace feeler::policies
