#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace feeler::policies {

/// Appends numbers to a byte string. Integers as little-endian base-128 varints (signed ones zigzag-folded first, so
/// that small magnitudes stay short), doubles as their 8 bytes.
class ByteWriter {
 public:
  void Varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<char>(value | 0x80));
    bytes_.push_back(static_cast<char>(value));
  }
  void Signed(std::int64_t value) {
    Varint((static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63));
  }
  void Fixed32(std::uint32_t value) {
    for (int i = 0; i < 4; ++i) bytes_.push_back(static_cast<char>(value >> (8 * i)));
  }
  void Fixed64(std::uint64_t value) {
    for (int i = 0; i < 8; ++i) bytes_.push_back(static_cast<char>(value >> (8 * i)));
  }
  void Double(double value) { Fixed64(std::bit_cast<std::uint64_t>(value)); }
  /// Length, then the bytes.
  void Text(std::string_view text) {
    Varint(text.size());
    bytes_.append(text);
  }
  const std::string& bytes() const { return bytes_; }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads what ByteWriter wrote from bytes that may be anything: a read past the end or a malformed varint sets `failed`
/// and yields zero from there on, so that a decoder can read a whole section and check once.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t Varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const std::uint64_t byte = Byte();
      if (failed_) return 0;
      // The tenth byte holds the 64th bit alone; a final zero byte would be a second spelling of the same number.
      if ((shift == 63 && byte > 1) || (shift > 0 && byte == 0)) return Fail();
      value |= (byte & 0x7F) << shift;
      if (byte < 0x80) return value;
    }
    return Fail();
  }
  std::int64_t Signed() {
    const std::uint64_t folded = Varint();
    return static_cast<std::int64_t>((folded >> 1) ^ (~(folded & 1) + 1));
  }
  std::uint32_t Fixed32() { return static_cast<std::uint32_t>(Fixed(4)); }
  std::uint64_t Fixed64() { return Fixed(8); }
  double Double() { return std::bit_cast<double>(Fixed64()); }
  std::size_t remaining() const { return bytes_.size() - position_; }
  std::string_view rest() const { return bytes_.substr(position_); }
  bool failed() const { return failed_; }

 private:
  std::uint64_t Byte() {
    if (failed_ || position_ == bytes_.size()) return Fail();
    return static_cast<unsigned char>(bytes_[position_++]);
  }
  std::uint64_t Fixed(int count) {
    std::uint64_t value = 0;
    for (int i = 0; i < count; ++i) value |= Byte() << (8 * i);
    return failed_ ? 0 : value;
  }
  std::uint64_t Fail() {
    failed_ = true;
    return 0;
  }

  std::string_view bytes_;
  std::size_t position_ = 0;
  bool failed_ = false;
};

}  // namespace feeler::policies
