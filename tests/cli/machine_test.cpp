// Laws of a machine that says no: threads and memory that cannot be had and files that cannot be reached end with one
// line, exit code 1 (machine) or 2 (files), never with an abort and never as an internal error.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

namespace fs = std::filesystem;

void LimitMemory(rlim_t bytes) {
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

std::string LastLine(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n');
  if (end == std::string::npos) return "";
  const std::size_t begin = text.find_last_of('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

TEST(Machine, RefusedMemoryAndThreadsAreOneLine) {
  const std::vector<std::vector<std::string>> commands = {
      {"solve", "--task", "plug", "--extents", "4x4x4", "--jobs", "1000"},
      {"run", "--task", "plug", "--policy", "open-loop", "--episodes", "3", "--jobs", "1000"},
      {"preprocess", "--task", "plug", "--family", "2..3x2..3x2", "--jobs", "1000", "--out",
       ScratchFolder("machine") + "/x.db"}};
  for (const auto& command : commands) {
    for (const rlim_t megabytes : {250, 400, 1000}) {  // below what the libraries take the loader refuses
      const CommandResult result = RunFeeler(command, [megabytes] { LimitMemory(megabytes << 20); });
      if (result.exit_code == 127 && result.err.find("loading shared libraries") != std::string::npos) continue;
      EXPECT_LE(result.exit_code, 1) << command[0] << megabytes << result.err;
      EXPECT_EQ(result.err.find("terminate called"), std::string::npos) << result.err;
      EXPECT_EQ(result.err.find("internal"), std::string::npos) << result.err;
      if (result.exit_code == 1) {
        EXPECT_TRUE(LastLine(result.err).starts_with("feeler: error: ")) << result.err;
        EXPECT_TRUE(LastLine(result.err).ends_with(")")) << result.err;
      }
    }
  }
}

TEST(Machine, PathsThatCannotBeReachedAreNamed) {
  const std::string folder = ScratchFolder("paths");
  WriteFile(folder + "/file", "x");
  fs::create_symlink("loop", folder + "/loop");
  const std::vector<std::string> paths = {folder + "/" + std::string(300, 'n'),
                                          folder + "/file/below",
                                          folder + "/loop",
                                          folder + "/" + std::string(5000, 'd'),
                                          folder + "/\xff\xfe",
                                          "t.xml",
                                          "",
                                          "/proc/1/nothing",
                                          "/proc/nothing"};
  for (const std::string& path : paths) {
    const std::vector<std::vector<std::string>> commands = {
        {"task", "show", path + (path == "t.xml" ? "" : "/t.xml")},
        {"task", "show", path},
        {"solve", "--problem", path},
        {"solve", "--problem", kProblem, "--out", path + "/x.json"},
        {"preprocess", "--task", "plug", "--family", "2x2x2", "--out", path + "/x.db"},
        {"preprocess", "--task", "plug", "--family", path + ".json", "--out", folder + "/x.db"},
        {"run", "--task", "plug", "--db", path},
        {"run", "--task", "plug", "--policy", "open-loop", "--out", path + "/e.jsonl"},
        {"db", "info", path},
        {"report", path, "--out", folder + "/r.html"},
        {"perceive", "--task", "plug", "--cloud", path, "--table", path},
        {"assemble", "--assembly", path + ".json", "--check"},
        {"experiment", "bounds", "--quick", "--out", path + "/x"}};
    for (const auto& command : commands) {
      const bool writes_to_root = path.empty() && command.back().starts_with("/");
      if (writes_to_root || (path.empty() && command.back() == folder + "/x.db")) continue;
      if (command.back().starts_with("t.xml/")) continue;  // a place that could be made
      const CommandResult result = RunFeeler(command);
      EXPECT_EQ(result.exit_code, 2) << command[0] << " " << command[1] << " " << path << result.err;
      EXPECT_TRUE(LastLine(result.err).starts_with("feeler: error: ")) << command[0] << result.err;
      EXPECT_EQ(result.err.find("internal"), std::string::npos) << command[0] << result.err;
      EXPECT_TRUE(result.err.ends_with(")\n")) << command[0] << result.err;
      EXPECT_LT(result.err.size(), 3000U);
    }
  }
}

}  // namespace
}  // namespace feeler::cli
