#pragma once

#include <filesystem>
#include <functional>
#include <memory>

namespace feeler::planner {

/// Held by one process of a host at a time, for work whose result the others will find in a file. The system gives it
/// back when its holder dies.
class HostLock {
 public:
  /// Waits, asleep, until the lock of this file is free, and as long as `keep_waiting` (asked now and then) says. Null
  /// if it said no, or where no lock can be had: a folder that cannot be written, a file system without locks.
  static std::unique_ptr<HostLock> Acquire(const std::filesystem::path& file,
                                           const std::function<bool()>& keep_waiting);
  ~HostLock();
  HostLock(const HostLock&) = delete;
  HostLock& operator=(const HostLock&) = delete;

 private:
  HostLock(std::filesystem::path file, int descriptor);

  std::filesystem::path file_;
  int descriptor_;
};

}  // namespace feeler::planner
