// Laws of noise on the command line: what solve prints brackets one value, a file's noise is the same as the options',
// the exported model has the same optimum; a noise that says nothing, and options that do not go together, are one
// error line.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

const std::string kSlotText = R"({"name": "slot", "size": [6,5,1], "start": [1,4,0], "tool": [[0,0,0]],
 "target": [[0,0,0],[1,0,0],[2,0,0],[3,0,0],[0,1,0],[1,1,0],[3,1,0]], "hypotheses": [[0,0,0,1],[1,0,0,1],[1,1,0,1]],
 "move_lengths": [1,2,4]NOISE})";

std::string Written(const std::string& folder, const std::string& noise) {
  std::string text = kSlotText;
  text.replace(text.find("NOISE"), 5, noise);
  const std::string file = folder + "/problem" + std::to_string(noise.size()) + ".json";
  WriteFile(file, text);
  return file;
}

TEST(NoiseCommands, SolvesWritesAndExports) {
  const std::string folder = ScratchFolder("noise");
  const std::string plain = Written(folder, "");
  const std::string noisy = Written(folder, R"(, "noise": {"missed_contact": 0.05, "false_stop": 0.05, "slip": 0.02})");
  const std::vector<std::string> noise = {"--missed-contact", "0.05", "--false-stop", "0.05", "--slip", "0.02"};
  const std::vector<std::string> more = {"--confidence", "0.6", "--gap", "1.01", "--json"};
  const std::string policy = folder + "/policy.json";
  std::vector<std::string> by_options = {"solve", "--problem", plain, "--out", policy};
  by_options.insert(by_options.end(), noise.begin(), noise.end());
  by_options.insert(by_options.end(), more.begin(), more.end());
  std::vector<std::string> by_file = {"solve", "--problem", noisy};
  by_file.insert(by_file.end(), more.begin(), more.end());
  const CommandResult one = RunFeeler(by_options);
  const CommandResult two = RunFeeler(by_file);
  ASSERT_EQ(one.exit_code, 0) << one.err;
  ASSERT_EQ(two.exit_code, 0) << two.err;
  const auto first = nlohmann::json::parse(one.out);
  const auto second = nlohmann::json::parse(two.out);
  for (const char* key : {"status", "expected_cost", "lower_bound", "policy_nodes", "noise", "right"}) {
    EXPECT_EQ(first[key], second[key]) << key;
  }
  EXPECT_LE(first["ratio"], 1.01 + 1e-4);
  EXPECT_NEAR(first["right"].get<double>() + first["wrong"].get<double>() + first["given_up"].get<double>(), 1.0, 1e-9);
  EXPECT_EQ(nlohmann::json::parse(ReadFile(policy))["expected_cost"], first["expected_cost"]);

  for (const std::string format : {"pomdp", "pomdpx"}) {
    const std::string model = folder + "/model." + format;
    ASSERT_EQ(
        RunFeeler({"export", "--problem", noisy, "--confidence", "0.6", "--format", format, "--out", model}).exit_code,
        0);
    const CommandResult judged = RunFeeler({"solve", "--pomdp", model, "--time-limit", "2", "--json"});
    ASSERT_LE(judged.exit_code, 1) << judged.err;  // with or without a policy by then
    const auto judge = nlohmann::json::parse(judged.out);
    EXPECT_LE(-judge["value_upper"].get<double>(), first["expected_cost"].get<double>() + 1e-6) << format;
    if (judge["value_lower"].is_number()) {
      EXPECT_GE(-judge["value_lower"].get<double>(), first["lower_bound"].get<double>() - 1e-6) << format;
    }
  }
}

TEST(NoiseCommands, WhatSaysNothingOrDoesNotFitIsNamed) {
  const std::string folder = ScratchFolder("noise-errors");
  const std::string plain = Written(folder, "");
  const std::string noisy = Written(folder, R"(, "noise": {"slip": 0.1})");
  const auto solve = [&](const std::string& file, std::vector<std::string> more) {
    more.insert(more.begin(), {"solve", "--problem", file});
    return RunFeeler(more);
  };
  ExpectOneError(solve(plain, {"--missed-contact", "1"}), "missed_contact");
  ExpectOneError(solve(plain, {"--missed-contact", "-0.1"}), "--missed-contact");
  ExpectOneError(solve(plain, {"--false-stop", "1.5"}), "--false-stop");
  ExpectOneError(solve(plain, {"--missed-contact", "0.6", "--false-stop", "0.4"}), "information");
  ExpectOneError(solve(plain, {"--slip", "0.5", "--false-stop", "0.5"}), "never moves");
  ExpectOneError(solve(noisy, {"--confidence", "0.5"}), "confidence");
  ExpectOneError(solve(noisy, {"--confidence", "1.5"}), "--confidence");
  ExpectOneError(solve(noisy, {"--wrong-cost", "0"}), "--wrong-cost");
  ExpectOneError(solve(noisy, {"--heuristic", "lines"}), "--heuristic");
  ExpectOneError(solve(plain, {"--confidence", "0.9"}), "--confidence");
  ExpectOneError(RunFeeler({"export", "--problem", noisy, "--upper-bound", "20"}), "--upper-bound");
  ExpectOneError(RunFeeler({"policy", "graph", "--problem", noisy, "--policy", noisy}), "\"task\" is missing");
}

}  // namespace
}  // namespace feeler::cli
