#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace feeler::planner {

/// A file as memory, read-only: processes that map the same file share its pages. It may be replaced or removed
/// meanwhile (the mapping keeps what it had); who shortens it in place ends the process.
class MappedFile {
 public:
  /// Null if it cannot be read or is empty.
  static std::shared_ptr<const MappedFile> Open(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::string_view bytes() const { return {static_cast<const char*>(memory_), size_}; }

 private:
  MappedFile(void* memory, std::size_t size) : memory_(memory), size_(size) {}

  void* memory_;
  std::size_t size_;
};

}  // namespace feeler::planner
