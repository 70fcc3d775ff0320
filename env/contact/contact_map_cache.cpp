#include "feeler/env/contact/contact_map_cache.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/env/model/fingerprint.h"

namespace feeler::env {
namespace {

namespace fs = std::filesystem;
using planner::ContactMap;

static_assert(std::endian::native == std::endian::little, "contact-map files are little-endian");

constexpr std::string_view kMagic = "FEELERCM";
constexpr std::uint32_t kVersion = 1;
constexpr std::int64_t kMaxCells = std::int64_t{1} << 31;

/// Layout: magic, version u32, orientations u32, domain min and max i32 x 6, phase f64 x 3, margin f64, then per layer
/// the blocked flags and the six travel tables, then XXH3 (64 bits) of all before it.
class Writer {
 public:
  template <class T>
  void Put(const T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const char* begin = reinterpret_cast<const char*>(values);
    bytes_.insert(bytes_.end(), begin, begin + count * sizeof(T));
  }
  template <class T>
  void Put(const T& value) {
    Put(&value, 1);
  }
  std::vector<char>& bytes() { return bytes_; }

 private:
  std::vector<char> bytes_;
};

class Reader {
 public:
  Reader(const std::vector<char>& bytes, const fs::path& file) : bytes_(bytes), file_(file) {}
  template <class T>
  void Get(T* values, std::size_t count) {
    if (count * sizeof(T) > bytes_.size() - at_) Fail("is truncated");
    std::memcpy(values, bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  template <class T>
  T Get() {
    T value;
    Get(&value, 1);
    return value;
  }
  std::size_t left() const { return bytes_.size() - at_; }
  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(file_.string(), "the contact map " + what, "it is built anew when the task is used");
  }

 private:
  const std::vector<char>& bytes_;
  const fs::path& file_;
  std::size_t at_ = 0;
};

}  // namespace

fs::path CacheFolder() {
  const auto variable = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
  };
  if (const fs::path folder = variable("FEELER_CACHE_DIR"); !folder.empty()) return folder;
  if (const fs::path folder = variable("XDG_CACHE_HOME"); !folder.empty()) return folder / "feeler";
  if (const fs::path folder = variable("HOME"); !folder.empty()) return folder / ".cache" / "feeler";
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  return (error ? fs::path("/tmp") : folder) / "feeler-cache";
}

bool StoreContactMap(const fs::path& file, const ContactMap& map) {
  Writer writer;
  writer.Put(kMagic.data(), kMagic.size());
  writer.Put(kVersion);
  writer.Put(static_cast<std::uint32_t>(map.orientations()));
  for (const Cell& corner : {map.domain().min, map.domain().max}) writer.Put(corner.data(), 3);
  writer.Put(map.phase().data(), 3);
  writer.Put(map.margin_cells());
  for (int i = 0; i < map.orientations(); ++i) {
    const ContactMap::Layer& layer = map.layer(i);
    writer.Put(layer.blocked.data(), layer.blocked.size());
    for (const auto& travel : layer.travel) writer.Put(travel.data(), travel.size());
  }
  writer.Put(std::uint64_t{XXH3_64bits(writer.bytes().data(), writer.bytes().size())});

  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  try {
    WriteFileAtomically(file.string(), {writer.bytes().data(), writer.bytes().size()});
    return true;
  } catch (const InputError&) {  // no room, no permission, or another process is at it: the map is built again
    return false;
  }
}

ContactMap ReadContactMap(const fs::path& file) {
  // Maps over orientation come to hundreds of megabytes: read in one piece.
  std::error_code error;
  const auto size = fs::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  std::vector<char> bytes(error ? 0 : static_cast<std::size_t>(size));
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (error || !in)
    throw InputError(file.string(), "the contact map cannot be read", "it is built anew when it is needed");
  Reader reader(bytes, file);
  std::array<char, kMagic.size()> magic{};
  reader.Get(magic.data(), magic.size());
  if (std::string_view(magic.data(), magic.size()) != kMagic) reader.Fail("has another format");
  if (const auto version = reader.Get<std::uint32_t>(); version != kVersion) {
    reader.Fail("has format version " + std::to_string(version) + " instead of " + std::to_string(kVersion));
  }
  std::uint64_t checksum = 0;
  if (reader.left() < sizeof(checksum)) reader.Fail("is truncated");
  const std::size_t content = bytes.size() - sizeof(checksum);
  std::memcpy(&checksum, bytes.data() + content, sizeof(checksum));
  if (checksum != XXH3_64bits(bytes.data(), content)) reader.Fail("is damaged (checksum)");

  const auto orientations = reader.Get<std::uint32_t>();
  CellBox domain;
  reader.Get(domain.min.data(), 3);
  reader.Get(domain.max.data(), 3);
  Eigen::Vector3d phase;
  reader.Get(phase.data(), 3);
  const auto margin_cells = reader.Get<double>();
  const std::int64_t count = domain.Count();
  if (count <= 0 || count > kMaxCells) reader.Fail("has an absurd size");
  std::vector<ContactMap::Layer> layers(0);
  for (std::uint32_t i = 0; i < orientations; ++i) {
    ContactMap::Layer layer;
    layer.blocked.resize(static_cast<std::size_t>(count));
    reader.Get(layer.blocked.data(), layer.blocked.size());
    for (auto& travel : layer.travel) {
      travel.resize(static_cast<std::size_t>(count));
      reader.Get(travel.data(), travel.size());
    }
    layers.push_back(std::move(layer));
  }
  return ContactMap(domain, std::move(layers), phase, margin_cells);
}

ContactMap GetContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism,
                         const ProgressCallback& progress) {
  const fs::path file = CacheFolder() / (ContactMapFingerprint(task_model, opening) + ".contact-map");
  std::error_code error;
  if (fs::exists(file, error)) {
    try {
      return ReadContactMap(file);
    } catch (const InputError&) {
      // Damaged or of another version: built anew below, which replaces it.
    }
  }
  ContactMap map = BuildContactMap(task_model, opening, parallelism, progress);
  StoreContactMap(file, map);
  return map;
}

}  // namespace feeler::env
