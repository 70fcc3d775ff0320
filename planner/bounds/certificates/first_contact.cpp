#include "feeler/planner/bounds/certificates/first_contact.h"

#include <algorithm>
#include <limits>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/bounds/certificates/certificate_walks.h"

namespace feeler::planner {

FirstContactTable::FirstContactTable(const ContactMap& map, const StepCosts& costs)
    : domain_{map.domain().min - Cell::Ones(), map.domain().max + Cell::Ones()},
      size_(domain_.Size()),
      unit_(costs.free) {
  cells_ = static_cast<std::size_t>(domain_.Count());
  std::vector<std::uint16_t> planes(2 * cells_);
  for (int o = 0; o < map.orientations(); ++o) {
    CertificateWalks walks;
    walks.strides = GridStrides(size_);
    walks.enters.assign(cells_, 0);
    std::uint32_t cell = 0;
    for (int z = domain_.min.z(); z <= domain_.max.z(); ++z) {
      for (int y = domain_.min.y(); y <= domain_.max.y(); ++y) {
        for (int x = domain_.min.x(); x <= domain_.max.x(); ++x, ++cell) {
          const Cell here(x, y, z);
          if (map.Blocked(here, o)) continue;
          bool contact = false;
          for (const Direction d : kDirections) {
            if (!map.StepFree(here, d, o)) {
              contact = true;
            } else if (domain_.Contains(here + UnitCell(d))) {
              const std::int64_t stride = walks.strides[static_cast<std::size_t>(AxisOf(d))];
              walks.enters[static_cast<std::size_t>(cell + SignOf(d) * stride)] |=
                  static_cast<std::uint8_t>(1U << IndexOf(d));
            }
          }
          if (contact) walks.probes.push_back({cell, cell, 0, Direction::kPlusX, true, 1});
        }
      }
    }
    FillCertificates(walks, 1, planes.data());
    values_.insert(values_.end(), planes.begin() + static_cast<std::ptrdiff_t>(cells_), planes.end());
  }
}

double FirstContactHeuristic::Weighted(SetId set, const Cell& robot) {
  const HypothesisSets::Info& info = sets_.info(set);
  if (info.goal) return 0.0;
  std::uint16_t least = kNoCertificate;
  sets_.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t, int) {
    least = std::min(least, table_->At(robot - h, orientation));
  });
  if (least == kNoCertificate) return std::numeric_limits<double>::infinity();
  return info.weight * least * table_->unit();
}

}  // namespace feeler::planner
