#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "feeler/core/progress.h"
#include "feeler/planner/arrays/host_lock.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/arrays/shared_pool.h"

namespace feeler::planner {

/// Arrays in files of a folder, a file for each name and key, for the processes of a host to share: the first makes
/// them, the others map them. A key stands for all that the arrays depend on; a file that is damaged, or was kept under
/// another key, is not there. What cannot be kept is no error: it is made again by whoever needs it.
///
/// Layout of a file: "FEELERAR", version u32, number of arrays u32, their sizes in bytes u64 each, the key's length u32
/// and the key, the arrays, each from a multiple of 64 on, and XXH3 (64 bits) of all before it.
class ArrayStore {
 public:
  /// Told of the first file that cannot be kept, with the reason.
  using OnFailure = std::function<void(const std::string& reason)>;

  /// All files of the folder together take up to so many: those that were used longest ago go first.
  static constexpr std::uintmax_t kMostBytes = std::uintmax_t{16} << 30;

  ArrayStore(std::filesystem::path folder, std::string key, OnFailure on_failure = nullptr,
             std::uintmax_t most_bytes = kMostBytes);
  /// The same folder under another key.
  ArrayStore WithKey(const std::string& key) const;
  /// For whoever makes what the key stands for: another process that needs the same waits until it can take it. Null
  /// after a cancellation, or where there is no lock.
  std::unique_ptr<HostLock> Lock(const CancellationToken* cancellation) const;

  /// For arrays that are made one by one while the processes run; null where there is none.
  std::shared_ptr<SharedPool> Pool(const std::string& name) const;

  /// Fills the arrays from the file of this name; false, and nothing done, without one that has as many.
  template <class T>
  bool Take(const std::string& name, const std::vector<SharedArray<T>*>& arrays) const {
    const auto found = Find(name, arrays.size(), sizeof(T));
    if (!found) return false;
    for (std::size_t i = 0; i < arrays.size(); ++i) {
      const std::span<const std::byte> bytes = found->arrays[i];
      *arrays[i] = SharedArray<T>({reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)}, found->owner);
    }
    return true;
  }

  /// Keeps the arrays in the file of this name and has them share it: what this process held of its own is freed.
  template <class T>
  void Keep(const std::string& name, const std::vector<SharedArray<T>*>& arrays) const {
    std::vector<std::span<const std::byte>> bytes;
    bytes.reserve(arrays.size());
    for (const SharedArray<T>* array : arrays) bytes.push_back(std::as_bytes(array->span()));
    if (Write(name, bytes)) Take(name, arrays);
  }

 private:
  struct Found {
    std::shared_ptr<const void> owner;
    std::vector<std::span<const std::byte>> arrays;
  };
  std::filesystem::path FileOf(const std::string& name) const;
  std::optional<Found> Find(const std::string& name, std::size_t count, std::size_t element) const;
  bool Write(const std::string& name, const std::vector<std::span<const std::byte>>& arrays) const;
  void MakeRoom(std::uintmax_t bytes) const;

  std::filesystem::path folder_;
  std::string key_;
  OnFailure on_failure_;
  std::uintmax_t most_bytes_;
};

}  // namespace feeler::planner
