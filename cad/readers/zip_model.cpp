#include "feeler/cad/readers/zip_model.h"

#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <string_view>
#include <vector>

namespace feeler::cad {
namespace {

/// Of the archive's end record, central directory and local headers (PKWARE's APPNOTE.TXT, 4.3).
constexpr std::size_t kEndRecord = 22;
constexpr std::size_t kEntry = 46;
constexpr std::size_t kLocal = 30;
constexpr std::size_t kHead = 4096;

std::uint32_t Number(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t k = count; k-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

std::string Bytes(std::ifstream& in, std::uint64_t at, std::size_t count) {
  std::string bytes(count, '\0');
  in.clear();
  in.seekg(static_cast<std::streamoff>(at));
  in.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

std::string Inflated(const std::string& packed) {
  std::string head(kHead, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return {};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(head.data());
  stream.avail_out = static_cast<uInt>(head.size());
  inflate(&stream, Z_SYNC_FLUSH);
  head.resize(kHead - stream.avail_out);
  inflateEnd(&stream);
  return head;
}

}  // namespace

std::optional<ZipModel> PeekZipModel(const std::filesystem::path& file) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(file, error);
  if (error || size < kEndRecord) return std::nullopt;
  std::ifstream in(file, std::ios::binary);
  const std::uint64_t tail_at = size - std::min<std::uint64_t>(size, kEndRecord + 65535);
  const std::string tail = Bytes(in, tail_at, static_cast<std::size_t>(size - tail_at));
  const std::size_t end = tail.rfind("PK\5\6");
  if (end == std::string::npos || end + kEndRecord > tail.size()) return std::nullopt;
  const std::string directory = Bytes(in, Number(tail, end + 16, 4), Number(tail, end + 12, 4));
  std::optional<ZipModel> model;
  for (std::size_t at = 0; at + kEntry <= directory.size() && directory.compare(at, 4, "PK\1\2") == 0;) {
    const std::size_t length = Number(directory, at + 28, 2);
    const std::string_view name = std::string_view(directory).substr(at + kEntry, length);
    const std::uint32_t unpacked = Number(directory, at + 24, 4);
    if (name.ends_with(".model") && (!model || unpacked > model->bytes)) {
      const std::uint64_t local_at = Number(directory, at + 42, 4);
      const std::string local = Bytes(in, local_at, kLocal);
      if (local.size() < kLocal) return std::nullopt;
      const std::string packed =
          Bytes(in, local_at + kLocal + Number(local, 26, 2) + Number(local, 28, 2),
                std::min<std::size_t>(kHead, std::max<std::uint32_t>(Number(directory, at + 20, 4), 1)));
      model = ZipModel{unpacked, Number(directory, at + 10, 2) == 8 ? Inflated(packed) : packed};
    }
    at += kEntry + length + Number(directory, at + 30, 2) + Number(directory, at + 32, 2);
  }
  return model;
}

std::optional<NamedLength> UnitOfModel(const std::string& head) {
  const std::size_t model = head.find("<model");
  if (model == std::string::npos) return std::nullopt;
  const std::string element = head.substr(model, head.find('>', model) - model);
  for (const NamedLength& unit : {NamedLength{"micron", 1e-6},
                                  {"millimeter", 1e-3},
                                  {"centimeter", 1e-2},
                                  {"inch", 0.0254},
                                  {"foot", 0.3048},
                                  {"meter", 1.0}}) {
    for (const char quote : {'"', '\''}) {
      if (element.find(" unit=" + (quote + unit.name) + quote) != std::string::npos) return unit;
    }
  }
  return std::nullopt;
}

}  // namespace feeler::cad
