#pragma once

#include <sys/types.h>

#include <string>

namespace feeler::policies {

/// Keeps a second writer, of this process or another, off a database file while readers go on. An advisory lock of the
/// whole file (flock) that ends with the process, however it ends: no stale lock, no side file. It does not meet the
/// byte-range locks that SQLite takes on the same file.
///
/// Hold it longer than any SQLite connection that writes the file: closing the descriptor drops the process's
/// byte-range locks of that file.
class WriterLock {
 public:
  /// Opens the file, creating it empty if `create` and absent. Throws InputError if it cannot be opened for writing, is
  /// not a regular file, or has a writer already.
  WriterLock(const std::string& path, bool create);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  int descriptor_ = -1;
  dev_t device_{};
  ino_t inode_{};
};

}  // namespace feeler::policies
