#pragma once

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// The *mates* of a hypothesis are others of its row (its column): at most `reach` cells further along x (along y) than
/// a goal allows. The least cost of a walk, as the tool fares under the hypothesis, that returns something else than
/// under some mate of its row, of its column, of each. A table per reach and orientation, built when first asked for;
/// safe to use from many threads.
class MateCertificates {
 public:
  /// Stands for a certificate that does not exist; any number is a lower bound of it.
  static constexpr float kNone = 4096.0F;
  struct Table {
    CertificateGrid grid;
    /// Of the row, of the column, of both, grid.cells each; in free steps, without the cost of setting out (the walk
    /// may begin in the middle of a motion that has been paid for); negative in the target.
    std::vector<float> planes;
  };

  MateCertificates(std::shared_ptr<const ContactMap> map, const StepCosts& costs, const Cell& spread);

  /// Of the tables built so far.
  std::size_t bytes() const;
  const Table& Within(const std::array<int, 2>& reach, int orientation) const;

 private:
  std::shared_ptr<const ContactMap> map_;
  StepCosts costs_;
  Cell spread_;
  mutable std::mutex mutex_;
  mutable std::map<std::array<int, 3>, std::unique_ptr<const Table>> tables_;
};

}  // namespace feeler::planner
