#include "feeler/execution/remote/remote_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/execution/records/pose_error.h"
#include "feeler/execution/remote/protocol/messages_numbers.h"
#include "feeler/version.h"

namespace feeler::execution {
namespace {

/// A robot at rest is reported within this of where it was, and a motion ends within this of what it can reach.
constexpr double kJump_m = 0.02;
/// Looks for a cancellation so often while it waits.
constexpr double kLook_s = 0.05;
constexpr double kAnyLength = 1e9;
/// "Reached" is within this of the commanded end; so is what was travelled of the way between the poses.
constexpr double kReached_m = 0.005;
/// The tool turns by no more than this beside what was commanded.
constexpr double kTurn_rad = 0.2;
/// A motion may take this many times what its length and speed come to, and this on top.
constexpr double kSlowness = 20.0;
constexpr double kSpare_s = 10.0;
/// After an order to stop, and for a motion that is overdue, the robot is waited for so long.
constexpr double kStop_s = 1.0;

[[noreturn]] void RefuseRobot(const std::string& what, const std::string& mend) {
  throw InputError("robot", what, mend);
}

void RequireSound(const WelcomeReply& welcome, const RemoteOptions& options) {
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
  if (c.contact_force_n > c.max_force_n) {
    RefuseRobot(fmt::format("tells contacts from {:g} N on, and may press with {:g} N at most", c.contact_force_n,
                            c.max_force_n),
                "state a contact force that the sensor can tell");
  }
  if (welcome.simulated) return;
  if (welcome.lockstep) RefuseRobot("states that its time stands still", "lockstep is for simulations alone");
  if (welcome.link_timeout_s > options.link_timeout_s) {
    RefuseRobot(
        fmt::format("may be silent for {:g} s, {:g} s are allowed", welcome.link_timeout_s, options.link_timeout_s),
        "mend its program, or allow more with --link-timeout");
  }
}

/// The text of an error without its "(how to mend)".
std::string WithoutMend(const std::string& text) {
  const std::size_t mend = text.rfind(" (");
  return mend == std::string::npos || !text.ends_with(')') ? text : text.substr(0, mend);
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
  if (status == LineStatus::kTooLong) RefuseRobot("answers hello with a line without end", "see its program");
  if (status != LineStatus::kLine) throw WorldError("robot", "hung up at hello", "another session may be under way");
  const std::optional<WireForm> form = FormOf(line);
  const Framed<Reply> answer = DecodeReply(form.value_or(options_.form), line);
  const Reply& reply = answer.body;
  if (const auto* error = std::get_if<ErrorReply>(&reply)) {
    const char* mend = error->code == "token"  ? "give the robot's token with --token-file"
                       : error->code == "busy" ? "wait until the other session has ended"
                                               : "both ends must speak docs/robot-protocol.md, version 1";
    RefuseRobot("refused the session: " + error->code + ", " + error->text, mend);
  }
  if (!std::holds_alternative<WelcomeReply>(reply)) RefuseRobot("answers hello with something else", "see its program");
  if (answer.seq != 0) RefuseRobot(fmt::format("answers hello with number {}, not 0", answer.seq), "see its program");
  welcome_ = std::get<WelcomeReply>(reply);
  RequireSound(welcome_, options_);
  if (!welcome_.lockstep && 2.0 * options_.heartbeat_s > welcome_.link_timeout_s) {
    RefuseRobot(fmt::format("takes a link for lost after {:g} s, and a heartbeat comes every {:g} s",
                            welcome_.link_timeout_s, options_.heartbeat_s),
                "give a shorter --heartbeat");
  }
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

bool RemoteRobot::spoke_nonsense() const {
  const std::lock_guard lock(mutex_);
  return nonsense_;
}

void RemoteRobot::Lose(const std::string& reason, bool nonsense) {
  {
    const std::lock_guard lock(mutex_);
    if (lost_.empty()) {
      lost_ = reason;
      nonsense_ = nonsense;
    }
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
    case LineStatus::kTooLong: Lose("a message of the robot is too long", true); return false;
    case LineStatus::kLine: break;
  }
  try {
    File(line);
  } catch (const InputError& error) {
    Lose(WithoutMend(error.what()), true);
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

std::optional<Reply> RemoteRobot::Await(double timeout_s) {
  double end_s = MonotonicSeconds() + timeout_s;
  bool overdue = false;
  for (;;) {
    const bool cancelled = options_.cancellation != nullptr && options_.cancellation->cancelled();
    const bool late = MonotonicSeconds() > end_s;
    if (late && overdue) Lose(fmt::format("no reply within {:g} s", timeout_s));
    if ((cancelled && !stop_sent_) || (late && !overdue)) {
      std::uint64_t seq = 0;
      stop_sent_ = SendFrame(StopRequest{}, seq);
      overdue = true;
      end_s = MonotonicSeconds() + kStop_s;
    }
    if (welcome_.lockstep) {
      TakeLine(kLook_s);
    } else {
      std::unique_lock lock(mutex_);
      arrived_.wait_for(lock, std::chrono::duration<double>(kLook_s), [&] { return reply_ || !lost_.empty(); });
    }
    const std::lock_guard lock(mutex_);
    if (reply_) {
      Reply reply = std::move(reply_->body);
      reply_.reset();
      return reply;
    }
    if (!lost_.empty()) return std::nullopt;
  }
}

std::optional<Reply> RemoteRobot::TryExchange(const Request& request, double timeout_s) {
  std::uint64_t seq = 0;
  if (!SendFrame(request, seq)) return std::nullopt;
  return Await(welcome_.lockstep ? options_.lockstep_timeout_s : timeout_s);
}

Reply RemoteRobot::Exchange(const Request& request) {
  std::optional<Reply> reply = TryExchange(request);
  if (!reply && spoke_nonsense() && !welcome_.simulated) RefuseRobot(lost(), "see its program");
  if (!reply) throw WorldError("robot", "link lost: " + lost(), "see that it runs and that the network holds");
  if (const auto* error = std::get_if<ErrorReply>(&*reply)) {
    throw WorldError("robot", std::string(NameOf(request)) + " refused: " + error->text, "see what its program says");
  }
  return *std::move(reply);
}

void RemoteRobot::RequireState(const Reply& reply) {
  if (!std::holds_alternative<StateReply>(reply)) Lose("answers with something else than its state", true);
}

void RemoteRobot::ZeroWrench() {
  const std::optional<Reply> reply = TryExchange(ZeroRequest{});
  if (reply) RequireState(*reply);
}

void RemoteRobot::RequireReady(const char* after) const {
  const RobotMode mode = State().mode;
  if (mode == RobotMode::kReady || mode == RobotMode::kMoving) return;
  throw WorldError("robot", fmt::format("says after {} that it is in mode '{}'", after, ToString(mode)),
                   "see what its program and its controller say");
}

void RemoteRobot::Start() {
  RequireState(Exchange(StartRequest{}));
  if (lost().empty()) RequireReady("start");
}

void RemoteRobot::Recover() {
  RequireState(Exchange(RecoverRequest{}));
  if (lost().empty() && State().mode != RobotMode::kWaiting) RequireReady("recover");
}

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

MotionResult RemoteRobot::NotSent(StopReason reason, const std::string& detail) const {
  MotionResult result;
  result.reason = reason;
  result.detail = detail;
  result.world_T_tool = ToolPose();
  return result;
}

std::string RemoteRobot::FaultOf(const ResultReply& ended, const Pose& before, const Way& way) const {
  const MotionResult& result = ended.result;
  const Pose& end = result.world_T_tool;
  const Eigen::Vector3d moved = end.translation() - before.translation();
  if (moved.norm() > way.longest_m + kJump_m) {
    return fmt::format("the reported pose jumps: {:.0f} mm in a motion of {:.0f} mm", 1e3 * moved.norm(),
                       1e3 * way.longest_m);
  }
  if ((ended.state.world_T_tool.translation() - end.translation()).norm() > kJump_m) {
    return "the reported pose jumps at the end of a motion";
  }
  if (std::abs(result.travelled_m) > way.longest_m + kJump_m) {
    return fmt::format("travelled {:.0f} mm in a motion of {:.0f} mm", 1e3 * result.travelled_m, 1e3 * way.longest_m);
  }
  if (AngleBetween(before, end) > way.turn_rad + kTurn_rad) return "the tool has turned in a motion that does not turn";
  if (way.direction && way.direction->dot(moved) < -kReached_m) return "the motion has led the other way";
  if (result.reason != StopReason::kReached || !way.end) return "";
  const double missed_m = (way.end->translation() - end.translation()).norm();
  if (missed_m > kReached_m) return fmt::format("'reached' is {:.0f} mm from the end of the motion", 1e3 * missed_m);
  return AngleBetween(*way.end, end) > kTurn_rad ? "'reached' is turned against the end of the motion" : "";
}

MotionResult RemoteRobot::Move(const Request& request, const Way& way) {
  if (options_.cancellation != nullptr && options_.cancellation->cancelled()) {
    return NotSent(StopReason::kAborted, "stopped by order");
  }
  const RobotState begun = State();
  if (begun.mode == RobotMode::kFault || begun.mode == RobotMode::kProtectiveStop) {
    return NotSent(StopReason::kAborted, begun.mode == RobotMode::kFault ? "the robot is out of order"
                                                                         : "protective stop: not recovered from");
  }
  {
    const std::lock_guard lock(mutex_);
    moving_ = true;
  }
  const std::optional<Reply> reply = TryExchange(request, way.timeout_s);
  {
    const std::lock_guard lock(mutex_);
    moving_ = false;
  }
  const auto* error = reply ? std::get_if<ErrorReply>(&*reply) : nullptr;
  if (error != nullptr) return NotSent(StopReason::kUnplanned, "refused by the robot: " + error->text);
  const auto* ended = reply ? std::get_if<ResultReply>(&*reply) : nullptr;
  if (!reply) {
    Lose("no reply");
  } else if (ended == nullptr) {
    Lose("answers a motion with something else", true);
  } else if (const std::string fault = FaultOf(*ended, begun.world_T_tool, way); !fault.empty()) {
    Lose(fault, true);
  } else {
    return ended->result;
  }
  return NotSent(StopReason::kAborted, "link lost: " + lost());
}

MotionResult RemoteRobot::Transfer(const Pose& world_T_tool) {
  Way way;
  way.longest_m = kAnyLength;
  way.turn_rad = kAnyLength;
  way.end = world_T_tool;
  way.timeout_s = options_.transfer_timeout_s;
  return Move(TransferRequest{world_T_tool}, way);
}

MotionResult RemoteRobot::LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) {
  const Pose here = ToolPose();
  Way way;
  way.longest_m = (world_T_tool.translation() - here.translation()).norm();
  way.turn_rad = AngleBetween(here, world_T_tool);
  way.end = world_T_tool;
  way.timeout_s = kSlowness * way.longest_m / speed_m_s + kSpare_s;
  return Move(LinearRequest{world_T_tool, speed_m_s, contact_force_n}, way);
}

MotionResult RemoteRobot::Guarded(const GuardedMotion& motion) {
  Way way;
  way.longest_m = motion.distance_m;
  way.end = ToolPose();
  way.end->translation() += motion.distance_m * motion.direction;
  way.direction = motion.direction;
  way.timeout_s = kSlowness * motion.distance_m / motion.speed_m_s + kSpare_s;
  return Move(motion, way);
}

MotionResult RemoteRobot::Compliant(const CompliantMotion& motion) {
  const auto way_of = [&](const CompliantMotion& part) {
    Way way;
    const Pose here = ToolPose();
    Eigen::Vector3d before = here.translation();
    for (const Pose& pose : part.world_T_tool) {
      way.longest_m += (pose.translation() - before).norm();
      way.turn_rad = std::max(way.turn_rad, AngleBetween(here, pose));
      before = pose.translation();
    }
    way.timeout_s = kSlowness * part.time_limit_s + kSpare_s;
    return way;
  };
  if (options_.form == WireForm::kJson || motion.world_T_tool.size() <= kMostWayPointsInNumbers) {
    return Move(motion, way_of(motion));
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
    MotionResult result = Move(piece, way_of(piece));
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
  ContactResponse contact = Robot::Contact(direction);
  if (const auto* told = reply ? std::get_if<ContactReply>(&*reply) : nullptr) {
    contact = *told;
  } else {
    const Capabilities& stated = welcome_.capabilities;
    contact.held_mass_kg = contact.free_mass_kg = stated.effective_mass_kg;
    contact.reaction_time_s = stated.reaction_time_s;
    contact.force_noise_n = stated.force_noise_n;
  }
  const MeasuredContact& measured = options_.measured;
  contact.stiffness_n_m = measured.stiffness_n_m.value_or(contact.stiffness_n_m);
  contact.reaction_time_s = measured.reaction_time_s.value_or(contact.reaction_time_s);
  contact.force_noise_n = measured.force_noise_n.value_or(contact.force_noise_n);
  return contact;
}

MotionResult RemoteRobot::FollowTwist(const TwistMotion& motion) {
  const auto& known = welcome_.capabilities.motions;
  if (std::find(known.begin(), known.end(), "twist") == known.end()) return Robot::FollowTwist(motion);
  const double lever_m = motion.tool_T_frame.translation().norm();
  const double speed_m_s = motion.linear_m_s.norm() + lever_m * motion.angular_rad_s.norm();
  Way way;
  way.longest_m = motion.duration_s * std::max(speed_m_s, 1.0);
  way.turn_rad = motion.duration_s * std::max(motion.angular_rad_s.norm(), 1.0);
  way.timeout_s = kSlowness * motion.duration_s + kSpare_s;
  return Move(motion, way);
}

CameraView RemoteRobot::Look() {
  const auto& known = welcome_.capabilities.motions;
  if (std::find(known.begin(), known.end(), "look") == known.end()) return {};
  const Reply reply = Exchange(LookRequest{});
  const auto* picture = std::get_if<PictureReply>(&reply);
  return picture == nullptr ? CameraView{} : picture->view;
}

}  // namespace feeler::execution
