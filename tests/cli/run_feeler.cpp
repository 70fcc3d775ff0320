#include "tests/cli/run_feeler.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace feeler::cli {

std::string ScratchFolder(const std::string& name) {
  const std::string folder = testing::TempDir() + "/feeler_" + name + "_" + std::to_string(getpid());
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

std::string ReadFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void WriteFile(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

namespace {

pid_t Start(const std::vector<std::string>& arguments, const std::string& out, const std::string& err,
            const std::function<void()>& in_child = {}) {
  const pid_t child = fork();
  if (child != 0) return child;
  if (freopen(out.c_str(), "w", stdout) == nullptr || freopen(err.c_str(), "w", stderr) == nullptr) _exit(126);
  if (in_child) in_child();
  std::vector<char*> argv = {const_cast<char*>(FEELER_BINARY)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(FEELER_BINARY, argv.data());
  _exit(127);
}

}  // namespace

bool KillFeelerAfter(const std::vector<std::string>& arguments, double seconds) {
  const pid_t child = Start(arguments, "/dev/null", "/dev/null");
  usleep(static_cast<useconds_t>(seconds * 1e6));
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status);
}

namespace {

CommandResult Finish(pid_t child, const std::string& folder) {
  int status = 0;
  waitpid(child, &status, 0);
  CommandResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = ReadFile(folder + "/out");
  result.err = ReadFile(folder + "/err");
  std::filesystem::remove_all(folder);
  return result;
}

std::string CallFolder() {
  static int calls = 0;
  return ScratchFolder("call" + std::to_string(calls++));
}

}  // namespace

CommandResult RunFeeler(const std::vector<std::string>& arguments) { return RunFeeler(arguments, {}); }

CommandResult RunFeeler(const std::vector<std::string>& arguments, const std::function<void()>& in_child) {
  const std::string folder = CallFolder();
  return Finish(Start(arguments, folder + "/out", folder + "/err", in_child), folder);
}

SignalledResult SignalFeeler(const std::vector<std::string>& arguments, double after_s, const std::vector<int>& signals,
                             const std::function<void()>& in_child) {
  const std::string folder = CallFolder();
  const pid_t child = Start(arguments, folder + "/out", folder + "/err", in_child);
  usleep(static_cast<useconds_t>(after_s * 1e6));
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < signals.size(); ++i) {
    if (i > 0) usleep(100'000);
    kill(child, signals[i]);
  }
  SignalledResult signalled;
  signalled.result = Finish(child, folder);
  signalled.ended_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return signalled;
}

void ExpectOneError(const CommandResult& result, const std::string& named) {
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_TRUE(result.out.empty()) << result.out;
  const std::size_t begin = result.err.find("feeler: error: ");
  ASSERT_NE(begin, std::string::npos) << result.err;
  EXPECT_TRUE(begin == 0 || result.err[begin - 1] == '\n') << result.err;
  const std::string line = result.err.substr(begin);
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << line;
  EXPECT_NE(line.find(named), std::string::npos) << line;
  EXPECT_TRUE(line.ends_with(")\n")) << "says not how to mend it: " << line;
}

}  // namespace feeler::cli
