#include "feeler/planner/bounds/openings/mate_certificates.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/bounds/certificates/certificate_walks.h"

namespace feeler::planner {

MateCertificates::MateCertificates(std::shared_ptr<const ContactMap> map, const StepCosts& costs, const Cell& spread)
    : map_(std::move(map)), costs_(costs), spread_(spread) {}

const MateCertificates::Table& MateCertificates::Within(const std::array<int, 2>& reach, int orientation) const {
  const std::lock_guard lock(mutex_);
  std::unique_ptr<const Table>& known = tables_[{reach[0], reach[1], orientation}];
  if (known) return *known;
  auto mates = std::make_unique<Table>();
  mates->grid = CertificateGrid(*map_, costs_, Cell(reach[0] + spread_.x(), reach[1] + spread_.y(), 0));
  const CertificateGrid& grid = mates->grid;
  CertificateWalks walks;
  walks.strides = grid.strides();
  walks.step_cost = grid.free_units;
  walks.start_cost = grid.start_units;
  walks.enters.assign(grid.cells, 0);
  const CellBox& domain = grid.domain;
  ForEachCell(domain, [&](const Cell& here) {
    if (map_->Blocked(here, orientation)) return;
    const auto from = static_cast<std::uint32_t>(grid.Index(here));
    for (const Direction d : kDirections) {
      const bool free = map_->StepFree(here, d, orientation);
      std::uint32_t shows = 0;
      for (int axis = 0; axis < 2; ++axis) {
        for (int i = 1; i <= reach[static_cast<std::size_t>(axis)] && (shows >> axis & 1) == 0; ++i) {
          Cell offset = Cell::Zero();
          offset[axis] = i + spread_[axis];
          if (map_->StepFree(here - offset, d, orientation) != free ||
              map_->StepFree(here + offset, d, orientation) != free) {
            shows |= 1U << axis;
          }
        }
      }
      std::uint32_t to = from;
      if (free && domain.Contains(here + UnitCell(d))) {
        to = static_cast<std::uint32_t>(static_cast<std::int64_t>(from) +
                                        SignOf(d) * walks.strides[static_cast<std::size_t>(AxisOf(d))]);
        walks.enters[to] |= static_cast<std::uint8_t>(1U << IndexOf(d));
      }
      if (shows != 0) walks.probes.push_back({from, to, free ? grid.free_units : grid.contact_units, d, !free, shows});
    }
  });
  std::vector<std::uint16_t> values(4 * grid.cells);
  FillCertificates(walks, 2, values.data());
  const double per_step = grid.unit / costs_.free;
  mates->planes.resize(3 * grid.cells);
  for (std::size_t i = 0; i < 3 * grid.cells; ++i) {
    const std::uint16_t value = values[grid.cells + i];
    const auto rest = static_cast<float>(per_step * (value - std::min<std::uint32_t>(value, grid.start_units)));
    mates->planes[i] = value == kNoCertificate ? kNone : std::min(rest, kNone);
  }
  ForEachCell(domain, [&](const Cell& here) {
    if (!map_->Blocked(here, orientation)) return;
    for (std::size_t plane = 0; plane < 3; ++plane) mates->planes[plane * grid.cells + grid.Index(here)] = -1.0F;
  });
  known = std::move(mates);
  return *known;
}

std::size_t MateCertificates::bytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t bytes = 0;
  for (const auto& known : tables_) bytes += known.second->planes.size() * sizeof(float);
  return bytes;
}

}  // namespace feeler::planner
