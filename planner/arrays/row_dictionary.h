#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <unordered_set>
#include <vector>

namespace feeler::planner {

/// Rows of one length, each distinct one stored once, one after the other.
template <class T>
class RowDictionary {
 public:
  explicit RowDictionary(std::size_t length);
  RowDictionary(const RowDictionary&) = delete;
  RowDictionary& operator=(const RowDictionary&) = delete;

  /// Where the row begins in values().
  std::uint32_t Add(std::span<const T> row);
  const std::vector<T>& values() const { return values_; }
  /// Moves the values out; the dictionary is of no use after it.
  std::vector<T> Release();

 private:
  struct Hash {
    const RowDictionary* of;
    std::size_t operator()(std::uint32_t row) const;
  };
  struct Equal {
    const RowDictionary* of;
    bool operator()(std::uint32_t a, std::uint32_t b) const;
  };

  std::size_t length_;
  std::vector<T> values_;
  std::unordered_set<std::uint32_t, Hash, Equal> known_;
};

extern template class RowDictionary<std::uint8_t>;
extern template class RowDictionary<std::uint16_t>;
extern template class RowDictionary<std::uint32_t>;

}  // namespace feeler::planner
