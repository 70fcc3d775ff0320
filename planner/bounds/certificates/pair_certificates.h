#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/belief/hypothesis_sets.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/bounds/certificates/certificate_walks.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// For two hypotheses h and h + offset of one orientation: the least cost of a walk, as the tool fares under h, that
/// tells them apart. A table per offset, built when first asked for; safe to use from many threads.
class PairCertificates {
 public:
  struct Plane {
    CertificateGrid grid;
    std::vector<std::uint16_t> values;
    /// In units of grid.unit; at least kNoCertificate if no probe tells the two apart.
    std::uint32_t At(const Cell& displacement) const {
      const std::uint16_t value = values[grid.Index(displacement)];
      return value == kNoCertificate ? value : value + grid.WayBack(displacement);
    }
  };

  PairCertificates(std::shared_ptr<const ContactMap> map, const StepCosts& costs, const Cell& spread);

  const Plane& Get(const Cell& offset, int orientation) const;
  /// A goal leaves hypotheses at most this far apart, per axis.
  const Cell& spread() const { return spread_; }
  /// Of the tables built so far.
  std::size_t bytes() const;

 private:
  std::shared_ptr<const ContactMap> map_;
  ActiveRegion region_;
  StepCosts costs_;
  Cell spread_;
  mutable std::mutex mutex_;
  mutable std::map<std::array<int, 4>, std::unique_ptr<const Plane>> planes_;
};

/// Offset from a member of a set to the nearest other one of its orientation that no goal may leave together with it;
/// none if there is no such.
std::optional<Cell> NearestToTellApart(const HypothesisSets& sets, SetId set, const Cell& member, int orientation,
                                       const Cell& spread);

/// Lower bounds for the *isolated* hypotheses of a belief, those that have no neighbour at the given offsets in it, on
/// which heuristics that look at those neighbours are silent: each must be told apart from the nearest other
/// hypothesis.
///
/// Admissible: under h the policy's walk must tell h from every other hypothesis left out of its goal. Consistent: in a
/// subset that still holds both, the nearest is the same. Added to another bound it stays so if that one counts nothing
/// for isolated hypotheses.
class IsolatedHypotheses {
 public:
  IsolatedHypotheses(const HypothesisSets& sets, std::shared_ptr<const PairCertificates> pairs,
                     const std::array<Cell, 6>& neighbours);

  /// Sum over the isolated hypotheses of weight * bound; infinity if a pair cannot be told apart.
  double Weighted(SetId set, const Cell& robot);
  std::size_t bytes() const { return terms_of_.capacity() * sizeof(Terms) + terms_.capacity() * sizeof(Term); }

 private:
  struct Term {
    const PairCertificates::Plane* plane = nullptr;
    Cell offset = Cell::Zero();
    double weight = 1.0;
  };
  struct Terms {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    bool ready = false;
  };
  const Terms& Prepare(SetId set);

  const HypothesisSets& sets_;
  std::shared_ptr<const PairCertificates> pairs_;
  std::array<Cell, 6> neighbours_;
  std::vector<Terms> terms_of_;
  std::vector<Term> terms_;
  std::vector<std::uint8_t> masks_;
};

}  // namespace feeler::planner
