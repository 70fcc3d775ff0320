#pragma once

#include <memory>
#include <utility>

#include "feeler/core/lattice.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// What a guarded move would return under a hypothesis: read from the contact map, or computed by collision checks of
/// the meshes (env/contact/mesh_outcomes.h). One thread at a time.
class OutcomeModel {
 public:
  virtual ~OutcomeModel() = default;
  /// The tool stands at `displacement` (r - h, cells) from the target, clear of it.
  virtual Outcome Predict(const Cell& displacement, const GuardedMove& move, int orientation) = 0;
};

class MapOutcomes final : public OutcomeModel {
 public:
  explicit MapOutcomes(std::shared_ptr<const ContactMap> map) : map_(std::move(map)) {}
  Outcome Predict(const Cell& displacement, const GuardedMove& move, int orientation) override {
    return map_->Predict(displacement, move, orientation);
  }

 private:
  std::shared_ptr<const ContactMap> map_;
};

}  // namespace feeler::planner
