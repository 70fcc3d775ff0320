#pragma once

#include <vector>

#include "feeler/planner/contact/convex_shape.h"
#include "feeler/planner/contact/travel_model.h"

namespace feeler::planner {

/// Travel from the convex pieces of tool and target, exact to a micrometre, for a target of any pose.
class ExactTravel final : public TravelModel {
 public:
  /// Pieces of the tool in the tool frame, of the target in the target frame.
  ExactTravel(const std::vector<ConvexPiece>& tool, std::vector<ConvexPiece> target);

  std::vector<double> Travel(const Pose& frame_T_target, const std::vector<ToolMotion>& motions) override;

 private:
  std::vector<ConvexShape> tool_;
  std::vector<ConvexPiece> target_;
};

}  // namespace feeler::planner
