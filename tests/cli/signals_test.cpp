// Laws of signals: SIGINT, SIGTERM and SIGHUP end every command within 2 s and what is done is kept; a second one ends
// at once; a SIGHUP that was ignored at the start stays ignored.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kMost_s = 2.0;
constexpr double kStarted_s = 3.0;  // by then the command has begun, on a loaded machine too
constexpr double kSlack_s = 1.0;    // of a machine that does other things as well

TEST(Signals, EndReadingAFifo) {
  const std::string fifo = ScratchFolder("signal") + "/p";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    const SignalledResult ended = SignalFeeler({"solve", "--problem", fifo}, kStarted_s, {number});
    EXPECT_EQ(ended.result.exit_code, 1) << ended.result.err;
    EXPECT_LT(ended.ended_s, kMost_s + kSlack_s);
    EXPECT_NE(ended.result.err.find("nothing was begun that could be kept"), std::string::npos) << ended.result.err;
  }
}

TEST(Signals, EndWorkOfMinutesAndKeepWhatIsDone) {
  const std::string folder = ScratchFolder("signals");
  const std::vector<std::vector<std::string>> commands = {
      {"perceive", "calibrate", "--task", "plug", "--out", folder + "/t.json", "--poses", "100000"},
      {"run", "--task", "plug", "--policy", "open-loop", "--episodes", "100000", "--out", folder + "/e.jsonl"},
      {"run", "--task", "plug", "--policy", "open-loop", "--video", folder + "/v.mp4"},
      {"preprocess", "--task", "plug", "--out", folder + "/x.db"}};
  for (const auto& command : commands) {
    const SignalledResult ended = SignalFeeler(command, kStarted_s, {SIGTERM});
    EXPECT_LT(ended.ended_s, kMost_s + kSlack_s) << command[0];
    EXPECT_LE(ended.result.exit_code, 1) << command[0] << ended.result.err;
    for (const auto& entry : fs::directory_iterator(folder)) {
      EXPECT_NE(entry.path().extension(), ".part") << command[0] << " left " << entry.path();
    }
  }
  const std::string records = ReadFile(folder + "/e.jsonl");
  EXPECT_TRUE(records.empty() || records.ends_with("}\n")) << "a record is cut off";
  if (fs::exists(folder + "/x.db")) {
    EXPECT_EQ(RunFeeler({"db", "verify", folder + "/x.db"}).exit_code, 0);
  }
}

TEST(Signals, EndTheContactMapOfPipes) {
  const std::string cache = ScratchFolder("cache");
  const auto empty_cache = [&] { setenv("FEELER_CACHE_DIR", cache.c_str(), 1); };
  const SignalledResult ended = SignalFeeler({"task", "show", "elbow-onto-pipe"}, kStarted_s, {SIGTERM}, empty_cache);
  EXPECT_LT(ended.ended_s, kMost_s + kSlack_s);
  EXPECT_EQ(ended.result.exit_code, 1) << ended.result.err;
}

TEST(Signals, ASecondOneEndsAtOnce) {
  const std::string folder = ScratchFolder("second");
  const SignalledResult ended = SignalFeeler(
      {"run", "--task", "plug", "--policy", "open-loop", "--episodes", "100000", "--out", folder + "/e.jsonl"},
      kStarted_s, {SIGINT, SIGINT});
  EXPECT_LT(ended.ended_s, 0.1 + kSlack_s);
  EXPECT_FALSE(fs::exists(folder + "/e.jsonl.part"));
}

TEST(Signals, AnIgnoredHangupStaysIgnored) {
  const std::string folder = ScratchFolder("nohup");
  const SignalledResult ended =
      SignalFeeler({"run", "--task", "plug", "--policy", "open-loop", "--episodes", "20", "--out", folder + "/e.jsonl"},
                   kStarted_s, {SIGHUP}, [] { signal(SIGHUP, SIG_IGN); });
  EXPECT_EQ(ended.result.exit_code, 0) << ended.result.err;
  const std::string records = ReadFile(folder + "/e.jsonl");
  EXPECT_EQ(std::count(records.begin(), records.end(), '\n'), 20);
}

}  // namespace
}  // namespace feeler::cli
