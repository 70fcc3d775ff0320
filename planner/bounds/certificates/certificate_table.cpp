#include "feeler/planner/bounds/certificates/certificate_table.h"

namespace feeler::planner {

CertificateTable::CertificateTable(const ContactMap& map, const StepCosts& costs, const Cell& spread)
    : grid_(ActiveRegion(map), costs, spread + Cell::Ones()), orientations_(map.orientations()) {
  for (const Direction d : kDirections) {
    neighbours_[static_cast<std::size_t>(IndexOf(d))] = (spread[AxisOf(d)] + 1) * UnitCell(d);
  }
  const std::size_t planes = grid_.cells * kMasks;
  values_.assign(planes * static_cast<std::size_t>(orientations_), 0);
  for (int o = 0; o < orientations_; ++o) {
    TableCertificates(map, o, grid_, neighbours_, &values_[static_cast<std::size_t>(o) * planes]);
  }
}

}  // namespace feeler::planner
