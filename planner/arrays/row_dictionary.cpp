#include "feeler/planner/arrays/row_dictionary.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cassert>
#include <utility>

namespace feeler::planner {

template <class T>
RowDictionary<T>::RowDictionary(std::size_t length) : length_(length), known_(1024, Hash{this}, Equal{this}) {}

template <class T>
std::size_t RowDictionary<T>::Hash::operator()(std::uint32_t row) const {
  return XXH3_64bits(&of->values_[row], of->length_ * sizeof(T));
}

template <class T>
bool RowDictionary<T>::Equal::operator()(std::uint32_t a, std::uint32_t b) const {
  return std::equal(&of->values_[a], &of->values_[a] + of->length_, &of->values_[b]);
}

template <class T>
std::uint32_t RowDictionary<T>::Add(std::span<const T> row) {
  assert(row.size() == length_);
  const std::size_t begin = values_.size();
  values_.insert(values_.end(), row.begin(), row.end());
  const auto [at, added] = known_.insert(static_cast<std::uint32_t>(begin));
  if (!added) values_.resize(begin);
  return *at;
}

template <class T>
std::vector<T> RowDictionary<T>::Release() {
  known_.clear();
  values_.shrink_to_fit();
  return std::move(values_);
}

template class RowDictionary<std::uint8_t>;
template class RowDictionary<std::uint16_t>;
template class RowDictionary<std::uint32_t>;

}  // namespace feeler::planner
