#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::perception {

/// The types of numbers that point files hold.
enum class NumberType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat, kDouble };

inline std::size_t SizeOf(NumberType type) {
  switch (type) {
    case NumberType::kInt8:
    case NumberType::kUint8: return 1;
    case NumberType::kInt16:
    case NumberType::kUint16: return 2;
    case NumberType::kInt32:
    case NumberType::kUint32:
    case NumberType::kFloat: return 4;
    default: return 8;
  }
}

/// Reads a file's bytes from front to back; running past the end throws InputError naming `where`.
class ByteCursor {
 public:
  ByteCursor(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}

  std::size_t left() const { return bytes_.size() - at_; }

  /// The next line without its end (LF, CR LF or CR); at the end of the file an InputError.
  std::string_view Line() {
    if (left() == 0) Fail("is cut off");
    const std::size_t end = bytes_.find_first_of("\r\n", at_);
    const std::string_view line = bytes_.substr(at_, end == std::string_view::npos ? end : end - at_);
    at_ = end == std::string_view::npos ? bytes_.size() : end + 1;
    if (end != std::string_view::npos && bytes_[end] == '\r' && left() > 0 && bytes_[at_] == '\n') ++at_;
    ++lines_;
    return line;
  }

  /// The number of the line that Line() returned last, from 1.
  std::size_t line_number() const { return lines_; }

  /// The bytes that are left.
  std::string_view Rest() const { return bytes_.substr(at_); }

  /// A word as a number; "nan" and what overflows are no finite number. What is no number is an InputError.
  double TextNumber(std::string_view word) const {
    if (word.size() > 1 && word.front() == '+') word.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::infinity();
    if (error != std::errc() || end != word.data() + word.size()) {
      Fail("holds '" + std::string(word.substr(0, 20)) + "' where a number should stand, in line " +
           std::to_string(lines_));
    }
    return value;
  }

  double BinaryNumber(NumberType type, bool big_endian) {
    const std::size_t size = SizeOf(type);
    if (left() < size) Fail("is cut off");
    unsigned char raw[8] = {};
    for (std::size_t i = 0; i < size; ++i) {
      raw[big_endian ? size - 1 - i : i] = static_cast<unsigned char>(bytes_[at_ + i]);
    }
    at_ += size;
    std::uint64_t bits = 0;  // little endian
    for (std::size_t i = 0; i < size; ++i) bits |= std::uint64_t{raw[i]} << (8 * i);
    switch (type) {
      case NumberType::kInt8: return static_cast<std::int8_t>(bits);
      case NumberType::kUint8: return static_cast<std::uint8_t>(bits);
      case NumberType::kInt16: return static_cast<std::int16_t>(bits);
      case NumberType::kUint16: return static_cast<std::uint16_t>(bits);
      case NumberType::kInt32: return static_cast<std::int32_t>(bits);
      case NumberType::kUint32: return static_cast<std::uint32_t>(bits);
      case NumberType::kInt64: return static_cast<double>(static_cast<std::int64_t>(bits));
      case NumberType::kUint64: return static_cast<double>(bits);
      case NumberType::kFloat: {
        const auto word = static_cast<std::uint32_t>(bits);
        float value = 0.0F;
        std::memcpy(&value, &word, sizeof value);
        return double{value};
      }
      default: {
        double value = 0.0;
        std::memcpy(&value, &bits, sizeof value);
        return value;
      }
    }
  }

  void Skip(std::size_t bytes) {
    if (left() < bytes) Fail("is cut off");
    at_ += bytes;
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(where_, what, "give a whole PLY or PCD file, coordinates in metres");
  }

 private:
  std::string_view bytes_;
  const std::string& where_;
  std::size_t at_ = 0;
  std::size_t lines_ = 0;
};

/// The words of one line of numbers, taken one by one; a line with fewer or more of them than are taken is an
/// InputError that names the line.
class LineNumbers {
 public:
  LineNumbers(const ByteCursor& cursor, std::vector<std::string_view> words)
      : cursor_(cursor), words_(std::move(words)) {}

  double Next() {
    if (next_ == words_.size()) Refuse("too few");
    return cursor_.TextNumber(words_[next_++]);
  }

  void End() const {
    if (next_ != words_.size()) Refuse("too many");
  }

 private:
  [[noreturn]] void Refuse(const char* what) const {
    const bool last = cursor_.left() == 0 && next_ == words_.size();
    cursor_.Fail((last ? "is cut off: it has " : "has ") + std::string(what) + " numbers (" +
                 std::to_string(words_.size()) + ") in line " + std::to_string(cursor_.line_number()));
  }

  const ByteCursor& cursor_;
  std::vector<std::string_view> words_;
  std::size_t next_ = 0;
};

/// The words of a line.
inline std::vector<std::string_view> Words(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; at < line.size();) {
    if (line[at] == ' ' || line[at] == '\t') {
      ++at;
      continue;
    }
    std::size_t end = at;
    while (end < line.size() && line[end] != ' ' && line[end] != '\t') ++end;
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

/// A word with its letters a to z as capitals.
inline std::string Upper(std::string_view word) {
  std::string upper(word);
  for (char& c : upper) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return upper;
}

}  // namespace feeler::perception
