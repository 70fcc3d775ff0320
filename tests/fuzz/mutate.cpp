#include "tests/fuzz/mutate.h"

#include <algorithm>
#include <array>

namespace feeler::fuzz {
namespace {

using namespace std::string_view_literals;

constexpr std::array kWords = {"0"sv,
                               "-1"sv,
                               "1e308"sv,
                               "-1e-308"sv,
                               "nan"sv,
                               "inf"sv,
                               "2147483648"sv,
                               "4294967295"sv,
                               "18446744073709551616"sv,
                               "9223372036854775807"sv,
                               "null"sv,
                               "true"sv,
                               "\"\""sv,
                               "[]"sv,
                               "{}"sv,
                               "\\u0000"sv,
                               "\xef\xbb\xbf"sv,
                               "\xff\xfe"sv,
                               "\x1b[2J"sv,
                               "\r"sv,
                               "\n"sv,
                               " "sv,
                               "\0"sv,
                               "1,5"sv,
                               "0x10"sv,
                               "..."sv,
                               "x"sv,
                               "element"sv,
                               "property list"sv,
                               "DATA binary"sv,
                               "COUNT 4294967295"sv,
                               "\"nodes\":"sv};

std::size_t Place(const std::string& bytes, RandomStream& random) { return random.Index(bytes.size() + 1); }

std::string Piece(const std::string& of, RandomStream& random) {
  if (of.empty()) return "";
  const std::size_t begin = random.Index(of.size());
  return of.substr(begin, 1 + random.Index(std::min<std::size_t>(of.size() - begin, 64)));
}

void ReplaceNumber(std::string& bytes, RandomStream& random) {
  const std::size_t from = bytes.find_first_of("0123456789", Place(bytes, random));
  if (from == std::string::npos) return;
  const std::size_t end = std::min(bytes.find_first_not_of("0123456789.eE+-", from), bytes.size());
  bytes.replace(from, end - from, kWords[random.Index(kWords.size())]);
}

void ChangeOnce(std::string& bytes, const std::vector<std::string>& seeds, RandomStream& random) {
  const std::size_t at = Place(bytes, random);
  switch (random.Index(10)) {
    case 0:
      if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.Index(8)));
      break;
    case 1:
      if (at < bytes.size()) bytes[at] = static_cast<char>(random.Index(256));
      break;
    case 2: bytes.insert(at, kWords[random.Index(kWords.size())]); break;
    case 3: ReplaceNumber(bytes, random); break;
    case 4: bytes.resize(at); break;
    case 5: bytes.erase(at, 1 + random.Index(32)); break;
    case 6: bytes.insert(at, Piece(bytes, random)); break;
    case 7: bytes.insert(at, Piece(seeds[random.Index(seeds.size())], random)); break;
    case 8:
      if (random.Index(50) == 0) bytes.insert(at, std::string(random.Index(20'000), "[{(\"0 "[random.Index(6)]));
      break;
    default: {
      const std::size_t other = Place(bytes, random);
      if (at < bytes.size() && other < bytes.size()) std::swap(bytes[at], bytes[other]);
    }
  }
}

}  // namespace

std::string Mutate(const std::vector<std::string>& seeds, RandomStream& random, std::size_t most) {
  std::string bytes = seeds[random.Index(seeds.size())];
  for (std::uint64_t changes = 1 + random.Index(8); changes > 0; --changes) ChangeOnce(bytes, seeds, random);
  bytes.resize(std::min(bytes.size(), most));
  return bytes;
}

}  // namespace feeler::fuzz
