#include "feeler/planner/arrays/array_store.h"

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/planner/arrays/mapped_file.h"

namespace feeler::planner {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "FEELERAR";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kAlignment = 64;
constexpr const char* kExtension = ".tables";
constexpr const char* kPoolExtension = ".pool";

std::size_t Aligned(std::size_t at) { return (at + kAlignment - 1) / kAlignment * kAlignment; }

template <class T>
void Append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// All before the first array.
std::string HeadOf(const std::vector<std::span<const std::byte>>& arrays, const std::string& key) {
  std::string head(kMagic);
  Append(head, kVersion);
  Append(head, static_cast<std::uint32_t>(arrays.size()));
  for (const auto& array : arrays) Append(head, static_cast<std::uint64_t>(array.size()));
  Append(head, static_cast<std::uint32_t>(key.size()));
  return head + key;
}

/// Writes and sums up.
class SummingWriter {
 public:
  explicit SummingWriter(const std::string& path) : out_(path), sum_(XXH3_createState(), XXH3_freeState) {
    XXH3_64bits_reset(sum_.get());
  }
  void Write(std::string_view bytes) {
    XXH3_64bits_update(sum_.get(), bytes.data(), bytes.size());
    out_.Write(bytes);
    size_ += bytes.size();
  }
  void Align() { Write(std::string(Aligned(size_) - size_, '\0')); }
  void Commit() {
    const std::uint64_t sum = XXH3_64bits_digest(sum_.get());
    out_.Write({reinterpret_cast<const char*>(&sum), sizeof(sum)});
    out_.Commit();
  }

 private:
  OutputFile out_;
  std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> sum_;
  std::size_t size_ = 0;
};

/// Reads what HeadOf wrote; sizes of the arrays, none if it is not that of this key.
std::optional<std::vector<std::size_t>> SizesIn(std::string_view bytes, const std::string& key) {
  std::size_t at = 0;
  const auto get = [&](auto& value) {
    if (bytes.size() - at < sizeof(value)) return false;
    std::memcpy(&value, bytes.data() + at, sizeof(value));
    at += sizeof(value);
    return true;
  };
  std::array<char, kMagic.size()> magic{};
  std::uint32_t version = 0, count = 0, length = 0;
  if (!get(magic) || std::string_view(magic.data(), magic.size()) != kMagic) return std::nullopt;
  if (!get(version) || version != kVersion || !get(count) || count > bytes.size()) return std::nullopt;
  std::vector<std::size_t> sizes;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::uint64_t size = 0;
    if (!get(size) || size > bytes.size()) return std::nullopt;
    sizes.push_back(size);
  }
  if (!get(length) || bytes.substr(at, length) != key) return std::nullopt;
  return sizes;
}

}  // namespace

ArrayStore::ArrayStore(fs::path folder, std::string key, OnFailure on_failure, std::uintmax_t most_bytes)
    : folder_(std::move(folder)), key_(std::move(key)), on_failure_(std::move(on_failure)), most_bytes_(most_bytes) {}

ArrayStore ArrayStore::WithKey(const std::string& key) const { return {folder_, key, on_failure_, most_bytes_}; }

std::unique_ptr<HostLock> ArrayStore::Lock(const CancellationToken* cancellation) const {
  fs::path file = FileOf("lock");
  file.replace_extension(".lock");
  return HostLock::Acquire(file, [&] { return cancellation == nullptr || !cancellation->cancelled(); });
}

std::shared_ptr<SharedPool> ArrayStore::Pool(const std::string& name) const {
  fs::path file = FileOf(name);
  file.replace_extension(kPoolExtension);
  return SharedPool::Open(file);
}

fs::path ArrayStore::FileOf(const std::string& name) const {
  const std::string whole = key_ + "/" + name;
  const XXH128_hash_t hash = XXH3_128bits(whole.data(), whole.size());
  return folder_ / fmt::format("{:016x}{:016x}{}", hash.high64, hash.low64, kExtension);
}

std::optional<ArrayStore::Found> ArrayStore::Find(const std::string& name, std::size_t count,
                                                  std::size_t element) const {
  const fs::path path = FileOf(name);
  const auto file = MappedFile::Open(path);
  if (!file) return std::nullopt;
  const std::string_view bytes = file->bytes();
  const std::string key = key_ + "/" + name;
  const auto sizes = SizesIn(bytes, key);
  if (!sizes || sizes->size() != count) return std::nullopt;
  Found found{file, {}};
  std::size_t at = HeadOf(std::vector<std::span<const std::byte>>(count), key).size();
  for (const std::size_t size : *sizes) {
    at = Aligned(at);
    if (size % element != 0 || at > bytes.size() || size > bytes.size() - at) return std::nullopt;
    found.arrays.emplace_back(reinterpret_cast<const std::byte*>(bytes.data()) + at, size);
    at += size;
  }
  std::uint64_t sum = 0;
  if (bytes.size() - at != sizeof(sum)) return std::nullopt;
  std::memcpy(&sum, bytes.data() + at, sizeof(sum));
  if (sum != XXH3_64bits(bytes.data(), at)) return std::nullopt;
  std::error_code ignored;
  fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);  // used now
  return found;
}

bool ArrayStore::Write(const std::string& name, const std::vector<std::span<const std::byte>>& arrays) const {
  try {
    std::error_code error;
    fs::create_directories(folder_, error);
    std::uintmax_t bytes = 0;
    for (const auto& array : arrays) bytes += array.size();
    MakeRoom(bytes);
    SummingWriter out(FileOf(name).string());
    out.Write(HeadOf(arrays, key_ + "/" + name));
    for (const auto& array : arrays) {
      out.Align();
      out.Write({reinterpret_cast<const char*>(array.data()), array.size()});
    }
    out.Commit();
    return true;
  } catch (const InputError& error) {
    if (on_failure_) on_failure_(error.what());
    return false;
  }
}

void ArrayStore::MakeRoom(std::uintmax_t bytes) const {
  struct File {
    fs::file_time_type used;
    fs::path path;
    std::uintmax_t size;
  };
  std::vector<File> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (entry.path().extension() != kExtension && entry.path().extension() != kPoolExtension) continue;
    std::error_code gone;
    const File file{entry.last_write_time(gone), entry.path(), entry.file_size(gone)};
    if (gone) continue;
    files.push_back(file);
    bytes += file.size;
  }
  std::ranges::sort(files, {}, &File::used);
  for (const File& file : files) {
    if (bytes <= most_bytes_) return;
    fs::remove(file.path, error);
    bytes -= file.size;
  }
}

}  // namespace feeler::planner
