#include "feeler/execution/remote/remote_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/execution/remote/protocol/messages_numbers.h"
#include "feeler/version.h"

namespace feeler::execution {
namespace {

/// A robot at rest is reported within this of where it was, and a motion ends within this of what it can reach.
constexpr double kJump_m = 0.02;
/// Looks for a cancellation so often while it waits.
constexpr double kLook_s = 0.05;
constexpr double kAnyLength = 1e9;

[[noreturn]] void RefuseRobot(const std::string& what, const std::string& mend) {
  throw InputError("robot", what, mend);
}

void RequireSound(const WelcomeReply& welcome) {
  if (welcome.version != kProtocolVersion) {
    RefuseRobot(fmt::format("speaks version {} of the protocol, feeler speaks {}", welcome.version, kProtocolVersion),
                "update the robot's program or feeler");
  }
  if (welcome.units != kProtocolUnits) {
    RefuseRobot("counts in '" + welcome.units + "'", "it must count in " + std::string(kProtocolUnits));
  }
  const Capabilities& c = welcome.capabilities;
  for (const char* motion : {"transfer", "linear", "guarded", "compliant"}) {
    if (std::find(c.motions.begin(), c.motions.end(), motion) == c.motions.end()) {
      RefuseRobot(std::string("has no motion '") + motion + "'",
                  "the executor needs it: teach it to the robot's program");
    }
  }
  if (!(c.workspace_min_m.array() < c.workspace_max_m.array()).all()) {
    RefuseRobot("states a workspace without room", "give its least and greatest corner");
  }
}

}  // namespace

RemoteRobot::RemoteRobot(Connection connection, const RemoteOptions& options)
    : options_(options), connection_(std::move(connection)) {
  heard_s_ = MonotonicSeconds();
  const HelloRequest hello{kProtocolVersion, std::string(kProtocolUnits), std::string("feeler ") + FEELER_VERSION,
                           options_.token};
  if (!connection_.Write(EncodeRequest(options_.form, 0, hello) + "\n")) {
    throw WorldError("robot", "the connection is gone before hello", "see what its program says");
  }
  std::string line;
  const LineStatus status = connection_.ReadLine(line, options_.hello_timeout_s);
  if (status == LineStatus::kTimeout) {
    throw WorldError("robot", "does not answer hello", "is it feeler's protocol that listens there?");
  }
  if (status != LineStatus::kLine) throw WorldError("robot", "hung up at hello", "another session may be under way");
  const std::optional<WireForm> form = FormOf(line);
  const Reply reply = DecodeReply(form.value_or(options_.form), line).body;
  if (const auto* error = std::get_if<ErrorReply>(&reply)) {
    const char* mend = error->code == "token"  ? "give the robot's token with --token-file"
                       : error->code == "busy" ? "wait until the other session has ended"
                                               : "both ends must speak docs/robot-protocol.md, version 1";
    RefuseRobot("refused the session: " + error->code + ", " + error->text, mend);
  }
  if (!std::holds_alternative<WelcomeReply>(reply)) RefuseRobot("answers hello with something else", "see its program");
  welcome_ = std::get<WelcomeReply>(reply);
  RequireSound(welcome_);
  state_ = welcome_.state;
  heard_s_ = MonotonicSeconds();
  if (!welcome_.lockstep) pump_ = std::thread([this] { Pump(); });
}

RemoteRobot::~RemoteRobot() {
  ending_ = true;
  connection_.Shutdown();
  if (pump_.joinable()) pump_.join();
}

RobotState RemoteRobot::State() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::string RemoteRobot::lost() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

void RemoteRobot::Lose(const std::string& reason) {
  {
    const std::lock_guard lock(mutex_);
    if (lost_.empty()) lost_ = reason;
  }
  connection_.Shutdown();
  arrived_.notify_all();
}

void RemoteRobot::CheckState(const RobotState& state, bool may_move) {  // mutex_ is held
  constexpr double kRounding_s = 1e-6;
  if (state.time_s < state_.time_s - kRounding_s) RefuseMessageOf("the clock of the robot goes back");
  const double moved_m = (state.world_T_tool.translation() - state_.world_T_tool.translation()).norm();
  if (!may_move && moved_m > kJump_m) {
    RefuseMessageOf(fmt::format("the reported pose jumps by {:.0f} mm", 1e3 * moved_m));
  }
  state_ = state;
}

void RemoteRobot::File(const std::string& line) {
  Framed<Reply> framed = DecodeReply(options_.form, line);
  {
    const std::lock_guard lock(mutex_);
    heard_s_ = MonotonicSeconds();
    if (framed.seq == 0) {
      if (const auto* beat = std::get_if<StateReply>(&framed.body)) {
        CheckState(beat->state, moving_);
        return;
      }
      if (const auto* error = std::get_if<ErrorReply>(&framed.body)) RefuseMessageOf(error->code + ", " + error->text);
      RefuseMessageOf("a reply without a number");
    }
    if (stop_seq_ != 0 && framed.seq == stop_seq_) {
      stop_seq_ = 0;
      return;
    }
    if (reply_ || framed.seq != seq_) {
      // The reply to a motion that was ordered to stop has the number before that of the stop.
      const bool of_stopped = stop_seq_ != 0 && framed.seq + 1 == stop_seq_ && !reply_;
      if (!of_stopped) RefuseMessageOf(fmt::format("reply {} where {} is due", framed.seq, seq_));
      framed.seq = seq_;
    }
    TakeState(framed.body);
    reply_ = std::move(framed);
  }
  arrived_.notify_all();
}

void RemoteRobot::TakeState(const Reply& reply) {  // mutex_ is held
  if (const auto* result = std::get_if<ResultReply>(&reply)) {
    CheckState(result->state, true);
    moving_ = false;
  } else if (const auto* state = std::get_if<StateReply>(&reply)) {
    CheckState(state->state, moving_);
  } else if (const auto* episode = std::get_if<EpisodeReply>(&reply)) {
    state_ = episode->state;  // a new world: neither clock nor pose follow from the last
  }
}

void RemoteRobot::RefuseMessageOf(const std::string& what) {
  throw InputError("robot message", what, "see the program of the robot");
}

bool RemoteRobot::TakeLine(double timeout_s) {
  std::string line;
  switch (connection_.ReadLine(line, timeout_s)) {
    case LineStatus::kTimeout: return false;
    case LineStatus::kClosed: Lose("the robot hung up"); return false;
    case LineStatus::kTooLong: Lose("a message of the robot is too long"); return false;
    case LineStatus::kLine: break;
  }
  try {
    File(line);
  } catch (const InputError& error) {
    Lose(error.what());
    return false;
  }
  return true;
}

void RemoteRobot::Pump() {
  double told_s = 0.0;
  while (!ending_) {
    const double now_s = MonotonicSeconds();
    if (now_s - told_s >= options_.heartbeat_s) {
      told_s = now_s;
      const std::lock_guard lock(sending_);
      if (!connection_.Write(EncodeRequest(options_.form, 0, HeartbeatRequest{}) + "\n")) Lose("the robot hung up");
    }
    const double wait_s = std::max(0.0, told_s + options_.heartbeat_s - MonotonicSeconds());
    TakeLine(std::max(wait_s, 1e-4));
    double silent_s = 0.0;
    {
      const std::lock_guard lock(mutex_);
      if (!lost_.empty()) return;
      silent_s = MonotonicSeconds() - heard_s_;
    }
    if (silent_s > welcome_.link_timeout_s && !TakeLine(0.0)) {
      Lose(fmt::format("silent for {:g} s", welcome_.link_timeout_s));
      return;
    }
  }
}

bool RemoteRobot::SendFrame(const Request& request, std::uint64_t& seq) {
  const std::lock_guard lock(sending_);
  {
    const std::lock_guard state_lock(mutex_);
    if (!lost_.empty()) return false;
    seq = seq_ + 1;
  }
  const std::string line = EncodeRequest(options_.form, seq, request) + "\n";
  {
    const std::lock_guard state_lock(mutex_);
    seq_ = seq;
    if (std::holds_alternative<StopRequest>(request)) stop_seq_ = seq;
  }
  if (connection_.Write(line)) return true;
  Lose("the robot hung up");
  return false;
}

std::optional<Reply> RemoteRobot::Await(std::uint64_t /*seq*/, double timeout_s) {
  const double end_s = MonotonicSeconds() + timeout_s;
  for (;;) {
    if (options_.cancellation != nullptr && options_.cancellation->cancelled() && !stop_sent_) {
      std::uint64_t seq = 0;
      stop_sent_ = SendFrame(StopRequest{}, seq);
    }
    if (welcome_.lockstep) {
      TakeLine(kLook_s);
    } else {
      std::unique_lock lock(mutex_);
      arrived_.wait_for(lock, std::chrono::duration<double>(kLook_s), [&] { return reply_ || !lost_.empty(); });
    }
    {
      const std::lock_guard lock(mutex_);
      if (reply_) {
        Reply reply = std::move(reply_->body);
        reply_.reset();
        return reply;
      }
      if (!lost_.empty()) return std::nullopt;
    }
    if (MonotonicSeconds() > end_s) Lose(fmt::format("no reply within {:g} s", timeout_s));
  }
}

std::optional<Reply> RemoteRobot::TryExchange(const Request& request) {
  std::uint64_t seq = 0;
  if (!SendFrame(request, seq)) return std::nullopt;
  const bool motion = IsMotion(request);
  return Await(seq, welcome_.lockstep ? options_.lockstep_timeout_s : motion ? options_.motion_timeout_s : 10.0);
}

Reply RemoteRobot::Exchange(const Request& request) {
  std::optional<Reply> reply = TryExchange(request);
  if (!reply) throw WorldError("robot", "link lost: " + lost(), "see that it runs and that the network holds");
  if (const auto* error = std::get_if<ErrorReply>(&*reply)) {
    throw WorldError("robot", std::string(NameOf(request)) + " refused: " + error->text, "see what its program says");
  }
  return *std::move(reply);
}

void RemoteRobot::RequireState(const Reply& reply) {
  if (!std::holds_alternative<StateReply>(reply)) Lose("answers with something else than its state");
}

void RemoteRobot::ZeroWrench() {
  const std::optional<Reply> reply = TryExchange(ZeroRequest{});
  if (reply) RequireState(*reply);
}

void RemoteRobot::Start() { RequireState(Exchange(StartRequest{})); }
void RemoteRobot::Recover() { RequireState(Exchange(RecoverRequest{})); }

void RemoteRobot::Bye() {
  std::uint64_t seq = 0;
  SendFrame(ByeRequest{}, seq);
}

EpisodeReply RemoteRobot::BeginEpisode(std::optional<std::uint64_t> episode, const std::vector<int>& extents) {
  const Reply reply = Exchange(EpisodeRequest{episode, extents});
  const auto* told = std::get_if<EpisodeReply>(&reply);
  if (told == nullptr) throw WorldError("robot", "answers an episode with something else", "see its program");
  return *told;
}

VerdictReply RemoteRobot::Verdict() {
  const Reply reply = Exchange(VerdictRequest{});
  const auto* verdict = std::get_if<VerdictReply>(&reply);
  if (verdict == nullptr) throw WorldError("robot", "answers a verdict with something else", "see its program");
  return *verdict;
}

MotionResult RemoteRobot::Move(const Request& request, double longest_m) {
  if (options_.cancellation != nullptr && options_.cancellation->cancelled()) {
    MotionResult result;
    result.reason = StopReason::kAborted;
    result.detail = "stopped by order";
    result.world_T_tool = ToolPose();
    return result;
  }
  const Pose before = ToolPose();
  {
    const std::lock_guard lock(mutex_);
    moving_ = true;
  }
  const std::optional<Reply> reply = TryExchange(request);
  const std::lock_guard lock(mutex_);
  moving_ = false;
  const auto lost_here = [&](const std::string& reason) {
    if (lost_.empty()) lost_ = reason;
    connection_.Shutdown();
    MotionResult result;
    result.reason = StopReason::kAborted;
    result.detail = "link lost: " + lost_;
    result.world_T_tool = state_.world_T_tool;
    return result;
  };
  if (!reply) return lost_here("no reply");
  if (const auto* error = std::get_if<ErrorReply>(&*reply)) {
    MotionResult result;
    result.reason = StopReason::kUnplanned;
    result.detail = "refused by the robot: " + error->text;
    result.world_T_tool = state_.world_T_tool;
    return result;
  }
  const auto* ended = std::get_if<ResultReply>(&*reply);
  if (ended == nullptr) return lost_here("answers a motion with something else");
  const double moved_m = (ended->result.world_T_tool.translation() - before.translation()).norm();
  if (moved_m > longest_m + kJump_m) {
    return lost_here(
        fmt::format("the reported pose jumps: {:.0f} mm in a motion of {:.0f} mm", 1e3 * moved_m, 1e3 * longest_m));
  }
  const double settled_m = (ended->state.world_T_tool.translation() - ended->result.world_T_tool.translation()).norm();
  if (settled_m > kJump_m) return lost_here("the reported pose jumps at the end of a motion");
  return ended->result;
}

MotionResult RemoteRobot::Transfer(const Pose& world_T_tool) { return Move(TransferRequest{world_T_tool}, kAnyLength); }

MotionResult RemoteRobot::LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) {
  const double length_m = (world_T_tool.translation() - ToolPose().translation()).norm();
  return Move(LinearRequest{world_T_tool, speed_m_s, contact_force_n}, length_m);
}

MotionResult RemoteRobot::Guarded(const GuardedMotion& motion) { return Move(motion, motion.distance_m); }

MotionResult RemoteRobot::Compliant(const CompliantMotion& motion) {
  const auto length_m = [&](const CompliantMotion& part) {
    double farthest_m = 0.0;
    const Eigen::Vector3d here = ToolPose().translation();
    for (const Pose& pose : part.world_T_tool) farthest_m = std::max(farthest_m, (pose.translation() - here).norm());
    return farthest_m;
  };
  if (options_.form == WireForm::kJson || motion.world_T_tool.size() <= kMostWayPointsInNumbers) {
    return Move(motion, length_m(motion));
  }
  // The numbers-only form knows few way points: one piece after the other, at rest in between.
  MotionResult whole;
  CompliantMotion piece = motion;
  const double began_s = Time();
  for (std::size_t i = 0; i < motion.world_T_tool.size(); i += kMostWayPointsInNumbers) {
    const auto from = motion.world_T_tool.begin() + static_cast<std::ptrdiff_t>(i);
    const std::size_t count = std::min(kMostWayPointsInNumbers, motion.world_T_tool.size() - i);
    piece.world_T_tool.assign(from, from + static_cast<std::ptrdiff_t>(count));
    piece.time_limit_s = std::max(0.01, motion.time_limit_s - (Time() - began_s));
    MotionResult result = Move(piece, length_m(piece));
    result.travelled_m += whole.travelled_m;
    result.peak_force_n = std::max(result.peak_force_n, whole.peak_force_n);
    whole = result;
    if (whole.reason != StopReason::kReached && whole.reason != StopReason::kContact) break;
  }
  return whole;
}

ContactResponse RemoteRobot::Contact(const Eigen::Vector3d& direction) const {
  // Asking goes over the link, and changes nothing of the robot.
  const std::optional<Reply> reply = const_cast<RemoteRobot*>(this)->TryExchange(ContactRequest{direction});
  const auto* told = reply ? std::get_if<ContactReply>(&*reply) : nullptr;
  if (told == nullptr) return Robot::Contact(direction);
  ContactResponse contact;
  contact.held_mass_kg = told->held_mass_kg;
  contact.free_mass_kg = told->free_mass_kg;
  contact.stiffness_n_m = told->stiffness_n_m;
  contact.damping_ratio = told->damping_ratio;
  contact.reaction_time_s = told->reaction_time_s;
  contact.force_noise_n = told->force_noise_n;
  return contact;
}

MotionResult RemoteRobot::FollowTwist(const TwistMotion& motion) {
  const auto& known = welcome_.capabilities.motions;
  if (std::find(known.begin(), known.end(), "twist") == known.end()) return Robot::FollowTwist(motion);
  const double lever_m = motion.tool_T_frame.translation().norm();
  const double speed_m_s = motion.linear_m_s.norm() + lever_m * motion.angular_rad_s.norm();
  return Move(motion, motion.duration_s * std::max(speed_m_s, 1.0));
}

CameraView RemoteRobot::Look() {
  const auto& known = welcome_.capabilities.motions;
  if (std::find(known.begin(), known.end(), "look") == known.end()) return {};
  const Reply reply = Exchange(LookRequest{});
  const auto* picture = std::get_if<PictureReply>(&reply);
  return picture == nullptr ? CameraView{} : picture->view;
}

}  // namespace feeler::execution
