#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// For each displacement the least cost of a walk of single steps to one whose next step is blocked.
class FirstContactTable {
 public:
  FirstContactTable(const ContactMap& map, const StepCosts& costs);
  double unit() const { return unit_; }
  std::size_t bytes() const { return values_.size() * sizeof(values_[0]); }
  std::uint16_t At(const Cell& displacement, int orientation) const {
    return values_[static_cast<std::size_t>(orientation) * cells_ +
                   GridIndex(size_, domain_.Clamp(displacement) - domain_.min)];
  }

 private:
  CellBox domain_;
  Cell size_;
  std::size_t cells_ = 0;
  double unit_ = 1.0;
  std::vector<std::uint16_t> values_;
};

/// The weak heuristic: nothing can be learnt before the first contact under some hypothesis, so every belief that is no
/// goal costs at least the least distance to a contact.
class FirstContactHeuristic final : public BeliefHeuristic {
 public:
  FirstContactHeuristic(const HypothesisSets& sets, std::shared_ptr<const FirstContactTable> table)
      : sets_(sets), table_(std::move(table)) {}
  double Weighted(SetId set, const Cell& robot) override;

 private:
  const HypothesisSets& sets_;
  std::shared_ptr<const FirstContactTable> table_;
};

}  // namespace feeler::planner
