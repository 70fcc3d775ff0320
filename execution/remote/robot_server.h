#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "feeler/core/progress.h"
#include "feeler/core/robot.h"
#include "feeler/execution/remote/link.h"
#include "feeler/execution/remote/ordered_faults.h"
#include "feeler/execution/remote/protocol/messages.h"
#include "feeler/execution/remote/socket.h"

namespace feeler::execution {

/// What no served robot is asked for, whatever it is: stiffness and turning rate of its tool (docs/robot-protocol.md).
inline constexpr double kMostStiffness_n_m = 1e5;
inline constexpr double kMostRotationalStiffness_nm_rad = 1e4;
inline constexpr double kMostRate_rad_s = 3.2;
/// A `linear` or `twist` with a contact force from here on is not watched: a retreat begins in contact.
inline constexpr double kNotWatched_n = 1e5;

/// A robot to be served, and what `feeler::Robot` has no word for; functions may be empty.
struct ServedRobot {
  Robot& robot;
  std::string name;
  Capabilities capabilities;
  /// Takes a question that the robot asks at least every 2 ms on its clock while it moves: a text brings it to rest,
  /// and the motion ends with kAborted and that text. Without it a motion cannot be stopped from here.
  std::function<void(std::function<std::string()>)> ask_while_moving;
  /// Simulations: places everything for an episode (the one given, or the next) and says what an executor is told. The
  /// extents that are asked for are a wish: those of the reply hold.
  std::function<EpisodeReply(const EpisodeRequest&)> begin_episode;
  /// Simulations: the truth about the episode as the world stands.
  std::function<VerdictReply()> judge;
  /// Simulations: transfers at this much of their speed, from now on (an ordered safety field).
  std::function<void(double)> slow_transfers;
  /// Simulations: a transfer has ended (the first one of an episode leads to the start pose).
  std::function<void(const MotionResult&)> after_transfer;
};

struct ServerOptions {
  std::string token;      ///< empty: none is asked for
  bool lockstep = false;  ///< the robot's time is no wall time: no heartbeats, no pacing
  /// A simulation that keeps to wall time: a second of its clock takes a second. Ignored in lockstep.
  bool paced = false;
  double link_timeout_s = kLinkTimeout_s;
  OrderedFaults faults;
  std::uint64_t seed = 1;  ///< of the faults
};

/// What a server has seen, for tests and for people.
struct ServerStatistics {
  int sessions = 0;
  int refused_sessions = 0;  ///< wrong token, version, units, or somebody was there already
  int motions = 0;
  int refused_motions = 0;  ///< before the start, after a stop, outside of the capabilities
  int lost_links = 0;
  int bad_frames = 0;
  int protective_stops = 0;
  int ordered[kWireFaultCount] = {};  ///< faults that came
};

/// How a session ended.
enum class SessionEnd { kBye, kClosed, kLost, kRefused, kInterrupted };

/// The robot's end of the protocol (docs/robot-protocol.md), over any robot.
///
/// Laws: nothing moves before hello and start, nor after a frame that is not sound, a number that is out of sequence, a
/// protective stop that was not recovered from, or the loss of the link; a motion under way comes to rest then. Motions
/// outside of the capabilities are refused. One session at a time; another one that knocks is told "busy".
/// The robot is called from the thread that serves alone; in real time another one sends the heartbeats, so that a
/// robot that plans is not silent.
class RobotServer {
 public:
  RobotServer(ServedRobot served, ServerOptions options);

  /// One session, from its hello to its end. `listener`, if there is one, turns away who else knocks meanwhile.
  SessionEnd Serve(Connection connection, Listener* listener = nullptr,
                   const CancellationToken* cancellation = nullptr);

  const ServerStatistics& statistics() const { return statistics_; }
  /// Episodes whose verdict was asked for.
  std::int64_t episodes_judged() const { return episodes_judged_; }

 private:
  std::optional<SessionEnd> Greet(const std::string& line);
  /// What a request that is not a motion is answered; nothing where the session ends.
  std::optional<SessionEnd> Handle(const Framed<Request>& framed);
  std::optional<SessionEnd> Move(std::uint64_t seq, const Request& request);
  std::string Refusal(const Request& request) const;
  MotionResult Run(const Request& request);
  /// Asked by the robot while it moves.
  std::string WhileMoving();
  std::optional<SessionEnd> NextFrame();
  void PumpWhileMoving();
  std::string StrikeWhileMoving();
  /// Faults of the reply itself. True if the session is over.
  bool StrikeReply(std::uint64_t seq, ResultReply reply);
  bool Comes(WireFault fault);
  bool Silent() const;
  void TurnAway();
  /// Of this instant; also what heartbeats tell until the next call.
  RobotState State();
  void Beat();
  void Send(std::uint64_t seq, const Reply& reply);
  SessionEnd Fail(std::uint64_t seq, const std::string& code, const std::string& text);

  ServedRobot served_;
  ServerOptions options_;
  ServerStatistics statistics_;
  std::int64_t episodes_judged_ = 0;

  // Of the session.
  std::optional<Link> link_;
  Listener* listener_ = nullptr;
  const CancellationToken* cancellation_ = nullptr;
  WireForm form_ = WireForm::kJson;
  RobotMode mode_ = RobotMode::kWaiting;
  bool greeted_ = false;
  std::uint64_t seq_ = 0;
  double heard_s_ = 0.0;  ///< wall time of the last frame
  std::thread beater_;
  std::atomic<bool> beating_{false};
  std::atomic<double> silent_until_s_{0.0};  ///< no heartbeat before (an ordered stall)
  std::mutex beat_mutex_;
  std::string beat_;  ///< the heartbeat as it is to be sent

  // Of the motion.
  std::string stop_;  ///< why it is to end
  int asked_ = 0;
  double motion_began_s_ = 0.0;  ///< robot time
  double wall_began_s_ = 0.0;
  std::optional<double> dropped_s_;   ///< robot time at which the link broke
  std::vector<std::string> waiting_;  ///< frames that came meanwhile

  // Of the episode.
  std::vector<PlannedFault> planned_;
  int episode_motions_ = 0;
};

}  // namespace feeler::execution
