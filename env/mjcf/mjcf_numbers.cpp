#include "feeler/env/mjcf/mjcf_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <string_view>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

/// Attributes that hold words: a body may be called "infinity".
constexpr std::array<std::string_view, 24> kWords = {
    "name",    "class",  "childclass", "body",   "body1",   "body2",      "geom",         "geom1",
    "geom2",   "joint",  "joint1",     "joint2", "site",    "mesh",       "hfield",       "material",
    "texture", "target", "model",      "file",   "meshdir", "texturedir", "content_type", "objname"};

bool IsWord(std::string_view attribute) { return std::find(kWords.begin(), kWords.end(), attribute) != kWords.end(); }

/// Metres; a world of more is a slip, and its squares are more than contact is computed with.
constexpr double kFarthest_m = 1000;

bool IsLength(std::string_view attribute) {
  return attribute == "pos" || attribute == "size" || attribute == "fromto" || attribute == "center" ||
         attribute == "extent";
}

/// What is wrong with the number that a word spells; empty if it is none or all is well.
std::string_view Fault(std::string_view word, bool length) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::result_out_of_range) return "is beyond what a number holds";
  if (error != std::errc() || end != word.data() + word.size()) return "";
  if (std::isnan(value)) return "is not a number";
  if (std::isinf(value)) return "is not finite";
  return length && std::abs(value) > kFarthest_m ? "is beyond 1000 m" : "";
}

void Check(const tinyxml2::XMLElement& element, const std::string& where) {
  const std::string_view kind = element.Name();
  const bool text = kind == "text";
  for (const auto* attribute = element.FirstAttribute(); attribute != nullptr; attribute = attribute->Next()) {
    if (IsWord(attribute->Name()) || text) continue;
    const bool length = IsLength(attribute->Name()) && kind != "numeric" && kind != "texture";
    std::string_view rest = attribute->Value();
    while (!rest.empty()) {
      const std::size_t begin = rest.find_first_not_of(" \t\r\n");
      if (begin == std::string_view::npos) break;
      rest.remove_prefix(begin);
      const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r\n"));
      if (const std::string_view fault = Fault(word, length); !fault.empty()) {
        const char* name = element.Attribute("name");
        throw InputError(fmt::format("{}: <{}{}> in line {}", where, element.Name(),
                                     name == nullptr ? "" : fmt::format(" name=\"{}\"", name), attribute->GetLineNum()),
                         fmt::format("{}: \"{}\" {}", attribute->Name(), word, fault),
                         "give a finite number, lengths in metres");
      }
      rest.remove_prefix(word.size());
    }
  }
  for (const auto* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    Check(*child, where);
  }
}

}  // namespace

void RequireFiniteNumbers(const tinyxml2::XMLElement& root, const std::string& where) { Check(root, where); }

}  // namespace feeler::env
