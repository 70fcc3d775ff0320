#include "feeler/planner/bounds/certificates/certificate_table.h"

#include <utility>
#include <vector>

namespace feeler::planner {

CertificateTable::CertificateTable(const ContactMap& map, const StepCosts& costs, const Cell& spread,
                                   const ArrayStore* store)
    : grid_(ActiveRegion(map), costs, spread + Cell::Ones()), orientations_(map.orientations()) {
  for (const Direction d : kDirections) {
    neighbours_[static_cast<std::size_t>(IndexOf(d))] = (spread[AxisOf(d)] + 1) * UnitCell(d);
  }
  if (store != nullptr && store->Take<std::uint16_t>("certificates", {&values_})) return;
  const std::size_t planes = grid_.cells * kMasks;
  std::vector<std::uint16_t> values(planes * static_cast<std::size_t>(orientations_), 0);
  for (int o = 0; o < orientations_; ++o) {
    TableCertificates(map, o, grid_, neighbours_, &values[static_cast<std::size_t>(o) * planes]);
  }
  values_ = std::move(values);
  if (store != nullptr) store->Keep<std::uint16_t>("certificates", {&values_});
}

}  // namespace feeler::planner
