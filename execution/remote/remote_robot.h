#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "feeler/core/progress.h"
#include "feeler/core/robot.h"
#include "feeler/execution/remote/protocol/messages.h"
#include "feeler/execution/remote/socket.h"

namespace feeler::execution {

/// What was measured of contacts in this cell (feeler cell calibrate).
struct MeasuredContact {
  std::optional<double> stiffness_n_m;
  std::optional<double> reaction_time_s;
  std::optional<double> force_noise_n;
};

struct RemoteOptions {
  std::string token;
  WireForm form = WireForm::kJson;
  double heartbeat_s = kHeartbeat_s;                ///< between heartbeats of this end
  double hello_timeout_s = 5.0;                     ///< for the welcome
  double lockstep_timeout_s = 120.0;                ///< for a reply of a robot in lockstep, in wall time
  double transfer_timeout_s = 180.0;                ///< for the end of a transfer in real time
  double link_timeout_s = kLinkTimeout_s;           ///< a robot that may be silent for longer is refused
  const CancellationToken* cancellation = nullptr;  ///< stops the robot
  MeasuredContact measured;                         ///< stands above what the robot says
};

/// The executor's end of the protocol (docs/robot-protocol.md): a robot behind a wire as a `Robot`.
///
/// Everything that comes is checked: the form, units and version, the order of sequence numbers, a clock that does not
/// go back, poses that do not jump, motions that end where they may end. The first fault, or a link that is silent for
/// the time that the robot states, ends the session: from then on no motion is sent; each ends with kAborted and "link
/// lost: ..." at once. No motion is sent to a robot that says that it waits, has stopped by itself or is out of order.
/// Real time: a thread of this object sends heartbeats and reads. Lockstep: no thread; calls read by themselves.
class RemoteRobot final : public Robot {
 public:
  /// Says hello over a fresh connection. Throws WorldError or InputError (version, units, token, capabilities).
  RemoteRobot(Connection connection, const RemoteOptions& options);
  ~RemoteRobot() override;
  RemoteRobot(const RemoteRobot&) = delete;
  RemoteRobot& operator=(const RemoteRobot&) = delete;

  // Robot:
  Pose ToolPose() const override { return State().world_T_tool; }
  Wrench ContactWrench() const override { return State().wrench; }
  double Time() const override { return State().time_s; }
  std::vector<double> JointPositions() const override { return State().joints_rad; }
  void ZeroWrench() override;
  MotionResult Transfer(const Pose& world_T_tool) override;
  MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) override;
  MotionResult Guarded(const GuardedMotion& motion) override;
  MotionResult Compliant(const CompliantMotion& motion) override;
  /// Asks the robot, and puts what was measured in its place. Of a robot that does not answer: what it stated at hello.
  ContactResponse Contact(const Eigen::Vector3d& direction) const override;
  CameraView Look() override;
  MotionResult FollowTwist(const TwistMotion& motion) override;

  /// The operator lets the robot move. Throws WorldError where it is not ready then.
  void Start();
  /// After a protective stop, when somebody has looked. Throws WorldError where it is not ready then.
  void Recover();
  /// Simulations: the next episode, or that one, of these extents if the simulation is free to choose (empty: as it
  /// draws). Throws WorldError where there is none.
  EpisodeReply BeginEpisode(std::optional<std::uint64_t> episode, const std::vector<int>& extents = {});
  VerdictReply Verdict();
  /// Says goodbye; the robot is at rest.
  void Bye();

  const WelcomeReply& welcome() const { return welcome_; }
  /// As last heard.
  RobotState State() const;
  /// Why the session is over; empty while it is not.
  std::string lost() const;
  /// Whether the session is over because the robot said what cannot be.
  bool spoke_nonsense() const;

 private:
  /// The straight or bent way of a motion: what of its end is known before.
  struct Way {
    double longest_m = 0.0;
    double turn_rad = 0.0;                     ///< between its ends, as commanded
    std::optional<Pose> end;                   ///< where it stands when it is reached
    double timeout_s = 0.0;                    ///< for its end, in real time
    std::optional<Eigen::Vector3d> direction;  ///< it leads nowhere else
  };
  Reply Exchange(const Request& request);
  /// Sends it and waits; empty, with the reason in lost_, when the session ends.
  std::optional<Reply> TryExchange(const Request& request, double timeout_s = 10.0);
  std::optional<Reply> Await(double timeout_s);
  bool SendFrame(const Request& request, std::uint64_t& seq);
  /// Reads one line and files it. False if there was none in time.
  bool TakeLine(double timeout_s);
  void File(const std::string& line);
  /// Takes the state that a reply carries as the reply comes in: heartbeats that follow are later.
  void TakeState(const Reply& reply);
  void CheckState(const RobotState& state, bool may_move);
  void Lose(const std::string& reason, bool nonsense = false);
  [[noreturn]] static void RefuseMessageOf(const std::string& what);
  void Pump();
  MotionResult Move(const Request& request, const Way& way);
  /// Why the motion cannot have ended so; empty: it can.
  std::string FaultOf(const ResultReply& ended, const Pose& before, const Way& way) const;
  MotionResult NotSent(StopReason reason, const std::string& detail) const;
  void RequireState(const Reply& reply);
  void RequireReady(const char* after) const;

  RemoteOptions options_;
  Connection connection_;
  WelcomeReply welcome_;
  std::uint64_t seq_ = 0;
  bool stop_sent_ = false;

  mutable std::mutex mutex_;  ///< of what follows
  std::condition_variable arrived_;
  RobotState state_;
  std::string lost_;
  bool nonsense_ = false;
  std::optional<Framed<Reply>> reply_;
  std::uint64_t stop_seq_ = 0;  ///< a reply to it is expected beside the one awaited
  bool moving_ = false;         ///< a motion is under way
  double heard_s_ = 0.0;

  std::mutex sending_;  ///< one frame at a time
  std::atomic<bool> ending_{false};
  std::thread pump_;  ///< real time only
};

}  // namespace feeler::execution
