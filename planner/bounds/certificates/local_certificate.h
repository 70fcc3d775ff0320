#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/bounds/certificates/certificate_table.h"

namespace feeler::planner {

/// The certificate bound for hypotheses anywhere: for each hypothesis, up to eight others are chosen (the nearest ones
/// that the goal needs apart), and a table over the workspace holds the least cost of a walk under that hypothesis that
/// returns something else than under each of a subset of them. Admissible for the same reason as CertificateTable;
/// walks are confined to the workspace. One table per problem, so for small problems: lattice files.
class LocalCertificateTable {
 public:
  static constexpr std::uint16_t kUnreachable = kNoCertificate;
  static constexpr std::int64_t kMostEntries = std::int64_t{1} << 24;

  /// True if tables with at least three others per hypothesis are of bearable size.
  static bool Fits(const Problem& problem);
  LocalCertificateTable(const Problem& problem, const StepCosts& costs);

  int others_per_hypothesis() const { return bits_; }
  /// Indices of the others of a hypothesis (problem order).
  const std::vector<int>& others(int hypothesis) const { return others_[static_cast<std::size_t>(hypothesis)]; }
  double unit() const { return unit_; }
  std::size_t bytes() const { return values_.size() * sizeof(values_[0]); }
  const CellBox& workspace() const { return workspace_; }
  std::size_t plane_size() const { return plane_size_; }
  /// Plane (hypothesis, mask) starts at ((hypothesis << bits) + mask) * plane_size().
  const std::uint16_t* values() const { return values_.data(); }
  std::size_t Index(const Cell& robot) const { return GridIndex(size_, robot - workspace_.min); }

 private:
  void FillGuarded(const Problem& problem, int hypothesis, const TableUnits& units);
  void Fill(const Problem& problem, int hypothesis, std::uint32_t free_units, std::uint32_t contact_units,
            std::uint32_t start_units);

  CellBox workspace_;
  Cell size_;
  std::size_t plane_size_ = 0;
  int bits_ = 0;
  double unit_ = 1.0;
  std::vector<std::vector<int>> others_;
  std::vector<std::uint16_t> values_;
};

class LocalCertificateHeuristic final : public BeliefHeuristic {
 public:
  LocalCertificateHeuristic(const Problem& problem, const HypothesisSets& sets, const LocalCertificateTable& table);
  double Weighted(SetId set, const Cell& robot) override;
  std::size_t bytes() const override {
    return terms_.capacity() * sizeof(Terms) + planes_.capacity() * sizeof(std::uint64_t) +
           weights_.capacity() * sizeof(double);
  }

 private:
  struct Terms {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    bool ready = false;
  };
  const Terms& Prepare(SetId set);

  const HypothesisSets& sets_;
  const LocalCertificateTable& table_;
  std::map<std::array<int, 4>, int> index_;  ///< offset and orientation to problem order
  std::vector<Terms> terms_;
  std::vector<std::uint64_t> planes_;
  std::vector<double> weights_;
  std::vector<char> member_;
};

}  // namespace feeler::planner
