#include "feeler/cli/common/console.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <iostream>
#include <string>
#include <system_error>

namespace feeler::cli {
namespace {

/// The first error of writing results; written by the main thread alone.
std::string& LostReason() {
  static std::string reason;
  return reason;
}

void NoteLoss(int error) {
  if (LostReason().empty()) LostReason() = std::generic_category().message(error == 0 ? EIO : error);
}

bool& Muted() {
  static bool muted = false;
  return muted;
}

bool WriteAll(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

void OpenClosedStreams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // Standard output for reading only: writing to it fails as it would have failed.
    const int opened = open("/dev/null", descriptor == STDERR_FILENO ? O_WRONLY : O_RDONLY);
    if (opened < 0 || opened == descriptor) continue;
    dup2(opened, descriptor);
    close(opened);
  }
}

void Mute() { Muted() = true; }

void PrintResult(std::string_view text) {
  if (Muted()) return;
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) NoteLoss(errno);
}

void Tell(std::string_view text) {
  if (Muted()) return;
  std::fflush(stdout);
  if (std::ferror(stdout) != 0) NoteLoss(errno);
  (void)WriteAll(STDERR_FILENO, text);
}

std::string_view ResultsLost() {
  errno = 0;
  std::cout.flush();  // what CLI11 prints; the buffer is that of stdout
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout) NoteLoss(errno);
  return LostReason();
}

}  // namespace feeler::cli
