#include "feeler/planner/bounds/certificates/certificate.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "feeler/planner/belief/neighbour_masks.h"

namespace feeler::planner {

CertificateHeuristic::CertificateHeuristic(const HypothesisSets& sets, std::shared_ptr<const CertificateTable> table,
                                           std::shared_ptr<const PairCertificates> pairs)
    : sets_(sets), table_(std::move(table)), isolated_(sets, std::move(pairs), table_->neighbours()) {
  uniform_ = sets_.uniform();
}

const CertificateHeuristic::Terms& CertificateHeuristic::Prepare(SetId set) {
  if (set >= terms_.size()) terms_.resize(sets_.count());
  Terms& terms = terms_[set];
  if (terms.ready) return terms;
  terms.ready = true;
  terms.first = static_cast<std::uint32_t>(uniform_ ? runs_.size() : offsets_.size());
  NeighbourMasks(sets_, set, table_->neighbours(), masks_);
  const auto strides = table_->grid().strides();
  const auto plane = static_cast<std::int64_t>(table_->grid().cells);
  std::size_t k = 0;
  sets_.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t layer, int bit) {
    const std::int64_t offset = (std::int64_t{orientation} * CertificateTable::kMasks + masks_[k++]) * plane -
                                (h.x() * strides[0] + h.y() * strides[1] + h.z() * strides[2]);
    if (!uniform_) {
      offsets_.push_back(offset);
      weights_.push_back(sets_.Weight(layer, bit));
    } else if (runs_.size() > terms.first && runs_.back().first == offset + 1) {
      runs_.back().first = offset;
      ++runs_.back().length;
    } else {
      runs_.push_back({offset, 1});
    }
  });
  terms.count = static_cast<std::uint32_t>(uniform_ ? runs_.size() : offsets_.size()) - terms.first;
  return terms;
}

double CertificateHeuristic::Weighted(SetId set, const Cell& robot) {
  if (sets_.info(set).goal) return 0.0;
  return Neighbours(set, robot) + isolated_.Weighted(set, robot);
}

double CertificateHeuristic::Neighbours(SetId set, const Cell& robot) {
  const HypothesisSets::Info& info = sets_.info(set);
  const CellBox& domain = table_->grid().domain;
  if (!domain.Contains(robot - info.low) || !domain.Contains(robot - info.high)) {
    return uniform_ ? Beyond(set, robot) : BeyondOneByOne(set, robot);
  }
  const Terms& terms = Prepare(set);
  const std::uint16_t* const values = table_->values();
  const auto base = static_cast<std::int64_t>(table_->grid().Index(robot - info.low)) +
                    (info.low.x() * table_->grid().strides()[0] + info.low.y() * table_->grid().strides()[1] +
                     info.low.z() * table_->grid().strides()[2]);
  if (uniform_) {
    std::uint64_t sum = 0;
    std::uint32_t worst = 0;
    for (std::uint32_t i = terms.first; i < terms.first + terms.count; ++i) {
      const std::uint16_t* const run = values + base + runs_[i].first;
      for (std::uint32_t j = 0; j < runs_[i].length; ++j) {
        const std::uint32_t value = run[j];
        worst = worst > value ? worst : value;
        sum += value;
      }
    }
    if (worst == CertificateTable::kUnreachable) return std::numeric_limits<double>::infinity();
    return static_cast<double>(sum) * table_->grid().unit;
  }
  const std::int64_t* const offsets = offsets_.data() + terms.first;
  double sum = 0.0;
  for (std::uint32_t i = 0; i < terms.count; ++i) {
    const std::uint16_t value = values[base + offsets[i]];
    if (value == CertificateTable::kUnreachable) return std::numeric_limits<double>::infinity();
    sum += weights_[terms.first + i] * value;
  }
  return sum * table_->grid().unit;
}

const CertificateHeuristic::Terms& CertificateHeuristic::PrepareRows(SetId set) {
  if (set >= row_terms_.size()) row_terms_.resize(sets_.count());
  Terms& terms = row_terms_[set];
  if (terms.ready) return terms;
  terms.ready = true;
  terms.first = static_cast<std::uint32_t>(rows_.size());
  NeighbourMasks(sets_, set, table_->neighbours(), masks_);
  std::size_t k = 0;
  sets_.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t, int) {
    const int mask = masks_[k++];
    if (rows_.size() > terms.first) {
      Row& last = rows_.back();
      if (last.mask == mask && last.orientation == orientation && h == last.first + Cell(last.length, 0, 0)) {
        ++last.length;
        return;
      }
    }
    rows_.push_back({h, 1, orientation, mask});
  });
  terms.count = static_cast<std::uint32_t>(rows_.size()) - terms.first;
  return terms;
}

double CertificateHeuristic::Beyond(SetId set, const Cell& robot) {
  const Terms& terms = PrepareRows(set);
  const CertificateGrid& grid = table_->grid();
  std::uint64_t sum = 0;
  for (std::uint32_t i = terms.first; i < terms.first + terms.count; ++i) {
    const Row& row = rows_[i];
    // Displacements from..to along x; those beyond an end of the grid have the value at that end, and a way back.
    const Cell to = robot - row.first;
    const int from = to.x() - row.length + 1;
    const int left = std::clamp(grid.domain.min.x() - from, 0, row.length);
    const int right = std::clamp(to.x() - grid.domain.max.x(), 0, row.length);
    const std::uint16_t* const values =
        table_->values() + static_cast<std::size_t>(row.orientation * CertificateTable::kMasks + row.mask) * grid.cells;
    const std::size_t at = grid.Index(Cell(from, to.y(), to.z()));
    const auto inside = static_cast<std::size_t>(row.length - left - right);
    std::uint32_t worst = 0;
    std::uint32_t inside_sum = 0;
    for (std::size_t j = 0; j < inside; ++j) {
      const std::uint32_t value = values[at + j];
      worst = worst > value ? worst : value;
      inside_sum += value;
    }
    sum += inside_sum;
    const auto at_end = [&](std::uint32_t value, int count) {
      worst = std::max(worst, value);
      sum += std::uint64_t{value} * static_cast<std::uint64_t>(count);
    };
    if (left > 0) at_end(values[at], left);
    if (right > 0) at_end(values[grid.Index(to)], right);
    if (worst == CertificateTable::kUnreachable) return std::numeric_limits<double>::infinity();
    if (row.mask == 0) continue;
    sum += static_cast<std::uint64_t>(row.length) *
           grid.WayBack(Cell(std::clamp(to.x(), grid.domain.min.x(), grid.domain.max.x()), to.y(), to.z()));
    const auto triangle = [](int n) { return static_cast<std::uint64_t>(n) * (static_cast<std::uint64_t>(n) + 1) / 2; };
    // The nearest of those beyond an end may be more than one cell out, if the whole row is.
    const auto outside = [&](int furthest, int count) { return triangle(furthest) - triangle(furthest - count); };
    if (grid.free_below[0] && left > 0) sum += outside(grid.domain.min.x() - from, left) * grid.free_units;
    if (grid.free_above[0] && right > 0) sum += outside(to.x() - grid.domain.max.x(), right) * grid.free_units;
  }
  return static_cast<double>(sum) * grid.unit;
}

double CertificateHeuristic::BeyondOneByOne(SetId set, const Cell& robot) {
  NeighbourMasks(sets_, set, table_->neighbours(), masks_);
  double sum = 0.0;
  std::size_t k = 0;
  sets_.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t layer, int bit) {
    const std::uint32_t value = table_->Further(robot - h, masks_[k++], orientation);
    sum += value >= CertificateTable::kUnreachable ? std::numeric_limits<double>::infinity()
                                                   : sets_.Weight(layer, bit) * value;
  });
  return sum * table_->grid().unit;
}

}  // namespace feeler::planner
