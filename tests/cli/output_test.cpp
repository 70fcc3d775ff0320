// Laws of what commands write:
// - a device, a FIFO and a descriptor are written into and stay what they are; a symbolic link stays a link;
// - an output that is an input, by whatever name, is refused before anything is opened;
// - a file of another kind is refused and keeps its bytes;
// - what a killed run left behind is gone after the next.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> SolveTo(const std::string& out) { return {"solve", "--problem", kProblem, "--out", out}; }

void ExpectRefused(const CommandResult& result, const std::string& named) {
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(named), std::string::npos) << result.err;
  EXPECT_TRUE(result.err.ends_with(")\n")) << result.err;
}

std::string PolicyText() {
  const std::string file = ScratchFolder("policy") + "/p.json";
  EXPECT_EQ(RunFeeler(SolveTo(file)).exit_code, 0);
  return ReadFile(file);
}

TEST(Output, DevicesAndDescriptorsAreWrittenInto) {
  const std::string policy = PolicyText();
  ASSERT_TRUE(nlohmann::json::accept(policy));
  EXPECT_EQ(RunFeeler(SolveTo("/dev/null")).exit_code, 0);
  struct stat status {};
  ASSERT_EQ(stat("/dev/null", &status), 0);
  EXPECT_TRUE(S_ISCHR(status.st_mode)) << "/dev/null is no device any more";
  // Standard output is a file here: it is written on, not replaced.
  for (const std::string name : {"/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"}) {
    const CommandResult result = RunFeeler({"export", "--problem", kProblem, "--out", name});
    EXPECT_EQ(result.exit_code, 0) << name << result.err;
    EXPECT_EQ(result.out, RunFeeler({"export", "--problem", kProblem}).out) << name;
  }
  const std::string folder = ScratchFolder("link");
  fs::create_symlink("/dev/null", folder + "/null");
  EXPECT_EQ(RunFeeler(SolveTo(folder + "/null")).exit_code, 0);
  EXPECT_TRUE(fs::is_symlink(folder + "/null"));
}

TEST(Output, AFifoPassesTheWholeResult) {
  const std::string fifo = ScratchFolder("fifo") + "/f";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  std::string received;
  std::thread reader([&] { received = ReadFile(fifo); });
  EXPECT_EQ(RunFeeler(SolveTo(fifo)).exit_code, 0);
  reader.join();
  EXPECT_EQ(received, PolicyText());
  EXPECT_TRUE(fs::is_fifo(fifo));
}

TEST(Output, LinksAreFollowedAndModesKept) {
  const std::string folder = ScratchFolder("links");
  fs::create_directory(folder + "/real");
  fs::create_symlink("real/p.json", folder + "/p.json");  // to nothing yet
  ASSERT_EQ(RunFeeler(SolveTo(folder + "/p.json")).exit_code, 0);
  EXPECT_TRUE(fs::is_symlink(folder + "/p.json"));
  EXPECT_EQ(ReadFile(folder + "/real/p.json"), PolicyText());
  ASSERT_EQ(chmod((folder + "/real/p.json").c_str(), 0640), 0);
  ASSERT_EQ(RunFeeler(SolveTo(folder + "/p.json")).exit_code, 0);
  struct stat status {};
  ASSERT_EQ(stat((folder + "/real/p.json").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0640U);
  fs::create_symlink("loop", folder + "/loop");
  ExpectRefused(RunFeeler(SolveTo(folder + "/loop")), "loop");
}

TEST(Output, ThatIsAnInputIsRefused) {
  const std::string folder = ScratchFolder("same");
  const std::string text = ReadFile(kProblem);
  const std::string problem = folder + "/problem.json";
  WriteFile(problem, text);
  fs::create_symlink("problem.json", folder + "/link.json");
  fs::create_hard_link(problem, folder + "/hard.json");
  for (const std::string name : {"problem.json", "link.json", "hard.json", "./problem.json"}) {
    const std::string out = folder + "/" + name;
    ExpectRefused(RunFeeler({"solve", "--problem", problem, "--out", out}), "same file");
    ExpectRefused(RunFeeler({"export", "--problem", out, "--out", problem}), "same file");
    EXPECT_EQ(ReadFile(problem), text) << name;
  }
  // What a task is made of is an input too.
  const std::string task = std::string(FEELER_SOURCE_DIR) + "/models/tasks/plug.xml";
  const std::string copy = folder + "/t.xml";
  WriteFile(copy, ReadFile(task));
  ExpectRefused(RunFeeler({"task", "render", copy, "--out", copy}), "same file");
  ExpectRefused(RunFeeler({"preprocess", "--task", copy, "--out", copy}), "same file");
  EXPECT_EQ(ReadFile(copy), ReadFile(task));
}

TEST(Output, AFileOfAnotherKindIsKept) {
  const std::string folder = ScratchFolder("kinds");
  const std::string notes = folder + "/notes";
  const std::string text = "what I must not lose\n";
  const std::vector<std::vector<std::string>> commands = {
      {"solve", "--problem", kProblem, "--out", notes},
      {"export", "--problem", kProblem, "--out", notes},
      {"export", "--problem", kProblem, "--format", "pomdpx", "--out", notes},
      {"preprocess", "--task", "plug", "--family", "2x2x2", "--out", notes},
      {"run", "--task", "plug", "--policy", "open-loop", "--out", notes},
      {"run", "--task", "plug", "--policy", "open-loop", "--video", notes},
      {"task", "render", "plug", "--out", notes},
      {"perceive", "calibrate", "--task", "plug", "--out", notes},
      {"assemble", "--assembly", "frame", "--check", "--render", notes},
      {"report", folder, "--out", notes}};
  for (const auto& command : commands) {
    WriteFile(notes, text);
    ExpectRefused(RunFeeler(command), "notes");
    EXPECT_EQ(ReadFile(notes), text) << command[0];
  }
  WriteFile(notes, "");  // an empty file (mktemp) holds nothing
  EXPECT_EQ(RunFeeler({"solve", "--problem", kProblem, "--out", notes}).exit_code, 0);
  EXPECT_EQ(RunFeeler({"solve", "--problem", kProblem, "--out", notes}).exit_code, 0) << "its own kind is replaced";
}

TEST(Output, WhatABundleACalibrationOrAFolderWouldReplaceIsKept) {
  const std::string folder = ScratchFolder("beside");
  const std::string text = "what I must not lose\n";
  const auto expect_kept = [&](const std::string& file, const std::vector<std::string>& command) {
    WriteFile(folder + "/" + file, text);
    const CommandResult result = RunFeeler(command);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find(file + ": exists and"), std::string::npos) << result.err;
    EXPECT_TRUE(result.err.ends_with(")\n")) << result.err;
    EXPECT_EQ(ReadFile(folder + "/" + file), text) << file;
  };
  expect_kept("x.db.bundle", {"preprocess", "--task", "plug", "--family", "2x2x2", "--out", folder + "/x.db"});
  expect_kept("t.json.partial.jsonl", {"perceive", "calibrate", "--task", "plug", "--out", folder + "/t.json"});
  expect_kept("bounds.csv", {"experiment", "bounds", "--quick", "--out", folder});
  WriteFile(folder + "/pipe_geoms.xml", text);
  ExpectRefused(RunFeeler({"task", "make-pipe-parts", "--out", folder}), "pipe_geoms.xml");
  EXPECT_EQ(ReadFile(folder + "/pipe_geoms.xml"), text);
  EXPECT_FALSE(fs::exists(folder + "/pipe_assets.xml")) << "nothing is written before all is known to be replaceable";
}

TEST(Output, AnImportReplacesWhatAnImportWroteAlone) {
  const std::string folder = ScratchFolder("import");
  const std::string part = folder + "/tool_of_mine.stl";
  const std::string facets = "solid a\nendsolid a\n";
  WriteFile(part, facets);
  const auto import = [&](const std::string& tool) {
    return RunFeeler({"task", "import", "--tool", tool, "--target", tool, "--out", folder});
  };
  ExpectRefused(import(part), "is the input");
  WriteFile(folder + "/import.json", "{\"format\": \"feeler-import\"}");
  ExpectRefused(import(part), "is the input");
  fs::remove(folder + "/import.json");
  const std::string elsewhere = ScratchFolder("parts") + "/a.stl";
  WriteFile(elsewhere, facets);
  ExpectRefused(import(elsewhere), "no earlier import wrote it");
  EXPECT_EQ(ReadFile(part), facets);
}

TEST(Output, ShardsAreMergedIntoWhatIsWritten) {
  const std::string folder = ScratchFolder("merge");
  for (const char* shard : {"1/2", "2/2"}) {
    ASSERT_EQ(RunFeeler({"run", "--task", "plug", "--policy", "open-loop", "--extents", "2x2x2", "--episodes", "2",
                         "--shard", shard, "--out", folder + "/" + shard[0]})
                  .exit_code,
              0);
  }
  const CommandResult result =
      RunFeeler({"records", "merge", folder + "/1", folder + "/2", "--out", "/dev/stdout", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("\"episode\":1"), std::string::npos) << result.out;
}

TEST(Output, LeftoversOfAKilledRunGo) {
  const std::string folder = ScratchFolder("leftovers");
  WriteFile(folder + "/p.json.part", "half of someth");
  ASSERT_EQ(RunFeeler(SolveTo(folder + "/p.json")).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder + "/p.json.part"));
  EXPECT_EQ(ReadFile(folder + "/p.json"), PolicyText());
}

TEST(OutputFile, StandsWholeOrNotAtAll) {
  const std::string path = ScratchFolder("whole") + "/f";
  WriteFile(path, "old");
  {
    OutputFile out(path);
    out.Write("new");
    EXPECT_EQ(ReadFile(path), "old");
    EXPECT_THROW(OutputFile second(path), InputError) << "two writers of one file";
  }
  EXPECT_EQ(ReadFile(path), "old") << "not committed";
  EXPECT_FALSE(fs::exists(path + ".part"));
  {
    OutputFile out(path);
    out.Write("new");
    out.Commit();
  }
  EXPECT_EQ(ReadFile(path), "new");
  EXPECT_FALSE(fs::exists(path + ".part"));
}

}  // namespace
}  // namespace feeler::cli
