#include "feeler/planner/contact/contact_map_file.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/planner/arrays/mapped_file.h"

namespace feeler::planner {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "contact-map files are little-endian");

constexpr std::string_view kMagic = "FEELERCM";
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kAlignment = 64;  // of an array, from the beginning of the file
constexpr std::int64_t kMaxCells = std::int64_t{1} << 31;

/// Layout: magic, version u32, orientations u32, domain min and max i32 x 6, phase f64 x 3, margin f64, then per layer
/// the blocked flags and the six travel tables, each from a multiple of 64 bytes on, then XXH3 (64 bits) of all before
/// it. In version 1 they follow without a gap.
class MapWriter {
 public:
  template <class T>
  void Put(const T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const char* begin = reinterpret_cast<const char*>(values);
    bytes_.append(begin, count * sizeof(T));
  }
  template <class T>
  void Put(const T& value) {
    Put(&value, 1);
  }
  void Align() { bytes_.resize((bytes_.size() + kAlignment - 1) / kAlignment * kAlignment, '\0'); }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

class MapReader {
 public:
  MapReader(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}
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
  void Align() { at_ = std::min(bytes_.size(), (at_ + kAlignment - 1) / kAlignment * kAlignment); }
  /// An array where it lies.
  template <class T>
  std::span<const T> See(std::size_t count) {
    Align();
    if (count > (bytes_.size() - at_) / sizeof(T)) Fail("is truncated");
    const std::span<const T> values(reinterpret_cast<const T*>(bytes_.data() + at_), count);
    at_ += values.size_bytes();
    return values;
  }
  std::size_t left() const { return bytes_.size() - at_; }
  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(where_, "the contact map " + what, "move the file away: it is built anew");
  }

 private:
  std::string_view bytes_;
  const std::string& where_;
  std::size_t at_ = 0;
};

}  // namespace

std::string EncodeContactMap(const ContactMap& map) {
  MapWriter writer;
  writer.Put(kMagic.data(), kMagic.size());
  writer.Put(kVersion);
  writer.Put(static_cast<std::uint32_t>(map.orientations()));
  for (const Cell& corner : {map.domain().min, map.domain().max}) writer.Put(corner.data(), 3);
  writer.Put(map.phase().data(), 3);
  writer.Put(map.margin_cells());
  for (int i = 0; i < map.orientations(); ++i) {
    const ContactMap::LayerView& layer = map.layer(i);
    writer.Align();
    writer.Put(layer.blocked.data(), layer.blocked.size());
    for (const auto& travel : layer.travel) {
      writer.Align();
      writer.Put(travel.data(), travel.size());
    }
  }
  writer.Put(std::uint64_t{XXH3_64bits(writer.bytes().data(), writer.bytes().size())});
  return std::move(writer.bytes());
}

namespace {

struct Head {
  std::uint32_t version = 0;
  std::uint32_t orientations = 0;
  CellBox domain;
  Eigen::Vector3d phase;
  double margin_cells = 0.0;
};

/// What comes before the layers, and whether the checksum fits.
Head ReadHead(std::string_view bytes, MapReader& reader) {
  Head head;
  std::array<char, kMagic.size()> magic{};
  reader.Get(magic.data(), magic.size());
  if (std::string_view(magic.data(), magic.size()) != kMagic) reader.Fail("has another format");
  head.version = reader.Get<std::uint32_t>();
  if (head.version < 1 || head.version > kVersion) {
    reader.Fail("has format version " + std::to_string(head.version) + " instead of " + std::to_string(kVersion));
  }
  std::uint64_t checksum = 0;
  if (reader.left() < sizeof(checksum)) reader.Fail("is truncated");
  const std::size_t content = bytes.size() - sizeof(checksum);
  std::memcpy(&checksum, bytes.data() + content, sizeof(checksum));
  if (checksum != XXH3_64bits(bytes.data(), content)) reader.Fail("is damaged (checksum)");
  head.orientations = reader.Get<std::uint32_t>();
  reader.Get(head.domain.min.data(), 3);
  reader.Get(head.domain.max.data(), 3);
  reader.Get(head.phase.data(), 3);
  head.margin_cells = reader.Get<double>();
  if (head.domain.Count() <= 0 || head.domain.Count() > kMaxCells) reader.Fail("has an absurd size");
  return head;
}

/// Layers where they lie, in memory that `owner` keeps.
ContactMap SeeLayers(const Head& head, MapReader& reader, std::shared_ptr<const void> owner) {
  const auto count = static_cast<std::size_t>(head.domain.Count());
  std::vector<ContactMap::LayerView> layers;
  for (std::uint32_t i = 0; i < head.orientations; ++i) {
    ContactMap::LayerView& layer = layers.emplace_back();
    layer.blocked = reader.See<std::uint8_t>(count);
    for (auto& travel : layer.travel) travel = reader.See<float>(count);
  }
  return ContactMap(head.domain, std::move(layers), std::move(owner), head.phase, head.margin_cells);
}

}  // namespace

ContactMap DecodeContactMap(std::string_view bytes, const std::string& where) {
  MapReader reader(bytes, where);
  const Head head = ReadHead(bytes, reader);
  const auto count = static_cast<std::size_t>(head.domain.Count());
  std::vector<ContactMap::Layer> layers;
  const auto get = [&](auto& values) {
    if (head.version > 1) reader.Align();
    values.resize(count);
    reader.Get(values.data(), count);
  };
  for (std::uint32_t i = 0; i < head.orientations; ++i) {
    ContactMap::Layer& layer = layers.emplace_back();
    get(layer.blocked);
    for (auto& travel : layer.travel) get(travel);
  }
  return ContactMap(head.domain, std::move(layers), head.phase, head.margin_cells);
}

void WriteContactMap(const fs::path& file, const ContactMap& map) {
  std::error_code ignored;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), ignored);
  WriteFileAtomically(file.string(), EncodeContactMap(map));
}

ContactMap ReadContactMap(const fs::path& file) {
  const auto mapped = MappedFile::Open(file);
  if (!mapped)
    throw InputError(file.string(), "the contact map cannot be read", "check that the file is there and may be read");
  const std::string where = file.string();
  MapReader reader(mapped->bytes(), where);
  const Head head = ReadHead(mapped->bytes(), reader);
  if (head.version < kVersion) return DecodeContactMap(mapped->bytes(), where);
  return SeeLayers(head, reader, mapped);
}

}  // namespace feeler::planner
