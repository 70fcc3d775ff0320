// Laws of the standard streams:
// - a closed descriptor is never the number of a file that is opened later: no message ends up in a database;
// - what cannot be written to standard error changes nothing;
// - results that cannot be written to standard output are an error: exit code 1, one line.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

void Full(int descriptor) {
  const int full = open("/dev/full", O_WRONLY);
  dup2(full, descriptor);
  close(full);
}

TEST(Streams, AClosedOneIsNoDatabase) {
  const std::string db = ScratchFolder("closed") + "/x.db";
  const std::vector<std::string> command = {"preprocess", "--task", "plug", "--family", "2..3x2x2", "--out", db};
  for (const int closed : {STDERR_FILENO, STDOUT_FILENO, STDIN_FILENO}) {
    const CommandResult result = RunFeeler(command, [closed] { close(closed); });
    EXPECT_EQ(result.exit_code, closed == STDOUT_FILENO ? 1 : 0) << closed << result.err;
    const CommandResult verified = RunFeeler({"db", "verify", db});
    EXPECT_EQ(verified.exit_code, 0) << closed << verified.err;
  }
  const CommandResult none = RunFeeler(command, [] {
    for (const int descriptor : {0, 1, 2}) close(descriptor);
  });
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_EQ(RunFeeler({"db", "verify", db}).exit_code, 0);
}

TEST(Streams, ErrorsNeedNoStandardError) {
  const auto code = [](const std::vector<std::string>& command, bool closed) {
    return RunFeeler(command, [closed] { closed ? void(close(STDERR_FILENO)) : Full(STDERR_FILENO); }).exit_code;
  };
  for (const bool closed : {true, false}) {
    EXPECT_EQ(code({"solve", "--problem", "/no/such.json"}, closed), 2);
    EXPECT_EQ(code({"insert"}, closed), 2);
    EXPECT_EQ(code({"solve", "--problem", kProblem}, closed), 0);
    EXPECT_EQ(code({"solve", "--problem", std::string(FEELER_SOURCE_DIR) + "/tests/data/unlocalizable.json"}, closed),
              1);
  }
}

TEST(Streams, LostResultsAreAnError) {
  const std::vector<std::vector<std::string>> commands = {{"task", "list"},
                                                          {"task", "list", "--json"},
                                                          {"solve", "--problem", kProblem},
                                                          {"solve", "--problem", kProblem, "--json"},
                                                          {"export", "--problem", kProblem},
                                                          {"experiment", "--list"},
                                                          {"--help"},
                                                          {"--version"}};
  for (const auto& command : commands) {
    for (const bool closed : {true, false}) {
      const CommandResult result =
          RunFeeler(command, [closed] { closed ? void(close(STDOUT_FILENO)) : Full(STDOUT_FILENO); });
      EXPECT_EQ(result.exit_code, 1) << command[0] << closed;
      const std::size_t at = result.err.find("feeler: error: standard output");
      ASSERT_NE(at, std::string::npos) << command[0] << result.err;
      EXPECT_EQ(std::count(result.err.begin() + static_cast<std::ptrdiff_t>(at), result.err.end(), '\n'), 1);
    }
  }
}

}  // namespace
}  // namespace feeler::cli
