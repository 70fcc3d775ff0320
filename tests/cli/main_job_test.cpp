// Laws of the main job, through the command line: a database that was killed while it was built and continued, or built
// with more threads, has the same content as one built in one go; its policies verify; records depend on the seed
// alone, not on threads, on the number of episodes, or on whether the environment tells the truth to anyone.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

using Json = nlohmann::json;

constexpr const char* kWholeFamily = "2..6x2..6x2..6";

std::vector<std::string> Preprocess(const std::string& file, const std::string& jobs) {
  return {"preprocess", "--task", "plug", "--out", file, "--family", kWholeFamily, "--jobs", jobs};
}

Json Info(const std::string& file) {
  const CommandResult result = RunFeeler({"db", "info", file, "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return Json::parse(result.out);
}

const std::string& Database() {
  static const std::string path = [] {
    const std::string file = ScratchFolder("main_job") + "/plug.db";
    const CommandResult result = RunFeeler(Preprocess(file, "2"));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return file;
  }();
  return path;
}

TEST(Preprocess, SolvesTheFamilyAndVerifies) {
  const Json info = Info(Database());
  EXPECT_EQ(info.at("problems"), 125);
  EXPECT_EQ(info.at("solved"), 125);
  EXPECT_LE(info.at("ratio_max").get<double>(), 1.2 + 1e-9);
  EXPECT_GE(info.at("ratio_max").get<double>(), 1.0);
  const CommandResult verify = RunFeeler({"db", "verify", Database(), "--json"});
  EXPECT_EQ(verify.exit_code, 0) << verify.err;
  const Json verification = Json::parse(verify.out);
  EXPECT_EQ(verification.at("policies"), 125);
  EXPECT_EQ(verification.at("hypotheses"), 20 * 20 * 20);
  EXPECT_LE(verification.at("largest_cost_error").get<double>(), 1e-9);
}

TEST(Preprocess, SurvivesBeingKilledAndDoesNotDependOnThreads) {
  const std::string digest = Info(Database()).at("content_digest");
  const std::string file = ScratchFolder("killed") + "/plug.db";
  int kills = 0;
  for (const double seconds : {0.1, 0.3, 0.6}) kills += KillFeelerAfter(Preprocess(file, "1"), seconds) ? 1 : 0;
  EXPECT_GE(kills, 1);
  const CommandResult result = RunFeeler(Preprocess(file, "1"));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Info(file).at("content_digest"), digest);
  // Once more: nothing is left to do and nothing changes.
  const CommandResult again = RunFeeler(Preprocess(file, "1"));
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_NE(again.err.find("0 solved now"), std::string::npos) << again.err;
  EXPECT_EQ(Info(file).at("content_digest"), digest);
}

/// Records of a file, without what was measured.
std::vector<std::string> Records(const std::string& file) {
  std::vector<std::string> records;
  std::istringstream lines(ReadFile(file));
  for (std::string line; std::getline(lines, line);) {
    Json record = Json::parse(line);
    EXPECT_EQ(record.erase("timing"), 1U);
    records.push_back(record.dump());
  }
  return records;
}

TEST(Run, RecordsDependOnTheSeedAlone) {
  const std::string folder = ScratchFolder("records");
  const auto run = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "run", "--task", "plug", "--db", Database(), "--policy", "database", "--out", folder + "/" + name};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult result = RunFeeler(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Records(folder + "/" + name);
  };
  const auto plain = run("plain", {"--episodes", "4", "--seed", "5"});
  ASSERT_EQ(plain.size(), 4U);
  EXPECT_EQ(run("threads", {"--episodes", "4", "--seed", "5", "--jobs", "2"}), plain);
  EXPECT_EQ(run("withheld", {"--episodes", "4", "--seed", "5", "--withhold-true-pose"}), plain);
  const auto fewer = run("fewer", {"--episodes", "2", "--seed", "5"});
  EXPECT_EQ(fewer, std::vector<std::string>(plain.begin(), plain.begin() + 2));
  EXPECT_NE(run("seed", {"--episodes", "4", "--seed", "6"}), plain);
}

TEST(Run, InsertsByTouchWhereBlindInsertionFails) {
  const auto inserted = [&](const std::vector<std::string>& policy) {
    std::vector<std::string> arguments = {"run", "--task", "plug", "--extents", "6x6x6", "--episodes",
                                          "10",  "--seed", "1",    "--jobs",    "2",     "--json"};
    arguments.insert(arguments.end(), policy.begin(), policy.end());
    const CommandResult result = RunFeeler(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out);
  };
  const Json touch = inserted({"--policy", "database", "--db", Database()});
  EXPECT_GE(touch.at("inserted").get<int>(), 9);
  EXPECT_GE(touch.at("localized").get<int>(), touch.at("inserted").get<int>());
  EXPECT_LE(touch.at("sim_time_median_s").get<double>(), 22.3);
  const Json blind = inserted({"--policy", "open-loop"});
  EXPECT_LE(blind.at("inserted").get<int>(), 4);
  EXPECT_EQ(blind.at("failures").empty(), blind.at("inserted") == 10);
}

TEST(Run, PlansOnlineForAProblemThatTheDatabaseDoesNotHold) {
  const auto run = [&](const std::string& extents) {
    return RunFeeler({"run", "--task", "plug", "--db", Database(), "--extents", extents, "--episodes", "2", "--json"});
  };
  const CommandResult held = run("6x6x6");
  EXPECT_EQ(held.exit_code, 0) << held.err;
  EXPECT_EQ(held.err.find("solved online"), std::string::npos) << held.err;
  const CommandResult outside = run("7x6x6");
  EXPECT_EQ(outside.exit_code, 0) << outside.err;
  EXPECT_NE(outside.err.find("2 of 2 episodes met problems that " + Database() + " does not hold: solved online"),
            std::string::npos)
      << outside.err;
  const Json summary = Json::parse(outside.out);
  EXPECT_EQ(summary.at("solved_online"), 2);
  EXPECT_EQ(summary.at("inserted"), 2);
}

TEST(Solve, WritesAPolicyFileWhoseLeavesAreTheHypotheses) {
  const std::string file = ScratchFolder("solve") + "/policy.json";
  const CommandResult result = RunFeeler({"solve", "--task", "plug", "--extents", "3x3x2", "--out", file, "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Json summary = Json::parse(result.out);
  const Json policy = Json::parse(ReadFile(file));
  EXPECT_EQ(policy.at("expected_cost"), summary.at("expected_cost"));
  std::vector<int> leaves(18, 0);
  for (const Json& node : policy.at("nodes")) {
    if (!node.contains("hypotheses")) continue;
    ASSERT_EQ(node.at("hypotheses").size(), 1U);
    ++leaves.at(node.at("hypotheses")[0].get<std::size_t>());
  }
  for (const int count : leaves) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace feeler::cli
