#include "feeler/policies/storage/writer_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::policies {
namespace {

/// Files this process is writing. Process-wide because the operating system's locks are: a second attempt within the
/// process must be refused before it opens (and so must close) a descriptor of the file.
struct OpenFiles {
  std::mutex mutex;
  std::set<std::pair<dev_t, ino_t>> files;
};
OpenFiles& ProcessFiles() {
  static OpenFiles files;
  return files;
}

InputError HasWriter(const std::string& path) {
  return {path, "another process is writing this database", "wait until it is done, or write to another file"};
}

}  // namespace

WriterLock::WriterLock(const std::string& path, bool create) {
  OpenFiles& open = ProcessFiles();
  const std::lock_guard guard(open.mutex);
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) throw InputError(path, "is a directory", "give the name of a file");
    if (!S_ISREG(status.st_mode)) throw InputError(path, "is not a regular file", "give the name of a file");
    if (open.files.contains({status.st_dev, status.st_ino})) throw HasWriter(path);
  }
  descriptor_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC | (create ? O_CREAT : 0), 0666);
  if (descriptor_ < 0) {
    throw InputError(path, "cannot be opened for writing: " + std::generic_category().message(errno),
                     "check that the folder exists and that you may write there");
  }
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const bool held = errno == EWOULDBLOCK;
    const std::string reason = std::generic_category().message(errno);
    ::close(descriptor_);
    if (held) throw HasWriter(path);
    throw InputError(path, "cannot be locked: " + reason, "use a file system that supports locks");
  }
  fstat(descriptor_, &status);
  device_ = status.st_dev;
  inode_ = status.st_ino;
  open.files.emplace(device_, inode_);
}

WriterLock::~WriterLock() {
  OpenFiles& open = ProcessFiles();
  const std::lock_guard guard(open.mutex);
  ::close(descriptor_);
  open.files.erase({device_, inode_});
}

}  // namespace feeler::policies
