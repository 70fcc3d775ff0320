#include "feeler/core/captured_stderr.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <mutex>

namespace feeler {
namespace {

std::mutex& OneAtATime() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

CapturedStderr::CapturedStderr() {
  OneAtATime().lock();
  std::fflush(stderr);
  capture_ = memfd_create("feeler-stderr", MFD_CLOEXEC);
  before_ = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (capture_ >= 0 && before_ >= 0) dup2(capture_, STDERR_FILENO);
}

CapturedStderr::~CapturedStderr() {
  std::fflush(stderr);
  if (capture_ >= 0 && before_ >= 0) dup2(before_, STDERR_FILENO);
  if (before_ >= 0) close(before_);
  if (capture_ >= 0) close(capture_);
  OneAtATime().unlock();
}

std::string CapturedStderr::LastLine() const {
  std::fflush(stderr);
  std::array<char, 4096> bytes{};
  const off_t size = capture_ >= 0 ? lseek(capture_, 0, SEEK_END) : 0;
  const off_t begin = size > static_cast<off_t>(bytes.size()) ? size - static_cast<off_t>(bytes.size()) : 0;
  const ssize_t count = capture_ >= 0 ? pread(capture_, bytes.data(), bytes.size(), begin) : 0;
  std::string text(bytes.data(), count > 0 ? static_cast<std::size_t>(count) : 0);
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1);
}

}  // namespace feeler
