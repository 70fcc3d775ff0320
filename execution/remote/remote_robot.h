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

struct RemoteOptions {
  std::string token;
  WireForm form = WireForm::kJson;
  double heartbeat_s = kHeartbeat_s;                ///< between heartbeats of this end
  double hello_timeout_s = 5.0;                     ///< for the welcome
  double lockstep_timeout_s = 120.0;                ///< for a reply of a robot in lockstep, in wall time
  double motion_timeout_s = 180.0;                  ///< for the end of a motion in real time
  const CancellationToken* cancellation = nullptr;  ///< stops the robot
};

/// The executor's end of the protocol (docs/robot-protocol.md): a robot behind a wire as a `Robot`.
///
/// Everything that comes is checked: the form, units and version, the order of sequence numbers, a clock that does not
/// go back, poses that do not jump. The first fault, or a link that is silent for the time that the robot states, ends
/// the session: from then on no motion is sent; each ends with kAborted and "link lost: ..." at once.
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
  /// Asks the robot; what a robot answers that does not know is up to it. The defaults once the link is lost.
  ContactResponse Contact(const Eigen::Vector3d& direction) const override;
  CameraView Look() override;
  MotionResult FollowTwist(const TwistMotion& motion) override;

  /// The operator lets the robot move.
  void Start();
  /// After a protective stop, when somebody has looked.
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

 private:
  Reply Exchange(const Request& request);
  /// Sends it and waits; empty, with the reason in lost_, when the session ends.
  std::optional<Reply> TryExchange(const Request& request);
  std::optional<Reply> Await(std::uint64_t seq, double timeout_s);
  bool SendFrame(const Request& request, std::uint64_t& seq);
  /// Reads one line and files it. False if there was none in time.
  bool TakeLine(double timeout_s);
  void File(const std::string& line);
  /// Takes the state that a reply carries as the reply comes in: heartbeats that follow are later.
  void TakeState(const Reply& reply);
  void CheckState(const RobotState& state, bool may_move);
  void Lose(const std::string& reason);
  [[noreturn]] static void RefuseMessageOf(const std::string& what);
  void Pump();
  MotionResult Move(const Request& request, double longest_m);
  void RequireState(const Reply& reply);

  RemoteOptions options_;
  Connection connection_;
  WelcomeReply welcome_;
  std::uint64_t seq_ = 0;
  bool stop_sent_ = false;

  mutable std::mutex mutex_;  ///< of what follows
  std::condition_variable arrived_;
  RobotState state_;
  std::string lost_;
  std::optional<Framed<Reply>> reply_;
  std::uint64_t stop_seq_ = 0;  ///< a reply to it is expected beside the one awaited
  bool moving_ = false;         ///< a motion is under way
  double heard_s_ = 0.0;

  std::mutex sending_;  ///< one frame at a time
  std::atomic<bool> ending_{false};
  std::thread pump_;  ///< real time only
};

}  // namespace feeler::execution
