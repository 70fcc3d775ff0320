#include "feeler/planner/arrays/host_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

namespace feeler::planner {

HostLock::HostLock(std::filesystem::path file, int descriptor) : file_(std::move(file)), descriptor_(descriptor) {}

std::unique_ptr<HostLock> HostLock::Acquire(const std::filesystem::path& file,
                                            const std::function<bool()>& keep_waiting) {
  constexpr auto kNap = std::chrono::milliseconds(20);
  std::error_code ignored;
  std::filesystem::create_directories(file.parent_path(), ignored);
  while (true) {
    const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0) return nullptr;
    while (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      const bool taken = errno == EWOULDBLOCK || errno == EINTR;
      if (taken && keep_waiting()) {
        std::this_thread::sleep_for(kNap);
        continue;
      }
      close(descriptor);
      return nullptr;
    }
    // Its last holder may have removed it between opening and locking: then another file has the name.
    struct stat named {};
    struct stat opened {};
    const bool same = stat(file.c_str(), &named) == 0 && fstat(descriptor, &opened) == 0 &&
                      named.st_ino == opened.st_ino && named.st_dev == opened.st_dev;
    if (same) return std::unique_ptr<HostLock>(new HostLock(file, descriptor));
    close(descriptor);
  }
}

HostLock::~HostLock() {
  unlink(file_.c_str());
  close(descriptor_);
}

}  // namespace feeler::planner
