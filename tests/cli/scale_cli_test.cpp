// Laws of jobs in parts, through the command line:
//   - shards merged are the whole: the same content digest, the same records but for measured times, also where
//   policies
//     are made with the experience of others, and through the scripts of examples/scale/;
//   - a shard that is there twice, missing, unfinished, overlapping or foreign is refused in one line, and nothing is
//     left behind or overwritten;
//   - 1, 2 and 8 ranks make the same content as none; a lost rank ends the job, and the same command goes on;
//   - ranks of a host make contact map and tables once, and share them;
//   - ranks that differ in task or command, or of which one fails before it serves, are refused, once;
//   - an experiment on ranks holds what it holds without.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

using Json = nlohmann::json;

constexpr const char* kFamily = "2..5x2..5x2..4";

std::string Digest(const std::string& file) {
  const CommandResult result = RunFeeler({"db", "info", file, "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result.exit_code == 0 ? Json::parse(result.out).at("content_digest").get<std::string>() : "";
}

void PreprocessInto(const std::string& file, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"preprocess", "--task", "plug",  "--family", kFamily,
                                        "--jobs",     "1",      "--out", file};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const CommandResult result = RunFeeler(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
}

/// The family in one go, and in three shards.
struct Parts {
  std::string folder = ScratchFolder("shards");
  std::string whole = folder + "/whole.db";
  std::string Shard(int index) const { return folder + "/s" + std::to_string(index) + ".db"; }
};

const Parts& Family() {
  static const Parts parts = [] {
    Parts made;
    PreprocessInto(made.whole);
    for (int i = 1; i <= 3; ++i) PreprocessInto(made.Shard(i), {"--shard", std::to_string(i) + "/3"});
    return made;
  }();
  return parts;
}

CommandResult Merge(const std::vector<std::string>& files, const std::string& out, const std::string& what = "db") {
  std::vector<std::string> arguments = {what, "merge"};
  arguments.insert(arguments.end(), files.begin(), files.end());
  arguments.insert(arguments.end(), {"--out", out});
  return RunFeeler(arguments);
}

/// Refused with exit code 2 and one line that says so; `out` is not there.
void ExpectRefused(const CommandResult& result, const std::string& words, const std::string& out) {
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_FALSE(std::filesystem::exists(out + ".part"));
}

TEST(Shards, MergedAreTheWhole) {
  const Parts& parts = Family();
  const std::string out = parts.folder + "/merged.db";
  const CommandResult merged = Merge({parts.Shard(2), parts.Shard(3), parts.Shard(1)}, out);
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(Digest(out), Digest(parts.whole));
  EXPECT_TRUE(std::filesystem::exists(out + ".bundle"));
  EXPECT_EQ(RunFeeler({"db", "verify", out}).exit_code, 0);
  // It is a whole database: the command that makes the whole finds nothing left to do.
  const CommandResult again = RunFeeler({"preprocess", "--task", "plug", "--family", kFamily, "--out", out});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.err.find("48 already there"), std::string::npos) << again.err;
}

TEST(Shards, WithExperienceAreTheWholeToo) {
  const std::string folder = ScratchFolder("experience");
  const std::vector<std::string> solver = {"--solver", "e-rtdp-bel", "--family", "2..4x2..4x2..3"};
  const auto make = [&](const std::string& file, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"preprocess", "--task", "plug", "--jobs", "1", "--out", file};
    arguments.insert(arguments.end(), solver.begin(), solver.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(RunFeeler(arguments).exit_code, 0);
  };
  make(folder + "/whole.db", {});
  make(folder + "/1.db", {"--shard", "1/2"});
  make(folder + "/2.db", {"--shard", "2/2"});
  ASSERT_EQ(Merge({folder + "/1.db", folder + "/2.db"}, folder + "/merged.db").exit_code, 0);
  EXPECT_EQ(Digest(folder + "/merged.db"), Digest(folder + "/whole.db"));
}

TEST(Shards, AreRefusedForWhatIsWrongWithThem) {
  const Parts& parts = Family();
  const std::string out = parts.folder + "/refused.db";
  const std::string s1 = parts.Shard(1), s2 = parts.Shard(2), s3 = parts.Shard(3);
  ExpectRefused(Merge({s1, s1, s2, s3}, out), "is given twice", out);
  const std::string copy = parts.folder + "/copy.db";
  std::filesystem::copy_file(s1, copy);
  ExpectRefused(Merge({s1, s2, s3, copy}, out), "is shard 1 of 3, as ", out);
  ExpectRefused(Merge({s1, s3}, out), "2 of 3 missing", out);
  ExpectRefused(Merge({s1}, out), "one file is nothing to merge", out);
  ExpectRefused(Merge({s1, s2, s3, parts.whole}, out), "is no shard", out);
  ExpectRefused(Merge({parts.whole, s1}, out), "is a shard", out);
  ExpectRefused(Merge({s1, s2, parts.folder + "/absent.db"}, out), "absent.db", out);

  const std::string other = parts.folder + "/other.db";
  PreprocessInto(other, {"--shard", "2/3", "--gap", "1.5"});
  ExpectRefused(Merge({s1, other, s3}, out), "another settings", out);
  const std::string four = parts.folder + "/four.db";
  PreprocessInto(four, {"--shard", "2/4"});
  ExpectRefused(Merge({s1, four, s3}, out), "is one of 4 shards", out);

  const std::string damaged = parts.folder + "/damaged.db";
  std::string bytes = ReadFile(s2);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  WriteFile(damaged, bytes);
  EXPECT_EQ(Merge({s1, damaged, s3}, out).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(out));

  const std::string there = ReadFile(parts.whole);
  EXPECT_EQ(Merge({s1, s2, s3}, parts.whole).exit_code, 2);
  EXPECT_EQ(ReadFile(parts.whole), there);
  // A shard is continued as that shard only.
  EXPECT_EQ(RunFeeler({"preprocess", "--task", "plug", "--family", kFamily, "--out", s1}).exit_code, 2);
  EXPECT_EQ(RunFeeler({"preprocess", "--task", "plug", "--family", kFamily, "--out", s1, "--shard", "2/3"}).exit_code,
            2);
  EXPECT_EQ(RunFeeler({"preprocess", "--task", "plug", "--family", kFamily, "--out", out, "--shard", "4/3"}).exit_code,
            2);
}

TEST(Shards, DisjointFamiliesMergeAndOverlappingOnesDoNot) {
  const std::string folder = ScratchFolder("disjoint");
  const auto make = [&](const char* family, const std::string& file) {
    const CommandResult result =
        RunFeeler({"preprocess", "--task", "plug", "--family", family, "--jobs", "1", "--out", file});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  };
  make("2..3x2x2", folder + "/a.db");
  make("4..5x2x2", folder + "/b.db");
  make("2..5x2x2", folder + "/both.db");
  ASSERT_EQ(Merge({folder + "/a.db", folder + "/b.db"}, folder + "/m.db").exit_code, 0);
  EXPECT_EQ(Digest(folder + "/m.db"), Digest(folder + "/both.db"));
  ExpectRefused(Merge({folder + "/a.db", folder + "/both.db"}, folder + "/no.db"), "both hold problem 2x2x2",
                folder + "/no.db");
}

/// The lines of a records file without what is measured.
std::vector<Json> RecordsOf(const std::string& file) {
  std::vector<Json> records;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    records.push_back(Json::parse(line));
    records.back().erase("timing");
  }
  return records;
}

CommandResult RunEpisodesOf(const std::string& out, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"run",        "--task", "plug",  "--db", Family().whole,
                                        "--episodes", "7",      "--out", out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunFeeler(arguments);
}

TEST(Shards, OfRecordsMergedAreTheWhole) {
  const std::string folder = ScratchFolder("records");
  ASSERT_EQ(RunEpisodesOf(folder + "/whole.jsonl").exit_code, 0);
  for (const char* index : {"1", "2", "3"}) {
    ASSERT_EQ(RunEpisodesOf(folder + "/" + index + ".jsonl", {"--shard", std::string(index) + "/3"}).exit_code, 0);
  }
  const std::string out = folder + "/merged.jsonl";
  const std::string one = folder + "/1.jsonl", two = folder + "/2.jsonl", three = folder + "/3.jsonl";
  const CommandResult merged = Merge({three, one, two}, out, "records");
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(RecordsOf(out), RecordsOf(folder + "/whole.jsonl"));
  EXPECT_EQ(RecordsOf(out).size(), 7U);

  const std::string no = folder + "/no.jsonl";
  ExpectRefused(Merge({one, two}, no, "records"), "3 of 3 missing", no);
  ExpectRefused(Merge({one, two, three, one}, no, "records"), "is given twice", no);
  ExpectRefused(Merge({one, two, folder + "/whole.jsonl"}, no, "records"), "is no shard", no);
  ASSERT_EQ(RunEpisodesOf(folder + "/foreign.jsonl", {"--shard", "3/3", "--seed", "2"}).exit_code, 0);
  ExpectRefused(Merge({one, two, folder + "/foreign.jsonl"}, no, "records"), "another seed (2, not 1)", no);
  const std::string lines = ReadFile(two);
  WriteFile(two, lines.substr(0, lines.find('\n') + 1));
  ExpectRefused(Merge({one, two, three}, no, "records"), "is unfinished: 1 of the 2 episodes", no);
  EXPECT_EQ(Merge({one, two, three}, out, "records").exit_code, 2);  // exists
}

/// A command of the shell with the binary as $FEELER; out and err in one.
CommandResult Shell(const std::string& command) {
  const std::string folder = ScratchFolder("shell");
  const std::string line =
      "export FEELER='" FEELER_BINARY "'; cd '" + folder + "'; " + command + " > '" + folder + "/log' 2>&1 < /dev/null";
  const int status = std::system(line.c_str());  // NOLINT(cert-env33-c): a shell is what is tested
  CommandResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.out = ReadFile(folder + "/log");
  std::filesystem::remove_all(folder);
  return result;
}

TEST(SchedulerExamples, MakeTheWhole) {
  const Parts& parts = Family();
  const std::string examples = FEELER_SOURCE_DIR "/examples/scale/";
  const std::string folder = ScratchFolder("examples");
  const std::string settings = "FAMILY='" + std::string(kFamily) + "' OUT='" + folder + "/";
  // What Slurm sets for --array=10-14:2.
  for (const char* id : {"10", "12", "14"}) {
    const CommandResult task =
        Shell("SLURM_ARRAY_TASK_MIN=10 SLURM_ARRAY_TASK_STEP=2 SLURM_ARRAY_TASK_COUNT=3 SLURM_ARRAY_TASK_ID=" +
              std::string(id) + " " + settings + "slurm' bash " + examples + "slurm-array.sbatch");
    ASSERT_EQ(task.exit_code, 0) << task.out;
  }
  const std::string slurm = folder + "/slurm/shard-";
  ASSERT_EQ(Merge({slurm + "10.db", slurm + "12.db", slurm + "14.db"}, folder + "/slurm.db").exit_code, 0);
  EXPECT_EQ(Digest(folder + "/slurm.db"), Digest(parts.whole));
  const CommandResult parallel = Shell(settings + "parallel' SHARDS=2 bash " + examples + "gnu-parallel.sh");
  ASSERT_EQ(parallel.exit_code, 0) << parallel.out;
  EXPECT_EQ(Digest(folder + "/parallel/plug.db"), Digest(parts.whole));
}

TEST(SchedulerExamples, OfKubernetesAndOfRanksMakeTheWhole) {
  const std::string folder = ScratchFolder("kubernetes");
  const std::string family = "2..3x2..3x2..3";
  ASSERT_EQ(RunFeeler({"preprocess", "--task", "plug", "--family", family, "--out", folder + "/whole.db"}).exit_code,
            0);
  // What the kubelet runs in each pod, with this folder as its volume.
  std::string text = ReadFile(FEELER_SOURCE_DIR "/examples/scale/kubernetes-job.yaml");
  const std::size_t begin = text.find("args: [\"") + 8;
  std::string args = text.substr(begin, text.find("\"]", begin) - begin);
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(args.find(from), std::string::npos) << args;
    args.replace(args.find(from), from.size(), to);
  };
  replace("feeler ", "\"$FEELER\" ");
  replace("/out/", folder + "/");
  replace("--task plug", "--task plug --family " + family);
  EXPECT_NE(text.find("completions: 8"), std::string::npos);
  std::vector<std::string> shards;
  for (int index = 0; index < 8; ++index) {
    const std::string number = std::to_string(index);
    const CommandResult pod = Shell("export JOB_COMPLETION_INDEX=" + number + "; " + args);
    ASSERT_EQ(pod.exit_code, 0) << pod.out;
    shards.push_back(folder + "/shard-" + number + ".db");
  }
  ASSERT_EQ(Merge(shards, folder + "/merged.db").exit_code, 0);
  EXPECT_EQ(Digest(folder + "/merged.db"), Digest(folder + "/whole.db"));

  if (Shell("command -v mpirun").exit_code != 0) GTEST_SKIP() << "no mpirun";
  const CommandResult ranks =
      Shell("export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; FAMILY=" + family + " OUT='" + folder +
            "/mpi' bash " FEELER_SOURCE_DIR "/examples/scale/slurm-mpi.sbatch");
  if (ranks.out.find("without MPI") != std::string::npos) GTEST_SKIP() << "feeler without MPI";
  ASSERT_EQ(ranks.exit_code, 0) << ranks.out;
  EXPECT_EQ(Digest(folder + "/mpi/plug.db"), Digest(folder + "/whole.db"));
}

/// With mpirun, where it and a feeler that knows it are there.
class RanksTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (Shell("command -v mpirun").exit_code != 0) GTEST_SKIP() << "no mpirun";
    if (Mpirun(2, "run --task plug --policy nobody").out.find("without MPI") != std::string::npos) {
      GTEST_SKIP() << "feeler without MPI";
    }
  }
  static CommandResult Mpirun(int ranks, const std::string& arguments) {
    return Shell("mpirun --allow-run-as-root --oversubscribe -n " + std::to_string(ranks) + " \"$FEELER\" " +
                 arguments);
  }
};

TEST_F(RanksTest, MakeTheSameDatabaseAtAnyNumber) {
  const Parts& parts = Family();
  const std::string folder = ScratchFolder("ranks");
  for (const int ranks : {1, 2, 8}) {
    const std::string file = folder + "/" + std::to_string(ranks) + ".db";
    const CommandResult result =
        Mpirun(ranks, "preprocess --task plug --family " + std::string(kFamily) + " --json --out " + file);
    ASSERT_EQ(result.exit_code, 0) << result.out;
    EXPECT_EQ(Digest(file), Digest(parts.whole)) << ranks;
    if (ranks > 1) {
      EXPECT_NE(result.out.find("\"ranks\""), std::string::npos) << result.out;
    }
  }
}

TEST_F(RanksTest, MakeContactMapAndTablesOnceAHost) {
  const std::string folder = ScratchFolder("cold");
  const std::string cache = folder + "/cache";
  const auto files = [&](const char* extension) {
    std::ptrdiff_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(cache)) {
      if (entry.path().extension() == extension) ++count;
    }
    return count;
  };
  const std::string arguments = " \"$FEELER\" preprocess --task plug --family 2x2x2..3 --out " + folder;
  const std::string mpirun = "export FEELER_CACHE_DIR='" + cache + "'; mpirun --allow-run-as-root --oversubscribe -n 3";
  const CommandResult cold = Shell(mpirun + arguments + "/cold.db");
  ASSERT_EQ(cold.exit_code, 0) << cold.out;
  EXPECT_EQ(files(".contact-map"), 1);
  EXPECT_EQ(files(".lock"), 0);
  const std::ptrdiff_t tables = files(".tables");
  EXPECT_GT(tables, 0);
  const CommandResult warm = Shell(mpirun + arguments + "/warm.db");
  ASSERT_EQ(warm.exit_code, 0) << warm.out;
  EXPECT_EQ(files(".tables"), tables);
  EXPECT_EQ(warm.out.find("contact map:"), std::string::npos) << warm.out;
  EXPECT_EQ(Digest(folder + "/warm.db"), Digest(folder + "/cold.db"));
  // A cache that cannot be written: one line, and the job goes on.
  std::filesystem::remove_all(cache);
  WriteFile(cache, "no folder");
  const CommandResult without = Shell(mpirun + arguments + "/without.db");
  ASSERT_EQ(without.exit_code, 0) << without.out;
  const std::size_t said = without.out.find("FEELER_CACHE_DIR");
  ASSERT_NE(said, std::string::npos) << without.out;
  EXPECT_EQ(without.out.find("FEELER_CACHE_DIR", said + 1), std::string::npos) << without.out;
  EXPECT_EQ(Digest(folder + "/without.db"), Digest(folder + "/cold.db"));
}

TEST_F(RanksTest, MakeTheSameRecords) {
  const std::string folder = ScratchFolder("rank_records");
  ASSERT_EQ(RunEpisodesOf(folder + "/whole.jsonl").exit_code, 0);
  const CommandResult result =
      Mpirun(3, "run --task plug --db " + Family().whole + " --episodes 7 --out " + folder + "/ranks.jsonl");
  ASSERT_EQ(result.exit_code, 0) << result.out;
  EXPECT_EQ(RecordsOf(folder + "/ranks.jsonl"), RecordsOf(folder + "/whole.jsonl"));
}

TEST_F(RanksTest, ALostRankLeavesAFileThatGoesOn) {
  const Parts& parts = Family();
  const std::string file = ScratchFolder("lost") + "/lost.db";
  const std::string arguments = "preprocess --task plug --family " + std::string(kFamily) + " --out " + file;
  // Rank 1 is a shell that becomes feeler and is killed soon after.
  const CommandResult lost = Shell("mpirun --allow-run-as-root --oversubscribe -n 1 \"$FEELER\" " + arguments +
                                   " : -n 1 sh -c '\"$FEELER\" " + arguments + " & sleep 0.4; kill -9 $!; wait $!'");
  if (lost.exit_code == 0) {  // it was done before
    EXPECT_EQ(Digest(file), Digest(parts.whole));
    return;
  }
  ASSERT_EQ(Mpirun(2, arguments).exit_code, 0);
  EXPECT_EQ(Digest(file), Digest(parts.whole));
}

TEST_F(RanksTest, ThatDifferAreRefusedOnce) {
  const std::string folder = ScratchFolder("differ");
  const std::string common =
      "\"$FEELER\" preprocess --task plug --family " + std::string(kFamily) + " --out " + folder + "/x.db";
  const CommandResult differ =
      Shell("mpirun --allow-run-as-root --oversubscribe -n 1 " + common + " : -n 1 " + common + " --gap 1.5");
  EXPECT_EQ(differ.exit_code, 2) << differ.out;
  EXPECT_NE(differ.out.find("feeler: error: rank 1 on "), std::string::npos) << differ.out;
  EXPECT_NE(differ.out.find("has another settings"), std::string::npos) << differ.out;
  EXPECT_FALSE(std::filesystem::exists(folder + "/x.db"));
  const CommandResult both = Mpirun(2, "preprocess --task no-such-task --out " + folder + "/x.db");
  EXPECT_EQ(both.exit_code, 2) << both.out;
  const std::size_t first = both.out.find("feeler: error:");
  ASSERT_NE(first, std::string::npos) << both.out;
  EXPECT_EQ(both.out.find("feeler: error:", first + 1), std::string::npos) << both.out;
  EXPECT_EQ(Mpirun(2, "db info " + Family().whole).exit_code, 2);
  // One that fails while the other is busy with the contact map.
  const std::string run = "\"$FEELER\" run --task plug --episodes 2 --out " + folder + "/x.jsonl --db ";
  const CommandResult fails = Shell("timeout 60 mpirun --allow-run-as-root --oversubscribe -n 1 " + run +
                                    Family().whole + " : -n 1 " + run + folder + "/absent.db");
  EXPECT_EQ(fails.exit_code, 2) << fails.out;
  EXPECT_NE(fails.out.find("feeler: error: rank 1 on "), std::string::npos) << fails.out;
}

TEST(Estimate, IsNearTheTruthAndWritesNothing) {
  const CommandResult result = RunFeeler({"preprocess", "--task", "plug", "--family", kFamily, "--estimate", "--sample",
                                          "16", "--ranks", "64", "--jobs", "1", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json estimate = Json::parse(result.out);
  EXPECT_EQ(estimate.at("problems"), 48);
  EXPECT_EQ(estimate.at("sampled"), 16);
  EXPECT_GT(estimate.at("cpu_s").get<double>(), estimate.at("sample_cpu_s").get<double>());
  EXPECT_GE(estimate.at("wall_s").get<double>(), estimate.at("longest_s").get<double>());
  EXPECT_LE(estimate.at("efficiency").get<double>(), 1.0);
  EXPECT_GT(estimate.at("memory_per_rank_bytes").get<double>(), 1e6);
}

}  // namespace
}  // namespace feeler::cli
