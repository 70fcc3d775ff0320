#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

namespace feeler::planner {

/// Byte arrays that processes of a host make for one another while they run, in a file that all of them map: what one
/// has made, the others find. Safe to use from many threads and processes; nothing that is kept ever moves or changes.
///
/// The first process that opens the file begins it anew, the last one removes it; what a killed process leaves is begun
/// anew by the next. What there is no room for (of the pool, or of the disk) is not kept, which is no error.
///
/// Layout: a table of slots (state, key, place, size), then the arrays, each from a multiple of 64 on. A slot is told
/// by its state only when its array is written.
class SharedPool {
 public:
  using Key = std::array<std::int32_t, 5>;
  static constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;

  /// Null where the file cannot be made, locked or mapped.
  static std::shared_ptr<SharedPool> Open(const std::filesystem::path& file, std::uint64_t most_bytes = kMostBytes);
  ~SharedPool();
  SharedPool(const SharedPool&) = delete;
  SharedPool& operator=(const SharedPool&) = delete;

  /// What is kept under the key; empty if nothing is. Valid as long as the pool.
  std::span<const std::uint8_t> Find(const Key& key) const;
  /// Keeps a copy; empty if there is no room. `bytes` are not empty.
  std::span<const std::uint8_t> Keep(const Key& key, std::span<const std::uint8_t> bytes);

 private:
  struct Head;
  struct Slot;
  SharedPool(std::filesystem::path file, int descriptor, std::uint64_t most_bytes, void* table, void* arrays);
  std::span<Slot> Slots() const;
  std::span<const std::uint8_t> ArrayOf(const Slot& slot) const;

  std::filesystem::path file_;
  int descriptor_;
  std::uint64_t most_bytes_;
  void* table_;
  void* arrays_;
};

}  // namespace feeler::planner
