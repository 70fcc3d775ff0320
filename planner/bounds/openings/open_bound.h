#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/belief/bits256.h"
#include "feeler/planner/belief/contact_masks.h"
#include "feeler/planner/belief/hypothesis_sets.h"
#include "feeler/planner/bounds/certificates/certificate_table.h"
#include "feeler/planner/bounds/openings/mate_certificates.h"
#include "feeler/planner/bounds/openings/open_layer.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// A lower bound for maps with dead ends (openings), proven in docs/planner.md, "The open socket".
///
/// A certificate sees only the opening of the one hypothesis that is true, and finds it at once. A policy does not
/// know which one that is: while nothing else tells hypotheses apart, it looks into their openings one after the other,
/// and who looks pays for the way. The bound splits a belief into layers of equal height and considers, for each,
/// where hypotheses are first told apart by other contacts (place s), how many openings are looked into before (m1)
/// and after (m2) that on the main path of the policy, and takes the least over s, m1 and m2 of what that costs at
/// least: openings by their rank in time, other hypotheses by the way to s, the delay, and their certificates from
/// there on the map whose dead ends are filled.
///
/// Immutable but for a bounded cache of layers' values; safe to use from many threads.
class OpenBound {
 public:
  /// `filled` is FillDeadEnds(*open), `masks` and `certificates` are of `filled` and outlive this. `costs` are those of
  /// the certificates; a goal leaves hypotheses at most `spread` apart.
  OpenBound(const ContactMap& open, std::shared_ptr<const ContactMap> filled, const ContactMasks& masks,
            std::shared_ptr<const CertificateTable> certificates, const StepCosts& costs, const Cell& spread);

  /// Lower bound on the optimal expected cost of a belief, times its weight; 0 at goals and where the prior is not
  /// uniform. `robot` is relative to the set's frame.
  double Weighted(const HypothesisSets& sets, SetId set, const Cell& robot) const;

  std::size_t bytes() const;

  /// Where the dead ends of an orientation begin: steps that are free on the map and blocked on the filled one.
  struct Openings {
    std::vector<Cell> mouths;           ///< displacements from which a step leads into a dead end
    std::vector<Direction> directions;  ///< of such a step, for each
    CellBox box;                        ///< around them
  };
  const Openings& openings(int orientation) const { return openings_[static_cast<std::size_t>(orientation)]; }

 private:
  static constexpr std::size_t kMostKnown = std::size_t{1} << 17;  ///< values of layers kept
  struct Split;
  using Places = std::vector<std::vector<Cell>>;  ///< by distance from the tool

  void FillPlanes(int orientation);
  /// In free steps, times the number of members; `robot` relative to the corner of the window.
  double LayerBound(const Bits256& members, int orientation, const Cell& robot) const;
  /// None if the tool is in the opening of a member.
  std::optional<OpenLayer> MakeLayer(const Bits256& members, int orientation, const Cell& robot) const;
  void FindNeighbours(const Bits256& members, OpenLayer& layer) const;
  void FindMates(const Bits256& members, OpenLayer& layer) const;
  /// Also sets off(h) of the members; `box` holds all that is not repeated beyond it.
  Places FindPlaces(const Bits256& members, const Cell& robot, const CellBox& box, int radius, OpenLayer& layer) const;
  static void LowerOff(const Split& split, OpenLayer& layer);
  /// The least over the places of the first split, and over there being none.
  double LeastOverPlaces(const Bits256& members, const Cell& robot, double without_split, OpenLayer& layer) const;

  std::shared_ptr<const ContactMap> filled_;
  const ContactMasks& masks_;
  std::shared_ptr<const CertificateTable> certificates_;
  StepCosts costs_;
  Cell spread_;
  MateCertificates mates_;
  std::vector<Openings> openings_;  ///< per orientation
  /// Per orientation and subset of the neighbours along x and y (bits +x, -x, +y, -y): least certificate for one
  /// neighbour of each axis that the subset has, in free steps; negative where the filled target is.
  std::vector<float> planes_;
  using Key = std::tuple<std::array<std::uint64_t, 4>, int, std::array<int, 3>>;
  mutable std::mutex mutex_;
  mutable std::map<Key, double> known_;
};

}  // namespace feeler::planner
