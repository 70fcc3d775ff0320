#include "feeler/execution/remote/robot_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/execution/remote/token_file.h"

namespace feeler::execution {
namespace {

/// How often a robot in lockstep looks at the wire while it moves, in questions.
constexpr int kQuestionsPerLook = 10;
/// A session whose hello does not come is ended.
constexpr double kHelloTimeout_s = 2.0;

/// Takes the same time whatever the place of the first difference.
bool SameText(const std::string& a, const std::string& b) {
  unsigned different = static_cast<unsigned>(a.size() ^ b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    different |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b.empty() ? 0 : b[i % b.size()]);
  }
  return different == 0;
}

void SleepUntil(double wall_s) {
  const double left_s = wall_s - MonotonicSeconds();
  if (!(left_s > 0.0)) return;
  timespec wait{static_cast<time_t>(left_s), 0};
  wait.tv_nsec = static_cast<long>((left_s - static_cast<double>(wait.tv_sec)) * 1e9);
  nanosleep(&wait, nullptr);
}

bool Within(const Eigen::Vector3d& p, const Capabilities& c) {
  constexpr double kMargin_m = 1e-6;
  return (p.array() >= c.workspace_min_m.array() - kMargin_m).all() &&
         (p.array() <= c.workspace_max_m.array() + kMargin_m).all();
}

/// What a motion asks for.
struct Demand {
  double speed_m_s = 0.0;
  double force_n = 0.0;
  double rate_rad_s = 0.0;
  double stiffness_n_m = 0.0;
  double rotational_stiffness_nm_rad = 0.0;
  std::vector<Eigen::Vector3d> places;
};

Demand DemandOf(const Request& request, const Pose& here) {
  Demand d;
  const auto watched = [](double force_n) { return force_n >= kNotWatched_n ? 0.0 : force_n; };
  if (const auto* transfer = std::get_if<TransferRequest>(&request)) {
    d.places = {transfer->world_T_tool.translation()};
  } else if (const auto* linear = std::get_if<LinearRequest>(&request)) {
    d.places = {linear->world_T_tool.translation()};
    d.speed_m_s = linear->speed_m_s;
    d.force_n = watched(linear->contact_force_n);
  } else if (const auto* guarded = std::get_if<GuardedMotion>(&request)) {
    d.places = {here.translation() + guarded->distance_m * guarded->direction};
    d.speed_m_s = guarded->speed_m_s;
    d.force_n = guarded->contact_force_n;
  } else if (const auto* compliant = std::get_if<CompliantMotion>(&request)) {
    for (const Pose& pose : compliant->world_T_tool) d.places.emplace_back(pose.translation());
    d.speed_m_s = compliant->speed_m_s;
    d.force_n = compliant->force_limit_n;
    d.stiffness_n_m = compliant->stiffness_n_m.maxCoeff();
    d.rotational_stiffness_nm_rad = compliant->rotational_stiffness_nm_rad;
  } else if (const auto* twist = std::get_if<TwistMotion>(&request)) {
    d.rate_rad_s = twist->angular_rad_s.norm();
    d.speed_m_s = twist->linear_m_s.norm() + twist->tool_T_frame.translation().norm() * d.rate_rad_s;
    d.force_n = watched(twist->contact_force_n);
    const Eigen::Vector3d way_m = twist->duration_s * (twist->tool_T_frame.linear() * twist->linear_m_s);
    if (d.rate_rad_s == 0.0) d.places = {here * way_m};
  }
  return d;
}

/// Why a motion is outside of what the robot states; empty if it is not.
std::string OutsideOf(const Capabilities& c, const Request& request, const Pose& here) {
  const Demand d = DemandOf(request, here);
  struct Limit {
    const char* what;
    const char* unit;
    double asked;
    double most;
  };
  const Limit limits[] = {
      {"speed", "m/s", d.speed_m_s, c.max_speed_m_s},
      {"force", "N", d.force_n, c.max_force_n},
      {"turning rate", "rad/s", d.rate_rad_s, kMostRate_rad_s},
      {"stiffness", "N/m", d.stiffness_n_m, kMostStiffness_n_m},
      {"rotational stiffness", "Nm/rad", d.rotational_stiffness_nm_rad, kMostRotationalStiffness_nm_rad}};
  constexpr double kRounding = 1.0 + 1e-9;
  for (const Limit& limit : limits) {
    if (!(limit.asked <= limit.most * kRounding)) {
      return fmt::format("the {} of {:g} {} is above {:g}", limit.what, limit.asked, limit.unit, limit.most);
    }
  }
  for (const Eigen::Vector3d& place : d.places) {
    if (!Within(place, c)) {
      return fmt::format("{:.3f} {:.3f} {:.3f} m is outside of the workspace", place.x(), place.y(), place.z());
    }
  }
  return "";
}

}  // namespace

RobotServer::RobotServer(ServedRobot served, ServerOptions options)
    : served_(std::move(served)), options_(std::move(options)) {
  if (served_.slow_transfers) served_.slow_transfers(options_.faults.slowed);
  if (served_.ask_while_moving) served_.ask_while_moving([this] { return WhileMoving(); });
}

RobotState RobotServer::State() {
  const RobotState state{served_.robot.Time(), served_.robot.ToolPose(), served_.robot.ContactWrench(), mode_,
                         served_.robot.JointPositions()};
  if (!options_.lockstep) {
    std::string beat = EncodeReply(form_, 0, StateReply{state});
    const std::lock_guard lock(beat_mutex_);
    beat_ = std::move(beat);
  }
  return state;
}

void RobotServer::Beat() {
  while (beating_) {
    std::string beat;
    {
      const std::lock_guard lock(beat_mutex_);
      beat = beat_;
    }
    if (!beat.empty() && MonotonicSeconds() >= silent_until_s_) link_->Send(beat);
    SleepUntil(MonotonicSeconds() + kHeartbeat_s);
  }
}

void RobotServer::Send(std::uint64_t seq, const Reply& reply) {
  if (link_) link_->Send(EncodeReply(form_, seq, reply));
}

SessionEnd RobotServer::Fail(std::uint64_t seq, const std::string& code, const std::string& text) {
  Send(seq, ErrorReply{code, text});
  ++(greeted_ ? statistics_.bad_frames : statistics_.refused_sessions);
  return SessionEnd::kRefused;
}

void RobotServer::TurnAway() {
  if (listener_ == nullptr) return;
  while (std::optional<Connection> other = listener_->Accept(0.0)) {
    ++statistics_.refused_sessions;
    other->Write(EncodeReply(WireForm::kJson, 0, ErrorReply{"busy", "another session is under way"}) + "\n", 0.01);
    if (mode_ != RobotMode::kMoving) other->Finish();
  }
}

bool RobotServer::Silent() const {
  return !options_.lockstep && MonotonicSeconds() - heard_s_ > options_.link_timeout_s;
}

SessionEnd RobotServer::Serve(Connection connection, Listener* listener, const CancellationToken* cancellation) {
  ++statistics_.sessions;
  link_.emplace(std::move(connection), options_.faults.latency_s, options_.faults.jitter_s,
                RandomStream(options_.seed, static_cast<std::uint64_t>(statistics_.sessions), "wire delay"));
  listener_ = listener;
  cancellation_ = cancellation;
  mode_ = RobotMode::kWaiting;
  greeted_ = false;
  seq_ = 0;
  waiting_.clear();
  dropped_s_.reset();
  heard_s_ = MonotonicSeconds();
  std::optional<SessionEnd> end;
  while (!end) {
    end = cancellation_ != nullptr && cancellation_->cancelled() ? SessionEnd::kInterrupted : NextFrame();
  }
  beating_ = false;
  if (beater_.joinable()) beater_.join();
  link_->Close();
  link_.reset();
  mode_ = RobotMode::kWaiting;
  return *end;
}

std::optional<SessionEnd> RobotServer::NextFrame() {
  TurnAway();
  std::string line;
  LineStatus status = LineStatus::kLine;
  if (!waiting_.empty()) {
    line = std::move(waiting_.front());
    waiting_.erase(waiting_.begin());
  } else {
    status = link_->Receive(line, options_.lockstep ? 0.1 : 0.5 * kHeartbeat_s, kMostRequestBytes);
  }
  switch (status) {
    case LineStatus::kLine:
      heard_s_ = MonotonicSeconds();
      try {
        return greeted_ ? Handle(DecodeRequest(form_, line)) : Greet(line);
      } catch (const InputError& error) {
        return Fail(seq_, "malformed", error.what());
      }
    case LineStatus::kTimeout:
      if (greeted_ ? Silent() : MonotonicSeconds() - heard_s_ > kHelloTimeout_s) {
        ++statistics_.lost_links;
        return SessionEnd::kLost;
      }
      return std::nullopt;
    case LineStatus::kClosed: return SessionEnd::kClosed;
    case LineStatus::kTooLong: return Fail(seq_, "malformed", "a frame is too long");
  }
  return std::nullopt;
}

std::optional<SessionEnd> RobotServer::Greet(const std::string& line) {
  const std::optional<WireForm> form = FormOf(line);
  if (!form) return Fail(0, "malformed", "neither JSON nor numbers");
  form_ = *form;
  const Framed<Request> framed = DecodeRequest(form_, line);
  const auto* hello = std::get_if<HelloRequest>(&framed.body);
  if (hello == nullptr || framed.seq != 0) return Fail(framed.seq, "sequence", "a session begins with hello, number 0");
  if (hello->version != kProtocolVersion) {
    return Fail(0, "version", fmt::format("this robot speaks version {}", kProtocolVersion));
  }
  if (hello->units != kProtocolUnits) return Fail(0, "units", "this robot counts in " + std::string(kProtocolUnits));
  const std::string due = form_ == WireForm::kNumbers ? AsNumber(options_.token) : options_.token;
  if (!options_.token.empty() && !SameText(hello->token, due)) return Fail(0, "token", "a wrong token");
  greeted_ = true;
  WelcomeReply welcome;
  welcome.robot = served_.name;
  welcome.simulated = static_cast<bool>(served_.begin_episode);
  welcome.lockstep = options_.lockstep;
  welcome.link_timeout_s = options_.link_timeout_s;
  welcome.capabilities = served_.capabilities;
  welcome.state = State();
  if (options_.faults.share[static_cast<int>(WireFault::kVersion)] > 0.0) {
    RandomStream random(options_.seed, static_cast<std::uint64_t>(statistics_.sessions), "wire version");
    if (random.Uniform(0.0, 1.0) < options_.faults.share[static_cast<int>(WireFault::kVersion)]) {
      ++statistics_.ordered[static_cast<int>(WireFault::kVersion)];
      welcome.version = kProtocolVersion + 1;
    }
  }
  Send(0, welcome);
  if (!options_.lockstep) {
    beating_ = true;
    beater_ = std::thread([this] { Beat(); });
  }
  return std::nullopt;
}

std::optional<SessionEnd> RobotServer::Handle(const Framed<Request>& framed) {
  const Request& request = framed.body;
  if (std::holds_alternative<HeartbeatRequest>(request)) {
    if (framed.seq == 0) return std::nullopt;
    return Fail(framed.seq, "sequence", "a heartbeat has the number 0");
  }
  if (std::holds_alternative<HelloRequest>(request)) {
    return Fail(framed.seq, "sequence", "the session has begun: a new one takes a new connection");
  }
  if (framed.seq != seq_ + 1) {
    return Fail(framed.seq, "sequence", fmt::format("number {} where {} is due", framed.seq, seq_ + 1));
  }
  seq_ = framed.seq;
  if (std::holds_alternative<ByeRequest>(request)) return SessionEnd::kBye;
  if (IsMotion(request)) return Move(framed.seq, request);
  try {
    if (std::holds_alternative<StartRequest>(request)) {
      if (mode_ == RobotMode::kWaiting) mode_ = RobotMode::kReady;
    } else if (std::holds_alternative<RecoverRequest>(request)) {
      if (mode_ == RobotMode::kProtectiveStop) mode_ = RobotMode::kReady;
    } else if (std::holds_alternative<ZeroRequest>(request)) {
      served_.robot.ZeroWrench();
    } else if (const auto* contact = std::get_if<ContactRequest>(&request)) {
      Send(framed.seq, served_.robot.Contact(contact->direction));
      return std::nullopt;
    } else if (std::holds_alternative<LookRequest>(request)) {
      Send(framed.seq, PictureReply{served_.robot.Look()});
      return std::nullopt;
    } else if (const auto* episode = std::get_if<EpisodeRequest>(&request)) {
      if (!served_.begin_episode) return Fail(framed.seq, "refused", "this robot is no simulation");
      EpisodeReply reply = served_.begin_episode(*episode);
      if (mode_ == RobotMode::kProtectiveStop) mode_ = RobotMode::kReady;
      planned_ = PlanFaults(options_.faults, options_.seed, reply.episode);
      episode_motions_ = 0;
      reply.state = State();
      Send(framed.seq, reply);
      return std::nullopt;
    } else if (std::holds_alternative<VerdictRequest>(request)) {
      if (!served_.judge) return Fail(framed.seq, "refused", "this robot is no simulation");
      const VerdictReply verdict = served_.judge();
      ++episodes_judged_;
      Send(framed.seq, verdict);
      return std::nullopt;
    }
  } catch (const Error& error) {
    Send(framed.seq, ErrorReply{"refused", error.what()});
    return std::nullopt;
  }
  Send(framed.seq, StateReply{State()});
  return std::nullopt;
}

std::string RobotServer::Refusal(const Request& request) const {
  if (mode_ == RobotMode::kWaiting) return "the operator has not started the robot";
  if (mode_ == RobotMode::kProtectiveStop) return "a protective stop has not been recovered from";
  if (mode_ != RobotMode::kReady) return "the robot moves no more in this session";
  const auto& known = served_.capabilities.motions;
  const std::string name(NameOf(request));
  if (std::find(known.begin(), known.end(), name) == known.end()) return "this robot has no motion '" + name + "'";
  const std::string outside = OutsideOf(served_.capabilities, request, served_.robot.ToolPose());
  return outside.empty() ? "" : "outside of the limits of the robot: " + outside;
}

MotionResult RobotServer::Run(const Request& request) {
  const double slowed = options_.faults.slowed;
  if (const auto* transfer = std::get_if<TransferRequest>(&request)) {
    MotionResult result = served_.robot.Transfer(transfer->world_T_tool);
    if (served_.after_transfer) served_.after_transfer(result);
    return result;
  }
  if (const auto* linear = std::get_if<LinearRequest>(&request)) {
    return served_.robot.LinearMove(linear->world_T_tool, slowed * linear->speed_m_s, linear->contact_force_n);
  }
  if (const auto* guarded = std::get_if<GuardedMotion>(&request)) {
    GuardedMotion motion = *guarded;
    motion.speed_m_s *= slowed;
    return served_.robot.Guarded(motion);
  }
  if (const auto* compliant = std::get_if<CompliantMotion>(&request)) {
    CompliantMotion motion = *compliant;
    motion.speed_m_s *= slowed;
    return served_.robot.Compliant(motion);
  }
  return served_.robot.FollowTwist(std::get<TwistMotion>(request));
}

std::optional<SessionEnd> RobotServer::Move(std::uint64_t seq, const Request& request) {
  if (const std::string refusal = Refusal(request); !refusal.empty()) {
    ++statistics_.refused_motions;
    Send(seq, ErrorReply{"refused", refusal});
    return std::nullopt;
  }
  stop_.clear();
  asked_ = 0;
  motion_began_s_ = served_.robot.Time();
  wall_began_s_ = MonotonicSeconds();
  mode_ = RobotMode::kMoving;
  ++statistics_.motions;
  ResultReply reply;
  try {
    reply.result = Run(request);
  } catch (const Error& error) {
    mode_ = RobotMode::kReady;
    Send(seq, ErrorReply{"refused", error.what()});
    ++episode_motions_;
    return std::nullopt;
  }
  if (options_.paced && !options_.lockstep) {
    SleepUntil(wall_began_s_ + served_.robot.Time() - motion_began_s_);
  }
  if (mode_ == RobotMode::kMoving) mode_ = RobotMode::kReady;
  if (reply.result.reason == StopReason::kAborted && reply.result.detail.starts_with("protective stop") &&
      mode_ == RobotMode::kReady) {
    ++statistics_.protective_stops;
    mode_ = RobotMode::kProtectiveStop;
  }
  reply.state = State();
  const bool over = StrikeReply(seq, reply);
  ++episode_motions_;
  if (over || dropped_s_) {
    ++statistics_.lost_links;
    return SessionEnd::kLost;
  }
  if (stop_ == "the frame while it moved is not sound") return Fail(seq, "malformed", stop_);
  Send(seq, reply);
  return std::nullopt;
}

void RobotServer::PumpWhileMoving() {
  if (!link_ || dropped_s_) return;
  TurnAway();
  for (std::string line;;) {
    const LineStatus status = link_->Receive(line, 0.0, kMostRequestBytes);
    if (status == LineStatus::kTimeout) break;
    if (status == LineStatus::kClosed) {
      stop_ = "link lost: the other end is gone";
      dropped_s_ = served_.robot.Time();
      return;
    }
    heard_s_ = MonotonicSeconds();
    try {
      if (status == LineStatus::kTooLong) throw InputError("frame", "too long", "send less");
      const Framed<Request> framed = DecodeRequest(form_, line);
      if (std::holds_alternative<HeartbeatRequest>(framed.body) && framed.seq == 0) continue;
      if (!std::holds_alternative<StopRequest>(framed.body)) throw InputError("frame", "one at a time", "wait");
      stop_ = "stopped by order";
      waiting_.push_back(line);  // it is answered when its turn has come
    } catch (const InputError&) {
      stop_ = "the frame while it moved is not sound";
      return;
    }
  }
  if (Silent()) {
    stop_ = fmt::format("link lost: silent for {:g} s", options_.link_timeout_s);
    dropped_s_ = served_.robot.Time();
  }
}

bool RobotServer::Comes(WireFault fault) {
  const double since_s = served_.robot.Time() - motion_began_s_;
  for (const PlannedFault& planned : planned_) {
    if (planned.fault != fault || planned.motion != episode_motions_) continue;
    return mode_ != RobotMode::kMoving || since_s >= planned.after_s;
  }
  return false;
}

std::string RobotServer::StrikeWhileMoving() {
  const double now_s = served_.robot.Time();
  if (!dropped_s_ && Comes(WireFault::kDrop)) {
    ++statistics_.ordered[static_cast<int>(WireFault::kDrop)];
    dropped_s_ = now_s;
    link_->Cut();
  }
  if (!dropped_s_ && options_.faults.stall_s > options_.link_timeout_s && Comes(WireFault::kStall)) {
    // A silence that long is a lost link; a shorter one is not noticed by a robot that is moving.
    ++statistics_.ordered[static_cast<int>(WireFault::kStall)];
    dropped_s_ = now_s;
    link_->Cut();
  }
  // The robot notices a lost link by its silence.
  if (dropped_s_ && now_s >= *dropped_s_ + options_.link_timeout_s) {
    return fmt::format("link lost: silent for {:g} s", options_.link_timeout_s);
  }
  if (Comes(WireFault::kProtective)) {
    ++statistics_.ordered[static_cast<int>(WireFault::kProtective)];
    ++statistics_.protective_stops;
    mode_ = RobotMode::kProtectiveStop;
    std::erase_if(planned_, [](const PlannedFault& f) { return f.fault == WireFault::kProtective; });
    return "protective stop: as ordered";
  }
  return "";
}

std::string RobotServer::WhileMoving() {
  if (mode_ != RobotMode::kMoving) return "";  // zeroing, or the reset of an episode
  ++asked_;
  if (cancellation_ != nullptr && cancellation_->cancelled()) return "the robot's program was ended";
  if (options_.lockstep) {
    if (asked_ % kQuestionsPerLook == 0) PumpWhileMoving();
  } else {
    if (options_.paced) SleepUntil(wall_began_s_ + served_.robot.Time() - motion_began_s_);
    PumpWhileMoving();
    if (asked_ % kQuestionsPerLook == 0) State();  // for the heartbeat
  }
  if (!stop_.empty()) return stop_;
  return planned_.empty() && !dropped_s_ ? "" : StrikeWhileMoving();
}

bool RobotServer::StrikeReply(std::uint64_t seq, ResultReply reply) {
  if (planned_.empty() || !link_ || dropped_s_) return false;
  const auto ordered = [&](WireFault fault) {
    if (!Comes(fault)) return false;
    ++statistics_.ordered[static_cast<int>(fault)];
    return true;
  };
  const auto end_with = [&](const std::string& line) {
    link_->Send(line);
    link_->Close();
    return true;
  };
  if (ordered(WireFault::kDrop)) {
    link_->Cut();
    return true;
  }
  if (ordered(WireFault::kStall)) {
    silent_until_s_ = MonotonicSeconds() + options_.faults.stall_s;
    if (!options_.lockstep) SleepUntil(silent_until_s_);
    if (options_.faults.stall_s > options_.link_timeout_s) {
      link_->Cut();
      return true;
    }
  }
  if (ordered(WireFault::kMalformed)) return end_with("{\"type\":\"result\",,}");
  if (ordered(WireFault::kHalf)) {
    const std::string whole = EncodeReply(form_, seq, reply);
    link_->SendRaw(whole.substr(0, whole.size() / 2));
    link_->Cut();
    return true;
  }
  if (ordered(WireFault::kNan)) {
    reply.result.world_T_tool.translation().x() = std::nan("");
    return end_with(EncodeReply(WireForm::kJson, seq, reply));
  }
  if (ordered(WireFault::kBackwards)) {
    reply.state.time_s = std::max(0.0, motion_began_s_ - 1.0);
    return end_with(EncodeReply(form_, seq, reply));
  }
  if (ordered(WireFault::kJump)) {
    reply.result.world_T_tool.translation().y() += 0.2;
    reply.state.world_T_tool = reply.result.world_T_tool;
    return end_with(EncodeReply(form_, seq, reply));
  }
  return false;
}

}  // namespace feeler::execution
