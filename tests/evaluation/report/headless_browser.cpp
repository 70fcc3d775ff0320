#include "tests/evaluation/report/headless_browser.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

std::string Slurp(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A browser in a process group of its own, whose console is read line by line.
class Browser {
 public:
  Browser(const std::vector<std::string>& arguments) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
    child_ = fork();
    if (child_ == 0) {
      setpgid(0, 0);
      dup2(ends[1], STDERR_FILENO);
      const int nowhere = open("/dev/null", O_RDWR);
      dup2(nowhere, STDOUT_FILENO);
      dup2(nowhere, STDIN_FILENO);
      close(ends[0]);
      std::vector<char*> argv;
      for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
      argv.push_back(nullptr);
      execv(argv[0], argv.data());
      _exit(127);
    }
    setpgid(child_, child_);
    close(ends[1]);
    console_ = ends[0];
  }
  ~Browser() {
    kill(-child_, SIGKILL);
    waitpid(child_, nullptr, 0);
    close(console_);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  /// The next line of the console; false after the deadline or at its end.
  bool Line(std::chrono::steady_clock::time_point deadline, std::string& line) {
    while (true) {
      if (const std::size_t end = buffer_.find('\n'); end != std::string::npos) {
        line = buffer_.substr(0, end);
        buffer_.erase(0, end + 1);
        return true;
      }
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      pollfd waiting{console_, POLLIN, 0};
      if (left.count() <= 0 || poll(&waiting, 1, static_cast<int>(left.count())) <= 0) return false;
      std::array<char, 4096> bytes{};
      const ssize_t count = read(console_, bytes.data(), bytes.size());
      if (count <= 0) return false;
      buffer_.append(bytes.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  pid_t child_ = -1;
  int console_ = -1;
  std::string buffer_;
};

}  // namespace

std::string FindChromium() {
  for (const char* path : {"/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"}) {
    if (access(path, X_OK) == 0) return path;
  }
  return "";
}

BrowserAnswer OpenPage(const std::string& page_file, const std::string& scratch_folder, int width, int height) {
  std::string page = Slurp(page_file);
  const std::string script =
      "<script>\n" + Slurp(FEELER_SOURCE_DIR "/tests/evaluation/report/report_page_check.js") + "</script>";
  page.insert(page.rfind("</body>"), script);
  const std::string checked = fs::absolute(scratch_folder + "/checked.html").string();
  std::ofstream(checked, std::ios::binary) << page;

  BrowserAnswer answer;
  Browser browser({FindChromium(), "--headless", "--no-sandbox", "--disable-dev-shm-usage", "--enable-logging=stderr",
                   "--enable-unsafe-swiftshader",
                   "--user-data-dir=" + fs::absolute(scratch_folder + "/profile").string(),
                   "--window-size=" + std::to_string(width) + "," + std::to_string(height), "file://" + checked});
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(90);
  for (std::string line; browser.Line(deadline, line);) {
    const std::size_t begin = line.find("CHECK:{");
    const std::size_t end = line.rfind(":END");
    if (begin != std::string::npos && end != std::string::npos) {
      answer.check = nlohmann::json::parse(line.substr(begin + 6, end - begin - 6), nullptr, false);
      return answer;
    }
    // Reading the picture back makes the driver talk about its speed.
    const bool driver = line.find("GL Driver Message") != std::string::npos;
    if (line.find(":CONSOLE") != std::string::npos && !driver) answer.problems.push_back(line);
  }
  return answer;
}

}  // namespace feeler::evaluation
