#include "feeler/core/file_output.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>

#include "feeler/core/error.h"

namespace feeler {
namespace {

/// Parts that a signal handler has to deal with. Slots are taken and given back with atomics alone: nothing here may
/// wait or allocate while a handler runs.
struct PendingOutput {
  enum State { kFree, kFilling, kDiscard, kKeep };
  std::atomic<int> state{kFree};
  char part[PATH_MAX]{};
  char target[PATH_MAX]{};
};
std::array<PendingOutput, 32>& PendingOutputs() {
  static constinit std::array<PendingOutput, 32> pending{};  // there before any handler can ask
  return pending;
}

int AddPending(const std::string& part, const std::string& target) {
  if (part.size() >= PATH_MAX || target.size() >= PATH_MAX) return -1;
  auto& pending = PendingOutputs();
  for (std::size_t i = 0; i < pending.size(); ++i) {
    int free = PendingOutput::kFree;
    if (!pending[i].state.compare_exchange_strong(free, PendingOutput::kFilling)) continue;
    std::memcpy(pending[i].part, part.c_str(), part.size() + 1);
    std::memcpy(pending[i].target, target.c_str(), target.size() + 1);
    pending[i].state = PendingOutput::kDiscard;
    return static_cast<int>(i);
  }
  return -1;
}

void RemovePending(int index) {
  if (index >= 0) PendingOutputs()[static_cast<std::size_t>(index)].state = PendingOutput::kFree;
}

std::string FolderOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

/// N for `/dev/fd/N`, `/proc/self/fd/N`, `/proc/PID/fd/N` of this process and the standard streams; else -1.
int DescriptorOf(const std::string& path) {
  if (path == "/dev/stdin") return STDIN_FILENO;
  if (path == "/dev/stdout") return STDOUT_FILENO;
  if (path == "/dev/stderr") return STDERR_FILENO;
  const std::string own = "/proc/" + std::to_string(getpid()) + "/fd/";
  for (const std::string& prefix : {std::string("/dev/fd/"), std::string("/proc/self/fd/"), own}) {
    if (!path.starts_with(prefix)) continue;
    int number = -1;
    const char* begin = path.data() + prefix.size();
    const char* end = path.data() + path.size();
    const auto [rest, error] = std::from_chars(begin, end, number);
    if (error == std::errc() && rest == end && number >= 0) return number;
  }
  return -1;
}

struct Destination {
  std::string target;   ///< links followed
  int descriptor = -1;  ///< of this process, or -1
};

/// Follows symbolic links by hand: the last one may point to nothing yet, and a descriptor must be told from the file
/// behind it. Returns ELOOP and other errors of the system in `error`.
Destination Follow(const std::string& path, int& error) {
  constexpr int kMostLinks = 40;  // as Linux
  Destination destination{path, -1};
  error = 0;
  for (int links = 0; links <= kMostLinks; ++links) {
    destination.descriptor = DescriptorOf(destination.target);
    if (destination.descriptor >= 0) return destination;
    struct stat status {};
    if (lstat(destination.target.c_str(), &status) != 0) {
      if (errno != ENOENT) error = errno;
      return destination;
    }
    if (!S_ISLNK(status.st_mode)) return destination;
    std::array<char, PATH_MAX> link{};
    const ssize_t length = readlink(destination.target.c_str(), link.data(), link.size());
    if (length < 0) {
      error = errno;
      return destination;
    }
    const std::string next(link.data(), static_cast<std::size_t>(length));
    destination.target = next.starts_with('/') ? next : FolderOf(destination.target) + "/" + next;
  }
  error = ELOOP;
  return destination;
}

constexpr mode_t kNewFile = 0666;  // less the umask

}  // namespace

OutputFile::OutputFile(const std::string& path, WhenInterrupted when_interrupted) : path_(path) {
  int error = 0;
  const Destination destination = Follow(path, error);
  if (path.empty()) error = ENOENT;
  if (error != 0) Fail(error);
  target_ = destination.target;
  if (destination.descriptor >= 0) {
    descriptor_ = fcntl(destination.descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    if (descriptor_ < 0) Fail(errno);
    return;
  }
  Open();
  if (direct()) return;
  keep_ = when_interrupted == WhenInterrupted::kKeep;
  pending_ = AddPending(part_, target_);
}

void OutputFile::Open() {
  struct stat status {};
  const bool exists = stat(target_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) Fail(EISDIR);
  if (exists && !S_ISREG(status.st_mode)) {
    descriptor_ = open(target_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
    if (descriptor_ < 0) Fail(errno);
    return;
  }
  if (exists && access(target_.c_str(), W_OK) != 0) Fail(errno);
  const std::string part = target_ + ".part";
  while (true) {
    descriptor_ = open(part.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, kNewFile);
    if (descriptor_ < 0) Fail(errno);
    struct stat opened {};
    if (fstat(descriptor_, &opened) != 0 || !S_ISREG(opened.st_mode)) {
      close(std::exchange(descriptor_, -1));
      throw InputError(path_, "cannot be written: " + part + " is not a regular file",
                       "remove it or choose another file");
    }
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      close(std::exchange(descriptor_, -1));
      throw InputError(path_, "is being written by another process", "wait until it is done, or choose another file");
    }
    // Between opening and locking, its writer may have put it in its place: then it is not a part any more.
    struct stat named {};
    if (stat(part.c_str(), &named) == 0 && named.st_ino == opened.st_ino && named.st_dev == opened.st_dev) break;
    close(std::exchange(descriptor_, -1));
  }
  part_ = part;
  if (ftruncate(descriptor_, 0) != 0) Fail(errno);
  if (exists) {  // the new file is as readable as the old one
    if (fchown(descriptor_, status.st_uid, status.st_gid) != 0) errno = 0;
    if (fchmod(descriptor_, status.st_mode & 07777) != 0) errno = 0;
  }
}

OutputFile::~OutputFile() {
  if (descriptor_ < 0) return;
  if (!direct()) unlink(part_.c_str());
  RemovePending(pending_);
  close(descriptor_);
}

void OutputFile::Fail(int error) const {
  throw InputError(path_, "cannot be written: " + std::generic_category().message(error),
                   error == ENOSPC || error == EDQUOT
                       ? "free some space"
                       : "check that the folder exists, that you may write there and that the disk has room");
}

void OutputFile::Write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) Fail(errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  if (keep_ && pending_ >= 0) PendingOutputs()[static_cast<std::size_t>(pending_)].state = PendingOutput::kKeep;
}

void OutputFile::Commit() {
  if (descriptor_ < 0) return;
  if (direct()) {
    if (close(std::exchange(descriptor_, -1)) != 0) Fail(errno);
    return;
  }
  if (fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP) Fail(errno);
  if (std::rename(part_.c_str(), target_.c_str()) != 0) Fail(errno);
  RemovePending(pending_);
  close(std::exchange(descriptor_, -1));
  // The name is on the disk when its folder is. A file system that cannot sync a folder has kept the file all the same.
  const int folder = open(FolderOf(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  fsync(folder);
  close(folder);
}

void WriteFileAtomically(const std::string& path, std::string_view content) {
  OutputFile out(path);
  out.Write(content);
  out.Commit();
}

bool IsReplaceable(const std::string& path) {
  int error = 0;
  const Destination destination = Follow(path, error);
  if (destination.descriptor >= 0) return false;
  struct stat status {};
  return stat(destination.target.c_str(), &status) != 0 || S_ISREG(status.st_mode);
}

bool IsSameFile(const std::string& a, const std::string& b) {
  struct stat of_a {};
  struct stat of_b {};
  return stat(a.c_str(), &of_a) == 0 && stat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

void SettleOutputsInSignalHandler() noexcept {
  for (PendingOutput& pending : PendingOutputs()) {
    const int state = pending.state.exchange(PendingOutput::kFilling);
    if (state == PendingOutput::kKeep) std::rename(pending.part, pending.target);
    if (state == PendingOutput::kDiscard) unlink(pending.part);
  }
}

}  // namespace feeler
