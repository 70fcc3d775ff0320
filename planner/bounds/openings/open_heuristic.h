#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/bounds/cuboids/box_partition.h"
#include "feeler/planner/bounds/openings/look_table.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// The bound for maps with dead ends (openings): the better of another and of the LookTable's for the layers of a
/// belief, each of them a rectangle of which some members are gone. Where the prior is not uniform the other alone.
/// Admissible; consistency is not promised: rectangles shrink as members go.
class OpenHeuristic final : public BeliefHeuristic {
 public:
  /// `filled` is the map with its dead ends filled, for which `looks` are.
  OpenHeuristic(const HypothesisSets& sets, std::unique_ptr<BeliefHeuristic> other,
                std::shared_ptr<const ContactMap> filled, std::shared_ptr<const LookTable> looks);
  double Weighted(SetId set, const Cell& robot) override;
  std::size_t bytes() const override;

 private:
  /// A rectangle of a layer that holds members.
  struct Part {
    Cell low = Cell::Zero();  ///< relative to the set's frame
    Cell size = Cell::Zero();
    int gone = 0;  ///< members that the layer lacks there
    std::uint32_t slab = 0;
  };
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    bool ready = false;
  };

  const Range& Prepare(SetId set);
  /// Cuts the rectangle around the bits, in a window at `corner`, into parts no larger than the table's.
  void AddParts(const Bits256& bits, const Cell& corner, std::uint32_t slab, std::vector<Part>& parts) const;
  /// Of the members of a part under which the tool is in no opening; they alone are told apart by walks outside.
  double Outside(const Slab& slab, const Part& part, const Cell& robot) const;

  const HypothesisSets& sets_;
  std::unique_ptr<BeliefHeuristic> other_;
  std::shared_ptr<const ContactMap> filled_;
  std::shared_ptr<const LookTable> looks_;
  std::vector<Range> ranges_;  ///< per set
  std::vector<Part> parts_;
};

}  // namespace feeler::planner
