#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// One straight motion that was felt for contact, in lattice coordinates (cells, see LatticeFrame).
struct Touch {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< of the tool
  Direction direction = Direction::kMinusZ;
  double travelled = 0.0;  ///< cells
  bool contact = false;    ///< it ended at a contact; without: all of it was free
  /// Of a contact that ended a motion along no axis: its direction (unit vector); zero otherwise. Which wall it met is
  /// open: one across any axis that the motion went along. `direction` is then the axis it mostly went along.
  Eigen::Vector3d oblique = Eigen::Vector3d::Zero();

  bool is_oblique() const { return !oblique.isZero(); }
  Eigen::Vector3d end() const { return start + travelled * UnitVector(direction); }
};

/// A contact at `end` of a motion from `start`; axis by axis or oblique.
Touch ContactAfter(const Eigen::Vector3d& start, const Eigen::Vector3d& end);

/// How badly a target at `target` (lattice coordinates) explains a touch, in cells: the distance of a contact from the
/// wall it should have met, the depth to which a free motion would have gone into a wall. Positions across the motion
/// are taken as known to `slack_cells` only: an edge that is missed or met by less explains either reading.
double Violation(const planner::ContactMap& map, const Touch& touch, const Eigen::Vector3d& target, int orientation,
                 double slack_cells);

/// Touches of faces that agree within this, in cells, are right: errors of tracking and of the give of a contact.
inline constexpr double kFacesAgree = 0.1;

/// Two touches along the insertion agree with a target there: its faces stand where they are thought to be. One is not
/// enough: it may have met a lead-in, which is lower than the faces.
bool FacesAgree(const planner::ContactMap& map, const std::vector<Touch>& evidence, const Eigen::Vector3d& target,
                Direction insertion, int orientation);

struct FitOptions {
  double violation_cells = 0.2;  ///< a touch explained worse than this counts as violated (0.4 mm at 2 mm cells)
  double slack_cells = 0.2;
  double step_cells = 0.125;  ///< of the search grid
};

/// Where the target is, given everything felt.
struct TargetFit {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();    ///< lattice coordinates
  Eigen::Vector3d half_width = Eigen::Vector3d::Zero();  ///< of what explains the evidence equally well, per axis
  std::array<bool, 3> pinned{};   ///< a contact with a wall square to the axis agrees with the fit
  std::array<int, 3> contacts{};  ///< how many such contacts there are
  int violations = 0;             ///< touches that the fit does not explain
};

/// Robust fit of a continuous target position in the box [lower, upper] (lattice coordinates): fewest violated touches
/// first, so that one false reading among several right ones is outvoted; then least squares over the contacts it
/// explains. An axis that no contact pins is set to the middle of what the free motions leave. Deterministic.
TargetFit FitTarget(const planner::ContactMap& map, const std::vector<Touch>& evidence, const Eigen::Vector3d& lower,
                    const Eigen::Vector3d& upper, int orientation = 0, const FitOptions& options = {});

/// The same for a box of any size: a coarse search finds the part of it that is worth the fine one.
TargetFit FitTargetAnywhere(const planner::ContactMap& map, const std::vector<Touch>& evidence,
                            const Eigen::Vector3d& lower, const Eigen::Vector3d& upper, int orientation = 0,
                            const FitOptions& options = {});

}  // namespace feeler::execution
