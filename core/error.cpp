#include "feeler/core/error.h"

#include <cstddef>

#include "feeler/core/printable.h"

namespace feeler {
namespace {

// Longest parts of a message, in bytes: a path or a field, what is wrong with it, and a list to choose from.
constexpr std::size_t kMostWhere = 240;
constexpr std::size_t kMostWhat = 480;
constexpr std::size_t kMostMend = 1600;

/// Length of the UTF-8 character that begins at `i` (RFC 3629: no overlong forms, no surrogates), or 0.
std::size_t Utf8Length(const std::string& text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
  const unsigned first = byte(i);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xc2 && first <= 0xdf   ? 2
                             : first >= 0xe0 && first <= 0xef ? 3
                             : first >= 0xf0 && first <= 0xf4 ? 4
                                                              : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(i + k) & 0xc0) != 0x80) return 0;
  }
  const unsigned second = byte(i + 1);
  const bool overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
  const bool beyond = (first == 0xed && second > 0x9f) || (first == 0xf4 && second > 0x8f);
  return overlong || beyond ? 0 : length;
}

void AppendEscaped(char c, std::string& shown) {
  constexpr char kDigits[] = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(c);
  shown += "\\x";
  shown += kDigits[byte >> 4];
  shown += kDigits[byte & 15];
}

std::string OneLine(const std::string& where, const std::string& what, const std::string& mend) {
  std::string line = Printable(where, kMostWhere) + ": " + Printable(what, kMostWhat);
  if (!mend.empty()) line += " (" + Printable(mend, kMostMend) + ")";
  return line;
}

}  // namespace

std::string Printable(const std::string& text, std::size_t most) {
  std::string shown;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = Utf8Length(text, i);
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte == '\n' || byte == '\r' || byte == '\t') {
      shown += ' ';
      ++i;
    } else if (length == 0 || byte < 0x20 || byte == 0x7f) {
      AppendEscaped(text[i++], shown);
    } else if (length == 2 && byte == 0xc2 && static_cast<unsigned char>(text[i + 1]) < 0xa0) {  // C1: U+0080 to U+009F
      AppendEscaped(text[i], shown);
      AppendEscaped(text[i + 1], shown);
      i += 2;
    } else {
      shown.append(text, i, length);
      i += length;
    }
  }
  if (shown.size() <= most) return shown;
  const auto inside = [&](std::size_t k) { return (static_cast<unsigned char>(shown[k]) & 0xc0) == 0x80; };
  std::size_t head = most / 2;
  std::size_t tail = shown.size() - (most - most / 2);
  while (head > 0 && inside(head)) --head;
  while (tail < shown.size() && inside(tail)) ++tail;
  return shown.substr(0, head) + " ... " + shown.substr(tail);
}

Error::Error(const std::string& where, const std::string& what, const std::string& mend)
    : std::runtime_error(OneLine(where, what, mend)) {}

}  // namespace feeler
