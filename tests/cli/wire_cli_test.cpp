// Laws of feeler simulate and feeler execute: in lockstep the records over the wire are those of feeler run, byte for
// byte but the times measured; a dry run moves nothing; what goes wrong to order ends an episode with its true reason,
// and the next one is sound; bad input is one line; the executor's binary links no simulator.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;

const std::string& CubeDatabase() {
  static const std::string path = [] {
    const std::string file = ScratchFolder("wire") + "/plug.db";
    const CommandResult made =
        RunFeeler({"preprocess", "--task", "plug", "--out", file, "--family", "4x4x4", "--jobs", "1"});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return file;
  }();
  return path;
}

/// feeler simulate in the background, in lockstep, until it ends by itself or the object goes.
class Simulation {
 public:
  /// `extents`: what it was started with; empty: nothing.
  explicit Simulation(const std::vector<std::string>& more, const std::string& extents = "4x4x4")
      : folder_(ScratchFolder("simulation")) {
    std::vector<std::string> arguments = {FEELER_BINARY, "simulate",    "--task", "plug",
                                          "--listen",    "127.0.0.1:0", "--json", "--lockstep"};
    if (!extents.empty()) arguments.insert(arguments.end(), {"--extents", extents});
    arguments.insert(arguments.end(), more.begin(), more.end());
    child_ = fork();
    if (child_ == 0) {
      if (freopen((folder_ + "/out").c_str(), "w", stdout) == nullptr) _exit(126);
      if (freopen((folder_ + "/err").c_str(), "w", stderr) == nullptr) _exit(126);
      std::vector<char*> argv;
      for (std::string& argument : arguments) argv.push_back(argument.data());
      argv.push_back(nullptr);
      execv(FEELER_BINARY, argv.data());
      _exit(127);
    }
    address_ = WhereItListens();
  }
  ~Simulation() {
    if (child_ > 0) Stop();
  }
  const std::string& address() const { return address_; }
  /// What it says at its end; it is told to end where it would wait for more.
  OrderedJson Stop() {
    kill(child_, SIGTERM);
    return Wait();
  }
  OrderedJson Wait() {
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = 0;
    const OrderedJson seen = OrderedJson::parse(ReadFile(folder_ + "/out"), nullptr, false);
    EXPECT_FALSE(seen.is_discarded()) << ReadFile(folder_ + "/err");
    return seen;
  }

 private:
  /// HOST:PORT of its line on stderr; from then on it ends by itself when it is told to.
  std::string WhereItListens() const {
    const std::string lead = "listens on ";
    for (int waited_ms = 0; waited_ms < 30'000; waited_ms += 5) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      if (!std::filesystem::exists(folder_ + "/err")) continue;
      const std::string said = ReadFile(folder_ + "/err");
      const size_t start = said.find(lead);
      const size_t end = said.find(',', start);
      if (start != std::string::npos && end != std::string::npos)
        return said.substr(start + lead.size(), end - start - lead.size());
    }
    ADD_FAILURE() << "the simulation does not listen";
    return "127.0.0.1:1";
  }

  std::string address_;
  std::string folder_;
  pid_t child_ = 0;
};

std::vector<std::string> Execute(const std::string& address, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"execute", "--db", CubeDatabase(), "--robot", address};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// The lines of a records file, what was measured taken out.
std::vector<std::string> Untimed(const std::string& path) {
  std::vector<std::string> lines;
  std::istringstream in(ReadFile(path));
  for (std::string line; std::getline(in, line);) {
    OrderedJson record = OrderedJson::parse(line);
    EXPECT_EQ(record.erase("timing"), 1U);
    lines.push_back(record.dump());
  }
  return lines;
}

TEST(WireCli, RecordsInLockstepAreThoseOfOneProcess) {
  for (const std::string noise : {"ideal", "force-noise=1,yaw=1"}) {
    const std::string folder = ScratchFolder("wire_records");
    const std::vector<std::string> episodes = {"--seed", "3", "--episodes", "3", "--noise", noise};
    std::vector<std::string> run = {
        "run", "--task", "plug", "--db", CubeDatabase(), "--extents", "4x4x4", "--out", folder + "/run.jsonl"};
    run.insert(run.end(), episodes.begin(), episodes.end());
    EXPECT_EQ(RunFeeler(run).exit_code, 0);
    Simulation simulation(episodes);
    const CommandResult executed = RunFeeler(Execute(
        simulation.address(), {"--task", "plug", "--extents", "4x4x4", "--out", folder + "/wire.jsonl", "--json"}));
    EXPECT_EQ(executed.exit_code, 0) << executed.err;
    EXPECT_EQ(simulation.Wait().at("episodes_judged"), 3);
    const std::vector<std::string> direct = Untimed(folder + "/run.jsonl");
    EXPECT_EQ(direct.size(), 3U);
    EXPECT_EQ(Untimed(folder + "/wire.jsonl"), direct) << noise;
    const OrderedJson summary = OrderedJson::parse(executed.out);
    EXPECT_EQ(summary.at("episodes"), 3);
    EXPECT_EQ(summary.at("links_lost"), 0);
  }
}

TEST(WireCli, TheExtentsOfTheExecutorHoldWhereTheSimulationHasNone) {
  const std::string folder = ScratchFolder("wire_extents");
  const std::vector<std::string> episodes = {"--seed", "3", "--episodes", "2"};
  std::vector<std::string> run = {
      "run", "--task", "plug", "--db", CubeDatabase(), "--extents", "4x4x4", "--out", folder + "/run.jsonl"};
  run.insert(run.end(), episodes.begin(), episodes.end());
  EXPECT_EQ(RunFeeler(run).exit_code, 0);
  Simulation simulation(episodes, "");
  const CommandResult executed =
      RunFeeler(Execute(simulation.address(), {"--extents", "4x4x4", "--out", folder + "/wire.jsonl"}));
  EXPECT_EQ(executed.exit_code, 0) << executed.err;
  EXPECT_EQ(simulation.Wait().at("episodes_judged"), 2);
  EXPECT_EQ(Untimed(folder + "/wire.jsonl"), Untimed(folder + "/run.jsonl"));
  // More than the task allows is refused before anything is placed.
  Simulation other(episodes, "");
  const CommandResult refused = RunFeeler(Execute(other.address(), {"--extents", "4x4x44"}));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("4x4x44"), std::string::npos) << refused.err;
  EXPECT_EQ(other.Stop().at("motions"), 0);
}

TEST(WireCli, ADryRunPrintsMotionsAndMovesNothing) {
  Simulation simulation({"--seed", "3"});
  const CommandResult dry = RunFeeler(Execute(simulation.address(), {"--dry-run"}));
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_NE(dry.out.find("guarded"), std::string::npos) << dry.out;
  EXPECT_NE(dry.out.find("compliant"), std::string::npos) << "the insertion is shown, too: " << dry.out;
  EXPECT_EQ(simulation.Stop().at("motions"), 0);
}

TEST(WireCli, WhatGoesWrongIsTheReasonAndTheNextEpisodeIsSound) {
  const std::string out = ScratchFolder("wire_faults") + "/records.jsonl";
  Simulation simulation({"--seed", "5", "--episodes", "8", "--no-replay", "--faults",
                         "drop=0.3,stall=0.3,protective=0.2,malformed=0.2,half=0.2,nan=0.1,backwards=0.1,jump=0.1"});
  const CommandResult executed = RunFeeler(Execute(simulation.address(), {"--out", out, "--json"}));
  EXPECT_EQ(executed.exit_code, 0) << executed.err;
  const OrderedJson seen = simulation.Stop();
  EXPECT_FALSE(seen.at("faults").empty());
  int inserted = 0;
  int broken = 0;
  std::istringstream in(ReadFile(out));
  for (std::string line; std::getline(in, line);) {
    const OrderedJson record = OrderedJson::parse(line);
    const std::string reason = record.at("reason");
    EXPECT_EQ(record.at("forbidden_contacts"), 0) << reason;
    if (record.at("inserted").get<bool>()) {
      ++inserted;
      continue;
    }
    ++broken;
    EXPECT_TRUE(reason.find("link lost") != std::string::npos || reason.find("protective stop") != std::string::npos)
        << reason;
  }
  EXPECT_EQ(inserted + broken, 8);
  EXPECT_GT(inserted, 0);
  EXPECT_GT(broken, 0);
  EXPECT_EQ(seen.at("refused_motions"), 0) << "a motion was sent after a protective stop";
}

TEST(WireCli, AMotionOutsideOfTheBoxIsNotSent) {
  Simulation simulation({"--seed", "3", "--no-replay"});
  const std::string out = ScratchFolder("wire_box") + "/records.jsonl";
  const CommandResult executed =
      RunFeeler(Execute(simulation.address(), {"--box", "-1,-1,1.2,1,1,1.6", "--out", out, "--json"}));
  EXPECT_EQ(executed.exit_code, 0) << executed.err;
  EXPECT_EQ(simulation.Wait().at("motions"), 0);
  EXPECT_NE(ReadFile(out).find("outside of the workspace box"), std::string::npos) << ReadFile(out);
}

TEST(WireCli, AMotionThatTheArmCannotMakeIsNotSent) {
  // An arm whose elbow is all but fixed.
  const std::string folder = ScratchFolder("wire_arm");
  const std::string stiff = std::regex_replace(
      ReadFile(std::string(FEELER_SOURCE_DIR) + "/models/robots/ur10e.urdf"),
      std::regex("(elbow_joint\"[\\s\\S]*?<limit lower=\")[^\"]*(\" upper=\")[^\"]*"), "$010.00$020.01");
  WriteFile(folder + "/stiff.urdf", stiff);
  const std::string out = folder + "/records.jsonl";
  for (const std::string wire : {"json", "numbers"}) {
    // The numbers-only form knows no episodes: it is refused there, before anything moves.
    Simulation simulation({"--seed", "3", "--no-replay"});
    const CommandResult executed = RunFeeler(
        Execute(simulation.address(), {"--arm", folder + "/stiff.urdf", "--wire", wire, "--out", out, "--json"}));
    if (wire == "json") {
      EXPECT_EQ(executed.exit_code, 0) << executed.err;
      EXPECT_NE(ReadFile(out).find("elbow_joint would be at"), std::string::npos) << ReadFile(out);
    } else {
      EXPECT_NE(executed.exit_code, 0);
    }
    EXPECT_EQ(simulation.Stop().at("motions"), 0);
  }
  Simulation simulation({"--seed", "3", "--no-replay"});
  const CommandResult refused = RunFeeler(Execute(simulation.address(), {"--arm", folder + "/none.urdf"}));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("none.urdf"), std::string::npos) << refused.err;
}

std::vector<std::string> Calibrate(const std::string& address, const std::string& out,
                                   const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {
      "cell",  "calibrate", "--robot",    address, "--block", "0.635,-0.012,0.1,0.665,0.012,0.2",
      "--out", out,         "--top-only", "--json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(WireCli, ACalibrationFindsTheBiasOfTheSensorAndNamesItsTool) {
  const std::string folder = ScratchFolder("wire_cell");
  const std::string out = folder + "/cell.json";
  for (const std::string wire : {"json", "numbers"}) {
    Simulation simulation({"--seed", "3", "--faults", "bias=8"});
    const CommandResult made =
        RunFeeler(Calibrate(simulation.address(), out, {"--tool", CubeDatabase(), "--wire", wire}));
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const OrderedJson cell = OrderedJson::parse(ReadFile(out));
    EXPECT_NEAR(cell.at("force_bias_n").get<double>(), 8.0, 0.05) << "before any episode";
    EXPECT_EQ(cell.at("tool"), "plug");
    EXPECT_GT(cell.at("stiffness_n_m").get<double>(), 1e4);
    EXPECT_LT(cell.at("stiffness_n_m").get<double>(), 5e7);
  }
  for (const std::string force : {"1", "20", "50"}) {
    Simulation simulation({"--seed", "3", "--no-replay"});
    const CommandResult made =
        RunFeeler(Calibrate(simulation.address(), out, {"--tool", "plug", "--contact-force", force}));
    ASSERT_EQ(made.exit_code, 0) << force << made.err;
    EXPECT_GT(OrderedJson::parse(ReadFile(out)).at("stiffness_n_m").get<double>(), 1e4) << force;
    const CommandResult dry = RunFeeler(Execute(simulation.address(), {"--cell", out, "--dry-run"}));
    EXPECT_EQ(dry.exit_code, 0) << force << dry.err;
  }
}

TEST(WireCli, TheHelpOfExecuteNamesAllOptions) {
  const CommandResult help = RunFeeler({"execute", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option : {"--db", "--estimate", "--depth", "--cloud", "--intrinsics", "--background", "--table"}) {
    EXPECT_NE(help.out.find(option), std::string::npos) << option << help.out;
  }
}

TEST(WireCli, BadInputIsOneLine) {
  const auto refused = [](const std::vector<std::string>& arguments, const std::string& word) {
    const CommandResult result = RunFeeler(arguments);
    EXPECT_NE(result.exit_code, 0) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find("feeler: error: "), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(word), std::string::npos) << result.err;
  };
  const std::string nowhere = "127.0.0.1:1";
  refused(Execute("nonsense", {}), "HOST:PORT");
  refused(Execute(nowhere, {"--estimate", "1,2,3"}), "--estimate");
  refused(Execute(nowhere, {"--estimate", "1,2,3,0.5,0,0,0"}), "quaternion");
  refused(Execute(nowhere, {"--box", "0,0,0,1,1,0"}), "--box");
  refused(Execute(nowhere, {"--task", "round-peg"}), "--task");
  refused(Execute(nowhere, {"--cell", CubeDatabase()}), "");
  refused(Execute(nowhere, {"--token-file", "/nowhere"}), "/nowhere");
  refused(Calibrate(nowhere, "/tmp/none.json", {"--tool", "nosuchtask"}), "nosuchtask");
  refused(Calibrate(nowhere, "/tmp/none.json", {}), "--tool");
  refused(Calibrate("listen:0.0.0.0:0", "/tmp/none.json", {"--tool", "plug"}), "token");
  refused({"execute", "--db", "/nowhere.db", "--robot", nowhere}, "/nowhere.db");
  refused({"simulate", "--task", "plug", "--listen", "0.0.0.0:0"}, "token");
  refused({"simulate", "--task", "plug", "--listen", "127.0.0.1:0", "--faults", "gremlins=1"}, "gremlins");
  const std::string folder = ScratchFolder("wire_bad");
  WriteFile(folder + "/cell.json", R"({"format":"feeler cell","version":1,"tool":"round-peg"})");
  refused(Execute(nowhere, {"--cell", folder + "/cell.json"}), "round-peg");
  WriteFile(folder + "/token", "secret\n");
  chmod((folder + "/token").c_str(), 0600);
  Simulation simulation({"--seed", "3", "--token-file", folder + "/token"});
  refused(Execute(simulation.address(), {}), "token");
  WriteFile(folder + "/zeros", "007\n");
  chmod((folder + "/zeros").c_str(), 0600);
  refused(
      Calibrate(nowhere, "/tmp/none.json", {"--tool", "plug", "--wire", "numbers", "--token-file", folder + "/zeros"}),
      "zero");
  refused(Execute(simulation.address(), {"--token-file", folder + "/token", "--extents", "3x3x3"}), "--extents");
  EXPECT_EQ(simulation.Stop().at("motions"), 0);
}

TEST(WireCli, TheExecutorLinksNoSimulator) {
  const std::string program = std::filesystem::path(FEELER_BINARY).parent_path() / "feeler-execute";
  std::string libraries;
  FILE* pipe = popen(("ldd " + program).c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::array<char, 512> part{};
  while (fgets(part.data(), part.size(), pipe) != nullptr) libraries += part.data();
  EXPECT_EQ(pclose(pipe), 0);
  EXPECT_NE(libraries.find("libsqlite3"), std::string::npos) << libraries;
  for (const char* heavy : {"mujoco", "EGL", "opencv", "assimp", "TKernel"}) {
    EXPECT_EQ(libraries.find(heavy), std::string::npos) << libraries;
  }
}

}  // namespace
}  // namespace feeler::cli
