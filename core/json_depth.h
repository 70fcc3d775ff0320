#pragma once

#include <string_view>

namespace feeler {

/// Levels that any JSON document of ours may have: those that are read only to be shown included.
inline constexpr int kMostJsonLevels = 64;

/// True if brackets are nested deeper than `levels` anywhere in a JSON text. To be asked before parsing: a parsed
/// document of 100,000 levels overflows the stack where it is copied, written or destroyed.
constexpr bool IsNestedDeeper(std::string_view text, int levels = kMostJsonLevels) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '\\') ++i;
      if (c == '"') quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == '[' || c == '{') {
      if (++depth > levels) return true;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return false;
}

/// The one way to read a JSON text of any origin, where `Json` is nlohmann's: null-like "discarded" for what is no
/// JSON or nested too deep. Never throws on the text's account.
template <class Json>
Json ParseJsonText(std::string_view text, int levels = kMostJsonLevels) {
  if (IsNestedDeeper(text, levels)) return Json(Json::value_t::discarded);
  return Json::parse(text.begin(), text.end(), nullptr, false);
}

}  // namespace feeler
