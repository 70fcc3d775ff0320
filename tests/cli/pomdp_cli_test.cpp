// Laws of general POMDPs on the command line: what solve prints brackets the value and what it writes is worth it;
// options of the wrong kind of problem and files of other models are one error line.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

TEST(PomdpCommands, SolveWriteSimulate) {
  const std::string folder = ScratchFolder("pomdp");
  const std::string model = folder + "/rocks.pomdp";
  ASSERT_EQ(RunFeeler({"export", "--rock-sample", "3x2", "--seed", "4", "--out", model}).exit_code, 0);
  for (const std::string extension : {".json", ".alpha", ".policyx"}) {
    const std::string policy = folder + "/policy" + extension;
    const CommandResult solved = RunFeeler({"solve", "--pomdp", model, "--out", policy, "--json"});
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
    const auto result = nlohmann::json::parse(solved.out);
    const double lower = result["value_lower"];
    const double upper = result["value_upper"];
    EXPECT_EQ(result["status"], "converged");
    EXPECT_GE(upper, lower);
    EXPECT_LE(upper - lower, 1e-3 + 1e-12);
    const CommandResult simulated =
        RunFeeler({"policy", "simulate", "--pomdp", model, "--policy", policy, "--episodes", "3000", "--json"});
    ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
    const auto episodes = nlohmann::json::parse(simulated.out);
    EXPECT_EQ(episodes["episodes"], 3000);
    EXPECT_NEAR(episodes["mean"], lower, 2.0 * episodes["half_width"].get<double>());
  }
}

TEST(PomdpCommands, WhatDoesNotFitIsNamed) {
  const std::string folder = ScratchFolder("pomdp-errors");
  const std::string model = folder + "/rocks.pomdp";
  const std::string other = folder + "/other.pomdp";
  const std::string policy = folder + "/policy.json";
  ASSERT_EQ(RunFeeler({"export", "--rock-sample", "2x1", "--out", model}).exit_code, 0);
  ASSERT_EQ(RunFeeler({"export", "--rock-sample", "2x2", "--out", other}).exit_code, 0);
  ASSERT_EQ(RunFeeler({"solve", "--pomdp", other, "--out", policy}).exit_code, 0);
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--gap", "1.1"}), "--gap");
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--solver", "magic"}), "magic");
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--precision", "0"}), "--precision");
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--time-limit", "0"}), "--time-limit");
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--levels", "9"}), "--levels");
  ExpectOneError(RunFeeler({"solve", "--pomdp", folder + "/none.pomdp"}), "none.pomdp");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--precision", "1"}), "--precision");
  ExpectOneError(RunFeeler({"export", "--rock-sample", "banana"}), "banana");
  ExpectOneError(RunFeeler({"export", "--rock-sample", "60x30"}), "states");
  ExpectOneError(RunFeeler({"export", "--rock-sample", "-3x2"}), "give size and rocks");
  for (const std::string option : {"--discount", "--upper-bound", "--missed-contact"}) {
    ExpectOneError(RunFeeler({"export", "--rock-sample", "3x2", option, option == "--missed-contact" ? "0.1" : "0.9"}),
                   option);
  }
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--opening", "open"}), "--opening");
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--jobs", "2"}), "--jobs");
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--prior", policy}), "--prior");
  ExpectOneError(RunFeeler({"solve", "--pomdp", model, "--out", folder + "/policy.txt"}), "policy.txt");
  ExpectOneError(RunFeeler({"policy", "simulate", "--pomdp", model, "--policy", policy + "x"}), "policy.jsonx");
  ExpectOneError(RunFeeler({"policy", "simulate", "--pomdp", model, "--policy", policy, "--episodes", "0"}),
                 "--episodes");
}

TEST(PomdpCommands, SimulateSaysWhatWasCutShort) {
  const std::string folder = ScratchFolder("pomdp-cut");
  const std::string model = folder + "/rocks.pomdp";
  const std::string policy = folder + "/policy.json";
  ASSERT_EQ(RunFeeler({"export", "--rock-sample", "2x1", "--out", model}).exit_code, 0);
  ASSERT_EQ(RunFeeler({"solve", "--pomdp", model, "--out", policy}).exit_code, 0);
  const std::vector<std::string> simulate = {"policy", "simulate", "--pomdp", model, "--policy", policy, "--episodes"};
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> all = simulate;
    all.insert(all.end(), more.begin(), more.end());
    return RunFeeler(all).out;
  };
  EXPECT_NE(with({"50"}).find("(95 %)"), std::string::npos);
  EXPECT_EQ(with({"50"}).find("cut short"), std::string::npos);
  EXPECT_NE(with({"50", "--max-steps", "1"}).find("cut short      "), std::string::npos);
  EXPECT_EQ(with({"50", "--max-steps", "1"}).find("(95 %)"), std::string::npos);
  EXPECT_EQ(with({"1"}).find("+-"), std::string::npos);
}

}  // namespace
}  // namespace feeler::cli
