#include "feeler/planner/bounds/orientations/difference_rows.h"

#include <algorithm>
#include <utility>

#include "feeler/planner/arrays/row_dictionary.h"

namespace feeler::planner {

template <class T>
DifferenceRows<T>::DifferenceRows(std::size_t cells, const std::vector<T>& times,
                                  const std::function<void(std::size_t cell, std::span<T> values)>& fill) {
  const std::size_t lanes = times.size();
  std::vector<std::uint32_t> words(cells);
  RowDictionary<T> differences(lanes);
  std::vector<T> row(lanes);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    fill(cell, row);
    std::uint32_t share = kMostShare;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (times[lane] > 0 && row[lane] < kAsIs) share = std::min<std::uint32_t>(share, row[lane] / times[lane]);
    }
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (row[lane] < kAsIs) row[lane] = static_cast<T>(row[lane] - times[lane] * share);
    }
    words[cell] = static_cast<std::uint32_t>(differences.Add(row) / lanes) << kShareBits | share;
  }
  cells_ = std::move(words);
  differences_ = differences.Release();
}

template class DifferenceRows<std::uint8_t>;
template class DifferenceRows<std::uint16_t>;

}  // namespace feeler::planner
