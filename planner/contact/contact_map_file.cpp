#include "feeler/planner/contact/contact_map_file.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"

namespace feeler::planner {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "contact-map files are little-endian");

constexpr std::string_view kMagic = "FEELERCM";
constexpr std::uint32_t kVersion = 1;
constexpr std::int64_t kMaxCells = std::int64_t{1} << 31;

/// Layout: magic, version u32, orientations u32, domain min and max i32 x 6, phase f64 x 3, margin f64, then per layer
/// the blocked flags and the six travel tables, then XXH3 (64 bits) of all before it.
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
    const ContactMap::Layer& layer = map.layer(i);
    writer.Put(layer.blocked.data(), layer.blocked.size());
    for (const auto& travel : layer.travel) writer.Put(travel.data(), travel.size());
  }
  writer.Put(std::uint64_t{XXH3_64bits(writer.bytes().data(), writer.bytes().size())});
  return std::move(writer.bytes());
}

ContactMap DecodeContactMap(std::string_view bytes, const std::string& where) {
  MapReader reader(bytes, where);
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

void WriteContactMap(const fs::path& file, const ContactMap& map) {
  std::error_code ignored;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), ignored);
  WriteFileAtomically(file.string(), EncodeContactMap(map));
}

ContactMap ReadContactMap(const fs::path& file) {
  // Maps over orientation come to hundreds of megabytes: read in one piece.
  std::error_code error;
  const auto size = fs::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  std::string bytes(error ? 0 : static_cast<std::size_t>(size), '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (error || !in)
    throw InputError(file.string(), "the contact map cannot be read", "check that the file is there and may be read");
  return DecodeContactMap(bytes, file.string());
}

}  // namespace feeler::planner
