#include "feeler/policies/io/json_input.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <set>
#include <system_error>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::policies {
namespace {

using nlohmann::json;

constexpr std::size_t kShownLength = 120;

/// The library's message without its prefix, and short.
std::string Reason(const json::exception& error) {
  std::string text = error.what();
  if (const std::size_t end = text.find("] "); end != std::string::npos) text = text.substr(end + 2);
  if (text.size() > kShownLength) text = text.substr(0, kShownLength) + "...";
  return text;
}

}  // namespace

std::string ReadTextFile(const std::string& path, std::size_t max_bytes) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) {
    throw InputError(path, "cannot be read: " + std::generic_category().message(errno), "check the name");
  }
  if (S_ISDIR(status.st_mode)) throw InputError(path, "is a directory", "give the name of a file");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw InputError(path, "cannot be read: " + std::generic_category().message(errno), "check its permissions");
  std::string text;
  std::vector<char> chunk(1 << 16);
  while (file.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || file.gcount() > 0) {
    text.append(chunk.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > max_bytes) {
      throw InputError(path, fmt::format("is larger than {} bytes", max_bytes), "give a smaller file");
    }
  }
  return text;
}

json ParseJson(std::string_view text, const std::string& where, int max_depth) {
  std::vector<std::set<std::string>> keys;  // of the objects and lists that are open
  const auto check = [&](int, json::parse_event_t event, json& value) {
    switch (event) {
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        keys.emplace_back();
        if (static_cast<int>(keys.size()) > max_depth) {
          throw InputError(where, fmt::format("is nested deeper than {} levels", max_depth), "check the format");
        }
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end: keys.pop_back(); break;
      case json::parse_event_t::key:
        if (!keys.back().insert(value.get<std::string>()).second) {
          throw InputError(where, "has the key \"" + value.get<std::string>() + "\" twice", "remove one");
        }
        break;
      case json::parse_event_t::value: break;
    }
    return true;
  };
  try {
    return json::parse(text, check);
  } catch (const json::exception& error) {
    throw InputError(where, "is not valid JSON: " + Reason(error), "check that the file is whole");
  }
}

std::string JsonField::Place() const {
  if (parent_ == nullptr) return "";
  const std::string outer = parent_->Place();
  if (key_ == nullptr) return fmt::format("{}[{}]", outer, index_);
  return outer.empty() ? key_ : outer + "." + key_;
}

std::string JsonField::Shown() const {
  if (value_.is_object()) return "an object";
  if (value_.is_array()) return "a list";
  std::string text = value_.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > kShownLength) text = text.substr(0, kShownLength) + "...";
  return text;
}

void JsonField::Fail(const std::string& what, const std::string& mend) const {
  const std::string place = Place();
  throw InputError(place.empty() ? file_ : file_ + ", " + place, what, mend);
}

void JsonField::RequireKeys(std::initializer_list<std::string_view> required,
                            std::initializer_list<std::string_view> optional) const {
  if (!value_.is_object()) Fail("is " + Shown() + ", not an object", "write {...}");
  for (const std::string_view key : required) {
    if (!value_.contains(key)) Fail(fmt::format("\"{}\" is missing", key), "add it");
  }
  for (const auto& [key, value] : value_.items()) {
    const auto is_key = [&key = key](std::string_view known) { return known == key; };
    if (std::any_of(required.begin(), required.end(), is_key)) continue;
    if (std::any_of(optional.begin(), optional.end(), is_key)) continue;
    Fail("has the unknown key " + json(key).dump(-1, ' ', true, json::error_handler_t::replace),
         "remove or correct it");
  }
}

std::size_t JsonField::ListSize(std::size_t min, std::size_t max) const {
  if (!value_.is_array()) Fail("is " + Shown() + ", not a list", "write [...]");
  const std::size_t size = value_.size();
  if (size >= min && size <= max) return size;
  if (min == max) Fail(fmt::format("has {} elements, not {}", size, min), fmt::format("give exactly {}", min));
  if (size < min) Fail(fmt::format("has {} elements, needs at least {}", size, min), "add what is missing");
  Fail(fmt::format("has {} elements, more than {}", size, max), "give fewer");
}

int JsonField::Integer(int min, int max) const {
  if (!value_.is_number_integer())
    Fail("is " + Shown() + ", not a whole number", fmt::format("give one in {}..{}", min, max));
  // Unsigned values beyond the signed range must not wrap around.
  const bool huge = value_.is_number_unsigned() && value_.get<std::uint64_t>() > std::uint64_t{1} << 62;
  if (huge || value_.get<std::int64_t>() < min || value_.get<std::int64_t>() > max) {
    Fail(fmt::format("is {}, not in {}..{}", Shown(), min, max), "give a whole number in that range");
  }
  return value_.get<int>();
}

double JsonField::Number(double min) const {
  if (!value_.is_number()) Fail("is " + Shown() + ", not a number", fmt::format("give a finite number >= {}", min));
  const double number = value_.get<double>();
  if (!std::isfinite(number) || number < min) {
    Fail("is " + Shown() + ", out of range", fmt::format("give a finite number >= {}", min));
  }
  return number;
}

bool JsonField::Boolean() const {
  if (!value_.is_boolean()) Fail("is " + Shown() + ", not true or false", "write true or false");
  return value_.get<bool>();
}

std::string JsonField::Text() const {
  if (!value_.is_string()) Fail("is " + Shown() + ", not a text", "put it in quotes");
  return value_.get<std::string>();
}

Cell JsonField::AsCell(int min, int max) const {
  ListSize(3, 3);
  const JsonField& list = *this;
  return {list[std::size_t{0}].Integer(min, max), list[std::size_t{1}].Integer(min, max),
          list[std::size_t{2}].Integer(min, max)};
}

}  // namespace feeler::policies
