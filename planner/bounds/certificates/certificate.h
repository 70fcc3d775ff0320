#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/bounds/certificates/certificate_table.h"
#include "feeler/planner/bounds/certificates/pair_certificates.h"

namespace feeler::planner {

/// Sum over the hypotheses of a belief of the cost to tell each from those of its neighbours that are in the belief
/// (see CertificateTable); from the nearest one where none is (see IsolatedHypotheses).
class CertificateHeuristic final : public BeliefHeuristic {
 public:
  CertificateHeuristic(const HypothesisSets& sets, std::shared_ptr<const CertificateTable> table,
                       std::shared_ptr<const PairCertificates> pairs);
  double Weighted(SetId set, const Cell& robot) override;
  std::size_t bytes() const override {
    return terms_.capacity() * sizeof(Terms) + offsets_.capacity() * sizeof(std::int64_t) +
           runs_.capacity() * sizeof(Run) + rows_.capacity() * sizeof(Row) + weights_.capacity() * sizeof(double) +
           isolated_.bytes();
  }

 private:
  /// Values of hypotheses that are neighbours along x and look at the same neighbours lie side by side; `first` is
  /// where they begin relative to the robot's place in plane 0.
  struct Run {
    std::int64_t first = 0;
    std::uint32_t length = 0;
  };
  /// The same with coordinates, for places beyond the grid: `length` hypotheses from `first` on along +x.
  struct Row {
    Cell first = Cell::Zero();
    std::int32_t length = 0;
    std::int32_t orientation = 0;
    std::int32_t mask = 0;
  };
  /// Of a set: its runs (or rows) for a uniform prior, else its hypotheses one by one.
  struct Terms {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    bool ready = false;
  };
  const Terms& Prepare(SetId set);
  const Terms& PrepareRows(SetId set);
  double Neighbours(SetId set, const Cell& robot);
  /// Where some displacement lies beyond the grid.
  double Beyond(SetId set, const Cell& robot);
  double BeyondOneByOne(SetId set, const Cell& robot);

  const HypothesisSets& sets_;
  std::shared_ptr<const CertificateTable> table_;
  IsolatedHypotheses isolated_;
  std::vector<Terms> terms_;
  std::vector<Run> runs_;
  std::vector<Terms> row_terms_;
  std::vector<Row> rows_;
  std::vector<std::int64_t> offsets_;
  std::vector<double> weights_;  ///< beside `offsets_`
  std::vector<std::uint8_t> masks_;
  std::vector<Slab> scratch_;
  bool uniform_ = true;
};

}  // namespace feeler::planner
