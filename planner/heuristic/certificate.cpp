#include "planner/heuristic/certificate.h"

#include <limits>
#include <utility>

#include "planner/heuristic/neighbour_masks.h"

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
  if (!domain.Contains(robot - info.low) || !domain.Contains(robot - info.high)) return Slow(set, robot);
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

double CertificateHeuristic::Slow(SetId set, const Cell& robot) {
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
