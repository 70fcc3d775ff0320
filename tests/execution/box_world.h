#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/core/robot.h"
#include "feeler/core/task.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// A configuration-space obstacle: displacements of the tool from the target (metres) inside it are contacts.
struct Box {
  Eigen::Vector3d min;
  Eigen::Vector3d max;
};

/// A housing over a panel, grown by the tool: 82 x 66 x 30 mm, all walls mid-cell for cells of 2 mm and the phase
/// (0, 0, 0.5). The mouth of the opening is at the origin.
std::vector<Box> HousingOverPanel();

/// Distance in metres along the unit vector `direction` from `from` to the first box, negative none: infinity. Only
/// entries count: leaving a box that one is inside of is free.
double DistanceToContact(const std::vector<Box>& boxes, const Eigen::Vector3d& from, const Eigen::Vector3d& direction);

/// The exact contact map of boxes.
std::shared_ptr<const planner::ContactMap> MapOf(const std::vector<Box>& boxes, double cell_m,
                                                 const Eigen::Vector3d& phase, const CellBox& domain);

/// A plug task over HousingOverPanel.
Task HousingTask();
std::shared_ptr<const planner::ContactMap> HousingMap();

/// What the kinematic robot gets wrong.
struct RobotFaults {
  double weakest_m = 0.00005;    ///< a contact is felt once the commanded end is this deep in the wall at least ...
  double strongest_m = 0.00045;  ///< ... and this deep at most, uniform per motion
  double give = 0.2;             ///< part of that depth by which the measured end follows the command
  double tracking_m = 0.00003;   ///< standard deviation of where a motion ends, per axis
  double measurement_m = 0.00001;
  double stop_s = 0.001;    ///< a contact at speed v is read up to v * stop_s late
  double slip_m = 0.00005;  ///< edges met by less are slid over, up to this, uniform per motion
  /// Of the opening against the housing, in target axes: the model knows nothing of it.
  double opening_offset_x_m = 0.0;
  double opening_yaw_rad = 0.0;
  /// Watched motions end with a contact that is none, so many a metre, at places of an exponential law.
  double false_stops_per_m = 0.0;
  /// Watched motions are made of steps of so many m (0: they are not), each of which fails: one that is blocked reports
  /// no contact, one that is free is spent.
  double step_m = 0.0;
  double missed_contact = 0.0;
  double spent_step = 0.0;
  int phantom_contacts = 0;  ///< so many guarded motions stop half way with a contact that is none
};

/// Moves a point through a world of boxes, with faults. The opening is real: within `clearance_m` of its axis the tool
/// falls through the housing to the depth, within the chamfer a little.
class KinematicRobot : public Robot {
 public:
  KinematicRobot(std::vector<Box> boxes, const Task& task, const Pose& world_T_target, const Pose& world_T_tool,
                 const RobotFaults& faults, RandomStream random);

  Pose ToolPose() const override;
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return time_s_; }
  MotionResult Transfer(const Pose& world_T_tool) override;
  MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) override;
  MotionResult Guarded(const GuardedMotion& motion) override;
  MotionResult Compliant(const CompliantMotion& motion) override;

  /// In the opening, at depth.
  bool Inserted() const { return inserted_; }

 private:
  MotionResult Go(const Eigen::Vector3d& to_world_m, double speed_m_s, bool watched);
  MotionResult BySteps(const Eigen::Vector3d& to_world_m, double speed_m_s);
  MotionResult Travel(const Eigen::Vector3d& to_world_m, double speed_m_s, bool watched);
  Eigen::Vector3d Displacement(const Eigen::Vector3d& world_m) const;
  bool InOpening(const Eigen::Vector3d& displacement_m) const;
  /// Distance from the axis of the opening, the greater of both axes.
  double Aside(const Eigen::Vector3d& displacement_m) const;
  /// The tool is turned by no more than the opening allows (2.4 degrees).
  bool FitsByYaw() const;
  double Noise(double sigma) { return sigma * random_.Normal(); }

  std::vector<Box> boxes_;
  Task task_;
  Pose world_T_target_;
  Pose world_T_tool_;  ///< true
  RobotFaults faults_;
  RandomStream random_;
  double time_s_ = 0.0;
  bool inserted_ = false;
  Eigen::Vector3d pressing_ = Eigen::Vector3d::Zero();  ///< direction of the motion that ended at a felt contact
};

}  // namespace feeler::execution
