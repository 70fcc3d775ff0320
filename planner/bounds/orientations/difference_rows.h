#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "feeler/planner/arrays/shared_array.h"

namespace feeler::planner {

/// A table of many values a cell, one a lane, kept small and exact. Along a way that tells nothing all lanes grow by
/// what a step costs them, so cells have their differences from a common share with many others: a cell keeps its
/// share, at most 255, and the number of its row of differences, together in a word: what is looked up lies far apart.
///
/// value(cell, lane) = difference + times(lane) * share(cell), for whole times(lane); differences from kAsIs on are the
/// value itself.
template <class T>
class DifferenceRows {
 public:
  static constexpr T kAsIs = std::numeric_limits<T>::max() - 1;

  /// The values of one lane by cell. The table must outlive it.
  struct Lane {
    const T* differences = nullptr;  ///< null: no lane
    const std::uint32_t* cells = nullptr;
    std::uint32_t lanes = 1;
    T times = 0;
    T operator[](std::size_t cell) const {
      const std::uint32_t word = cells[cell];
      const T difference = differences[std::size_t{word >> kShareBits} * lanes];
      return difference >= kAsIs ? difference : static_cast<T>(difference + times * (word & kMostShare));
    }
  };

  DifferenceRows() = default;
  /// `times` by lane; `fill(cell, values)` writes the values of all lanes of a cell.
  DifferenceRows(std::size_t cells, const std::vector<T>& times,
                 const std::function<void(std::size_t cell, std::span<T> values)>& fill);

  /// `lanes` and `times` as the table was made with.
  Lane Of(std::size_t lane, std::size_t lanes, T times) const {
    return {differences_.data() + lane, cells_.data(), static_cast<std::uint32_t>(lanes), times};
  }
  std::size_t bytes() const { return cells_.bytes() + differences_.bytes(); }
  /// What the table is made of, for whoever keeps it.
  SharedArray<T>* differences() { return &differences_; }
  SharedArray<std::uint32_t>* cells() { return &cells_; }

 private:
  static constexpr int kShareBits = 8;
  static constexpr std::uint32_t kMostShare = (1U << kShareBits) - 1;

  SharedArray<std::uint32_t> cells_;  ///< number of the row and share
  SharedArray<T> differences_;        ///< row after row
};

extern template class DifferenceRows<std::uint8_t>;
extern template class DifferenceRows<std::uint16_t>;

}  // namespace feeler::planner
