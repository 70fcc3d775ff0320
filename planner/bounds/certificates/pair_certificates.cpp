#include "feeler/planner/bounds/certificates/pair_certificates.h"

#include <cstdlib>
#include <limits>
#include <utility>

#include "feeler/planner/belief/neighbour_masks.h"

namespace feeler::planner {

PairCertificates::PairCertificates(std::shared_ptr<const ContactMap> map, const StepCosts& costs, const Cell& spread)
    : map_(std::move(map)), region_(*map_), costs_(costs), spread_(spread) {}

const PairCertificates::Plane& PairCertificates::Get(const Cell& offset, int orientation) const {
  const std::lock_guard lock(mutex_);
  std::unique_ptr<const Plane>& plane = planes_[{offset.x(), offset.y(), offset.z(), orientation}];
  if (!plane) {
    auto fresh = std::make_unique<Plane>();
    fresh->grid = CertificateGrid(region_, costs_, offset.cwiseAbs());
    // Subsets of one other hypothesis: none (all zero), and itself.
    std::vector<std::uint16_t> planes(2 * fresh->grid.cells, 0);
    TableCertificates(*map_, orientation, fresh->grid, {&offset, 1}, planes.data());
    fresh->values.assign(planes.begin() + static_cast<std::ptrdiff_t>(fresh->grid.cells), planes.end());
    plane = std::move(fresh);
  }
  return *plane;
}

std::size_t PairCertificates::bytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t bytes = 0;
  for (const auto& known : planes_) bytes += known.second->values.size() * sizeof(std::uint16_t);
  return bytes;
}

std::optional<Cell> NearestToTellApart(const HypothesisSets& sets, SetId set, const Cell& member, int orientation,
                                       const Cell& spread) {
  std::optional<Cell> nearest;
  int distance = std::numeric_limits<int>::max();
  sets.ForEach(set, [&](const Cell& other, int other_orientation, std::uint32_t, int) {
    const Cell offset = other - member;
    const bool apart = (offset.cwiseAbs().array() > spread.array()).any();
    if (!apart || other_orientation != orientation || offset.cwiseAbs().sum() >= distance) return;
    distance = offset.cwiseAbs().sum();
    nearest = offset;
  });
  return nearest;
}

IsolatedHypotheses::IsolatedHypotheses(const HypothesisSets& sets, std::shared_ptr<const PairCertificates> pairs,
                                       const std::array<Cell, 6>& neighbours)
    : sets_(sets), pairs_(std::move(pairs)), neighbours_(neighbours) {}

const IsolatedHypotheses::Terms& IsolatedHypotheses::Prepare(SetId set) {
  if (set >= terms_of_.size()) terms_of_.resize(sets_.count());
  Terms& terms = terms_of_[set];
  if (terms.ready) return terms;
  terms.ready = true;
  terms.first = static_cast<std::uint32_t>(terms_.size());
  NeighbourMasks(sets_, set, neighbours_, masks_);
  std::size_t k = 0;
  sets_.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t layer, int bit) {
    if (masks_[k++] != 0) return;
    const auto nearest = NearestToTellApart(sets_, set, h, orientation, pairs_->spread());
    if (!nearest) return;
    terms_.push_back({&pairs_->Get(*nearest, orientation), h, sets_.Weight(layer, bit)});
  });
  terms.count = static_cast<std::uint32_t>(terms_.size()) - terms.first;
  return terms;
}

double IsolatedHypotheses::Weighted(SetId set, const Cell& robot) {
  const Terms terms = Prepare(set);
  double sum = 0.0;
  for (std::uint32_t i = terms.first; i < terms.first + terms.count; ++i) {
    const Term& term = terms_[i];
    const std::uint32_t value = term.plane->At(robot - term.offset);
    if (value >= kNoCertificate) return std::numeric_limits<double>::infinity();
    sum += term.weight * value * term.plane->grid.unit;
  }
  return sum;
}

}  // namespace feeler::planner
