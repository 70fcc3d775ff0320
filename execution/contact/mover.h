#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/robot.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/execution/contact/executor_options.h"
#include "feeler/execution/contact/lattice_frame.h"

namespace feeler::execution {

/// Ends an execution; `what()` becomes the reason in the record. Never leaves the room.
class ExecutionFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What was felt does not fit what the policy knows, or it knows no further: robot and episode are sound, and another
/// plan may do better.
class LostTrack : public ExecutionFailure {
 public:
  using ExecutionFailure::ExecutionFailure;
};

/// Where a motion ended, as measured, in lattice coordinates.
struct MotionReport {
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  bool contact = false;  ///< by force, or because the motion fell short
  bool felt = false;     ///< by force: the robot says so
  StopReason reason = StopReason::kReached;
};

/// Predicted travel in cells, least and greatest.
using PredictedCells = std::optional<std::array<double, 2>>;

/// What a probe may meet beside a face across its way.
struct MayMeet {
  bool long_wall = false;  ///< one that stops the tool along so much of its length that it cannot turn
  /// An edge between the way and this direction (unit vector, lattice axes), which pushes the tool anywhere between.
  std::optional<Eigen::Vector3d> edge_towards;
};

/// What says that a way is free.
enum class FreeBy {
  kBelief,    ///< no hypothesis left blocks it, or what is felt has pinned the target
  kEstimate,  ///< a fit to touches that are not yet confirmed: what it meets is to be met within the budget
  kInside     ///< nothing, where the tool may stand in the opening: the same, of walls that hold it along its length
};

/// Moves the tool in lattice coordinates, with the orientation of the estimate, and writes every motion into the
/// record. Throws ExecutionFailure when the robot fails, answers nonsense, or the limits of the episode are exceeded.
class Mover {
 public:
  /// All references outlive the mover. `insertion`: faces of tool and target lie across it, so that what is met along
  /// it holds the tool, which cannot turn away. `started_s`: when the episode began, on the clock of the robot.
  Mover(Robot& robot, const LatticeFrame& frame, Direction insertion, const ExecutorOptions& options,
        ExecutionRecord& record, double started_s);

  /// Where the tool was last sent, or found at contact.
  const Eigen::Vector3d& position() const { return position_; }
  const LatticeFrame& frame() const { return frame_; }
  const ExecutorOptions& options() const { return options_; }
  double Cells(double metres) const { return metres / frame_.cell_m; }
  /// From this far before a face that is where it is thought to be motions towards it are slow, cells.
  double FaceMargin() const;

  /// From now on a contact of a fast motion is believed when it comes again at the same place. Where steps get lost
  /// (contacts are missed, or steps spent in vain) a motion that ends short without a contact goes on from there, and
  /// has met something once it gets no farther.
  void DoubtReadings(bool steps_get_lost) {
    doubts_ = true;
    steps_get_lost_ = steps_get_lost;
  }

  /// Fast and straight to `target`, watched for contact.
  MotionReport Fast(const Eigen::Vector3d& target, const std::string& kind, const PredictedCells& predicted = {},
                    FreeBy free_by = FreeBy::kBelief);
  /// Slowly along an axis until its coordinate is `coordinate` or a contact comes.
  MotionReport Probe(Direction direction, double coordinate, const std::string& kind, const PredictedCells& predicted,
                     const MayMeet& may_meet = {});
  /// The same in one motion, however short it ends.
  MotionReport ProbeOnce(Direction direction, double coordinate, const std::string& kind,
                         const PredictedCells& predicted, const MayMeet& may_meet = {});
  /// Off a wall: contacts are expected to end, not watched for. Then takes the wrench as zero.
  void Retreat(const Eigen::Vector3d& target);
  /// Compliantly from here straight to `target`, at the speed of an insertion or `speed_m_s`, until the tool rests or,
  /// where it goes on at once, until it should be there.
  MotionReport Insert(const Eigen::Vector3d& target, std::optional<double> speed_m_s = {}, bool rests = true);
  /// How fast the tool may meet a wall in this direction (unit vector, lattice axes) as it stands, m/s; one that holds
  /// it along its length if `held`.
  double SpeedInto(const Eigen::Vector3d& direction, bool held = false) const;
  /// Compliantly through way points, pressing on what is under the tool; `stiffness_n_m` along the tool's axis where it
  /// is not a compliant motion's own.
  MotionReport Press(const std::vector<Eigen::Vector3d>& way_points, double speed_m_s, const std::string& kind,
                     std::optional<double> stiffness_n_m = {});
  /// Follows a velocity, watched for contact. Motions one after the other are one in the record, of kind "servo".
  MotionReport Follow(const TwistMotion& motion);
  /// What is felt explains whatever a way has met: the ways from here on are known again.
  void TrustAgain() {
    record_.careful = false;
    record_.startled = 0;
  }
  /// Until a contact along the insertion has told how high the target stands, ways along it are no faster than
  /// kUnfelt_m_s.
  void KnowHeight(bool known) { height_known_ = known; }
  /// Nothing of the target stands farther out, against the insertion, than this coordinate along it, which was felt:
  /// ways that stay out there are free whatever surprised the tool below, and ways straight in are so up to there.
  /// After a surprise long ways pass by there.
  void KeepClearOf(double outmost) { outmost_ = outmost; }
  CameraView Look() { return robot_.Look(); }
  /// Lattice coordinates of what is at `tool_T_thing` as the tool stands now.
  Eigen::Vector3d Locate(const Pose& tool_T_thing) const { return Measure(robot_.ToolPose() * tool_T_thing); }
  void ZeroWrench() { robot_.ZeroWrench(); }

 private:
  MotionReport FastOnce(const Eigen::Vector3d& target, const std::string& kind, const PredictedCells& predicted,
                        FreeBy free_by);
  /// Where steps get lost: makes `motion` again as long as it ends short, no contact is felt, and it gets farther.
  MotionReport Onward(const std::function<MotionReport()>& motion) const;
  Eigen::Vector3d Measure(const Pose& world_T_tool) const;
  /// Of what the tool meets along `direction` (unit vector, lattice axes); one that holds it along its length if
  /// `held`.
  ContactResponse ContactAlong(const Eigen::Vector3d& direction, bool held) const;
  /// The speed of a probe along `direction` (unit vector, world axes) that keeps the budget at whatever it may meet.
  double SpeedOfProbe(const Eigen::Vector3d& direction, const ContactResponse& face, const MayMeet& may_meet) const;
  /// The speed along `way` (unit vector, lattice axes) that keeps the budget at faces along any axis and at the edges
  /// between them.
  double SpeedOfCarefulWay(const Eigen::Vector3d& way) const;
  /// The way to `target` stays outside of KeepClearOf.
  bool StaysOut(const Eigen::Vector3d& target) const;
  /// Where a way straight in comes to what KeepClearOf tells; empty if it does not, or begins there.
  std::optional<Eigen::Vector3d> EndOfFreeWay(const Eigen::Vector3d& target) const;
  /// The way points of a way by way of what KeepClearOf tells: straight out to there, over, and straight in again;
  /// empty where the direct way is not much longer than what is slow of it.
  std::vector<Eigen::Vector3d> WayOver(const Eigen::Vector3d& target) const;
  void CheckLimits() const;
  /// Logs a motion and turns it into a report. `shortfall`: ending short of `target` counts as contact.
  MotionReport Finish(const MotionResult& result, const Eigen::Vector3d& target, const std::string& kind,
                      const PredictedCells& predicted, bool shortfall);

  Robot& robot_;
  const LatticeFrame& frame_;
  Direction insertion_;
  const ExecutorOptions& options_;
  bool height_known_ = true;
  std::optional<double> outmost_;
  ExecutionRecord& record_;
  double start_time_s_;
  double last_motion_end_s_;
  Eigen::Vector3d position_;
  bool doubts_ = false;
  bool steps_get_lost_ = false;
};

/// The axis direction nearest to `motion` if it is along an axis but for 10 % of its length.
std::optional<Direction> DirectionOf(const Eigen::Vector3d& motion);

}  // namespace feeler::execution
