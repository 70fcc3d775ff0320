#pragma once

#include <cstddef>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "feeler/core/lattice.h"

namespace feeler::policies {

/// Largest text file that is read, in bytes.
inline constexpr std::size_t kMaxTextFile = std::size_t{1} << 26;

/// The file's bytes. Throws InputError if it cannot be read or is larger than `max_bytes`.
std::string ReadTextFile(const std::string& path, std::size_t max_bytes = kMaxTextFile);

/// Parses JSON, stricter than the library: no key twice in an object, at most `max_depth` levels. Throws InputError
/// that names line and column.
nlohmann::json ParseJson(std::string_view text, const std::string& where, int max_depth = 8);

/// A value in a JSON document that knows its place, for readers that check everything. All accessors throw InputError
/// naming file and field (`file, hypotheses[3][0]`). Refers to the document and to its parent; keep both.
class JsonField {
 public:
  JsonField(const nlohmann::json& document, const std::string& file) : value_(document), file_(file) {}

  /// Throws unless it is an object with all the required keys and, beside the optional ones, no other.
  void RequireKeys(std::initializer_list<std::string_view> required,
                   std::initializer_list<std::string_view> optional = {}) const;
  bool Has(std::string_view key) const { return value_.is_object() && value_.contains(key); }
  /// A member, which must exist (RequireKeys).
  JsonField operator[](const char* key) const { return {value_.at(key), *this, key, 0}; }
  JsonField operator[](std::size_t index) const { return {value_.at(index), *this, nullptr, index}; }

  /// Number of elements; throws unless it is a list of at least `min` and at most `max`.
  std::size_t ListSize(std::size_t min, std::size_t max) const;
  /// Throws unless it is a whole number (written without point or exponent) in min..max.
  int Integer(int min, int max) const;
  /// Throws unless it is a finite number >= min.
  double Number(double min) const;
  bool IsList() const { return value_.is_array(); }
  bool Boolean() const;
  std::string Text() const;
  /// A list of three whole numbers.
  Cell AsCell(int min, int max) const;

  [[noreturn]] void Fail(const std::string& what, const std::string& mend) const;

 private:
  JsonField(const nlohmann::json& value, const JsonField& parent, const char* key, std::size_t index)
      : value_(value), file_(parent.file_), parent_(&parent), key_(key), index_(index) {}
  std::string Place() const;
  std::string Shown() const;

  const nlohmann::json& value_;
  const std::string& file_;
  const JsonField* parent_ = nullptr;
  const char* key_ = nullptr;  // null: element `index_` of a list
  std::size_t index_ = 0;
};

/// [x, y, z].
inline nlohmann::json CellJson(const Cell& c) { return nlohmann::json::array({c.x(), c.y(), c.z()}); }

}  // namespace feeler::policies
