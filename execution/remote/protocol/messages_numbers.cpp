#include "feeler/execution/remote/protocol/messages_numbers.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/execution/remote/protocol/wire_pose.h"

namespace feeler::execution {
namespace {

enum RequestCode {
  kHello = 1,
  kState = 2,
  kZero = 3,
  kContact = 4,
  kTransfer = 5,
  kLinear = 6,
  kGuarded = 7,
  kCompliant = 8,
  kStop = 10,
  kStart = 11,
  kRecover = 12,
  kHeartbeat = 13,
  kBye = 14,
};
enum ReplyCode { kWelcome = 101, kStateReply = 102, kResult = 103, kContactReply = 104, kError = 109 };

constexpr std::array<const char*, 6> kMotionNames = {"transfer", "linear", "guarded", "compliant", "twist", "look"};
constexpr std::array<const char*, 8> kErrorCodes = {"version",  "units",     "token",   "busy",
                                                    "sequence", "malformed", "refused", "fault"};
/// What a script says of a motion that did not end as it should; 0: nothing.
constexpr std::array<const char*, 7> kDetails = {"",
                                                 "protective stop",
                                                 "link lost",
                                                 "stopped by order",
                                                 "refused: the operator has not started the robot",
                                                 "refused: outside of the limits of the robot",
                                                 "the straight line leaves the reach of the arm"};
constexpr double kLargest = 1e12;

/// Writes numbers as a script reads them: in plain decimals, to 1e-9.
class NumberWriter {
 public:
  NumberWriter(int code, std::uint64_t seq) : text_(fmt::format("({},{}", code, seq)) {}
  NumberWriter& Put(double value) {
    text_ += fmt::format(",{:.9f}", value);
    // Trailing zeros are noise.
    text_.erase(text_.find_last_not_of('0') + 1);
    if (text_.back() == '.') text_.pop_back();
    return *this;
  }
  NumberWriter& Put(const Eigen::Vector3d& v) { return Put(v.x()).Put(v.y()).Put(v.z()); }
  NumberWriter& Put(const Pose& pose) {
    const Eigen::AngleAxisd turn(pose.linear());
    return Put(Eigen::Vector3d(pose.translation())).Put(Eigen::Vector3d(turn.angle() * turn.axis()));
  }
  NumberWriter& Put(const RobotState& state) {
    Put(state.time_s).Put(static_cast<double>(state.mode)).Put(state.world_T_tool);
    Put(state.wrench.force_n).Put(state.wrench.torque_nm);
    for (const double joint : state.joints_rad) Put(joint);
    return *this;
  }
  std::string Done() { return text_ + ")"; }

 private:
  std::string text_;
};

/// Takes numbers one by one; every number must be taken.
class NumberReader {
 public:
  explicit NumberReader(std::string_view line) {
    if (!line.starts_with('(') || !line.ends_with(')')) RefuseMessage("is no list of numbers in parentheses");
    line = line.substr(1, line.size() - 2);
    while (true) {
      while (line.starts_with(' ')) line.remove_prefix(1);
      if (line.starts_with('+')) line.remove_prefix(1);
      double value = 0.0;
      const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
      if (error != std::errc() || !std::isfinite(value) || std::abs(value) > kLargest) {
        RefuseMessage(fmt::format("number {} is no finite number", numbers_.size()));
      }
      numbers_.push_back(value);
      line.remove_prefix(static_cast<std::size_t>(end - line.data()));
      while (line.starts_with(' ')) line.remove_prefix(1);
      if (line.empty()) break;
      if (!line.starts_with(',') || numbers_.size() >= kMost) RefuseMessage("is no list of at most 64 numbers");
      line.remove_prefix(1);
    }
  }
  double Number() {
    if (next_ == numbers_.size()) RefuseMessage("has too few numbers");
    return numbers_[next_++];
  }
  bool More() const { return next_ < numbers_.size(); }
  double Positive() {
    const double value = Number();
    if (!(value > 0.0)) RefuseMessage(fmt::format("number {} is not positive", next_ - 1));
    return value;
  }
  double NotNegative() {
    const double value = Number();
    if (!(value >= 0.0)) RefuseMessage(fmt::format("number {} is negative", next_ - 1));
    return value;
  }
  std::uint64_t Whole(double most) {
    const double value = Number();
    if (!(value >= 0.0 && value <= most) || value != std::floor(value)) {
      RefuseMessage(fmt::format("number {} is no whole number up to {}", next_ - 1, most));
    }
    return static_cast<std::uint64_t>(value);
  }
  Eigen::Vector3d Vector() {
    const double x = Number();
    const double y = Number();
    return {x, y, Number()};
  }
  Pose PoseOfSix() {
    const Eigen::Vector3d position = Vector();
    const Eigen::Vector3d turn = Vector();
    if (position.cwiseAbs().maxCoeff() > 1e4 || turn.norm() > 100.0) RefuseMessage("a pose is out of any reach");
    Pose pose = MakePose(position);
    if (turn.norm() > 0.0) pose.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    return pose;
  }
  RobotState State() {
    RobotState state;
    state.time_s = NotNegative();
    state.mode = static_cast<RobotMode>(Whole(4));
    state.world_T_tool = PoseOfSix();
    state.wrench.force_n = Vector();
    state.wrench.torque_nm = Vector();
    // What is left are the joints: a state is the last thing in a reply.
    if (numbers_.size() - next_ > kMostJoints) RefuseMessage("has too many numbers");
    state.joints_rad.assign(numbers_.begin() + static_cast<std::ptrdiff_t>(next_), numbers_.end());
    next_ = numbers_.size();
    return state;
  }
  void End() const {
    if (next_ != numbers_.size()) RefuseMessage("has too many numbers");
  }

 private:
  static constexpr std::size_t kMost = 64;
  std::vector<double> numbers_;
  std::size_t next_ = 0;
};

double TokenNumber(const std::string& token) {
  if (token.empty()) return 0.0;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (error != std::errc() || end != token.data() + token.size() || value > 999999999) {
    throw InputError("--token-file", "the token has more than digits, and the numbers-only form knows no letters",
                     "choose a token of up to nine digits");
  }
  return static_cast<double>(value);
}

[[noreturn]] void NoSuchForm(std::string_view what) {
  throw InputError("robot message", std::string(what) + " has no numbers-only form", "use the JSON form");
}

std::string CompliantToNumbers(std::uint64_t seq, const CompliantMotion& m) {
  if (m.world_T_tool.size() > kMostWayPointsInNumbers) NoSuchForm("a compliant motion of more than three way points");
  NumberWriter out(kCompliant, seq);
  out.Put(m.speed_m_s).Put(m.force_limit_n).Put(m.time_limit_s).Put(m.stiffness_n_m).Put(m.rotational_stiffness_nm_rad);
  out.Put(static_cast<double>(m.world_T_tool.size()));
  for (const Pose& pose : m.world_T_tool) out.Put(pose);
  return out.Done();
}

CompliantMotion CompliantFrom(NumberReader& in) {
  CompliantMotion m;
  m.speed_m_s = in.Positive();
  m.force_limit_n = in.Positive();
  m.time_limit_s = in.Positive();
  for (int i = 0; i < 3; ++i) m.stiffness_n_m[i] = in.Positive();
  m.rotational_stiffness_nm_rad = in.Positive();
  const std::uint64_t count = in.Whole(static_cast<double>(kMostWayPointsInNumbers));
  if (count == 0) RefuseMessage("a compliant motion has no way point");
  for (std::uint64_t i = 0; i < count; ++i) m.world_T_tool.push_back(in.PoseOfSix());
  return m;
}

Request RequestFrom(std::uint64_t code, NumberReader& in) {
  switch (code) {
    case kHello: {
      HelloRequest m;
      m.version = static_cast<int>(in.Whole(1e6));
      const std::uint64_t token = in.Whole(999999999);
      if (token > 0) m.token = std::to_string(token);
      return m;
    }
    case kState: return StateRequest{};
    case kZero: return ZeroRequest{};
    case kContact: return ContactRequest{SoundDirection(in.Vector())};
    case kTransfer: return TransferRequest{in.PoseOfSix()};
    case kLinear: {
      LinearRequest m;
      m.world_T_tool = in.PoseOfSix();
      m.speed_m_s = in.Positive();
      m.contact_force_n = in.Positive();
      return m;
    }
    case kGuarded: {
      GuardedMotion m;
      m.direction = SoundDirection(in.Vector());
      m.distance_m = in.NotNegative();
      if (m.distance_m > 100.0) RefuseMessage("a distance is out of any reach");
      m.speed_m_s = in.Positive();
      m.contact_force_n = in.Positive();
      return m;
    }
    case kCompliant: return CompliantFrom(in);
    case kStop: return StopRequest{};
    case kStart: return StartRequest{};
    case kRecover: return RecoverRequest{};
    case kHeartbeat: return HeartbeatRequest{};
    case kBye: return ByeRequest{};
    default: RefuseMessage(fmt::format("no request has the code {}", code));
  }
}

WelcomeReply WelcomeFrom(NumberReader& in) {
  WelcomeReply m;
  m.version = static_cast<int>(in.Whole(1e6));
  m.simulated = in.Whole(1) == 1;
  m.lockstep = in.Whole(1) == 1;
  m.link_timeout_s = in.Positive();
  if (m.link_timeout_s > 60.0) RefuseMessage("the time of a lost link is above 60 s");
  m.robot = "a controller's script";
  Capabilities& c = m.capabilities;
  const std::uint64_t motions = in.Whole(63);
  for (std::size_t i = 0; i < kMotionNames.size(); ++i) {
    if ((motions >> i & 1U) != 0) c.motions.emplace_back(kMotionNames[i]);
  }
  c.payload_kg = in.NotNegative();
  c.force_noise_n = in.NotNegative();
  c.contact_force_n = in.Positive();
  c.reaction_time_s = in.NotNegative();
  c.effective_mass_kg = in.Positive();
  c.stopping_time_s = in.Positive();
  c.max_speed_m_s = in.Positive();
  c.max_force_n = in.Positive();
  c.workspace_min_m = in.Vector();
  c.workspace_max_m = in.Vector();
  m.state = in.State();
  return m;
}

ResultReply ResultFrom(NumberReader& in) {
  ResultReply m;
  m.result.reason = static_cast<StopReason>(in.Whole(5));
  m.result.travelled_m = in.Number();
  m.result.contact = in.Whole(1) == 1;
  m.result.peak_force_n = in.NotNegative();
  m.result.world_T_tool = in.PoseOfSix();
  m.result.detail = kDetails.at(in.Whole(static_cast<double>(kDetails.size() - 1)));
  m.state = in.State();
  return m;
}

struct ReplyNumbers {
  std::uint64_t seq;
  std::string operator()(const WelcomeReply& m) const {
    const Capabilities& c = m.capabilities;
    unsigned motions = 0;
    for (std::size_t i = 0; i < kMotionNames.size(); ++i) {
      for (const std::string& name : c.motions) motions |= name == kMotionNames[i] ? 1U << i : 0U;
    }
    NumberWriter out(kWelcome, seq);
    out.Put(m.version).Put(m.simulated ? 1 : 0).Put(m.lockstep ? 1 : 0).Put(m.link_timeout_s).Put(motions);
    out.Put(c.payload_kg).Put(c.force_noise_n).Put(c.contact_force_n).Put(c.reaction_time_s).Put(c.effective_mass_kg);
    out.Put(c.stopping_time_s).Put(c.max_speed_m_s).Put(c.max_force_n);
    return out.Put(c.workspace_min_m).Put(c.workspace_max_m).Put(m.state).Done();
  }
  std::string operator()(const StateReply& m) const { return NumberWriter(kStateReply, seq).Put(m.state).Done(); }
  std::string operator()(const ResultReply& m) const {
    int detail = 0;
    for (std::size_t i = 1; i < kDetails.size(); ++i) {
      if (m.result.detail.starts_with(kDetails[i])) detail = static_cast<int>(i);
    }
    NumberWriter out(kResult, seq);
    out.Put(static_cast<double>(m.result.reason)).Put(m.result.travelled_m).Put(m.result.contact ? 1 : 0);
    return out.Put(m.result.peak_force_n).Put(m.result.world_T_tool).Put(detail).Put(m.state).Done();
  }
  std::string operator()(const ContactReply& m) const {
    const ContactReply& r = m;
    NumberWriter out(kContactReply, seq);
    out.Put(r.held_mass_kg).Put(r.free_mass_kg).Put(r.stiffness_n_m).Put(r.damping_ratio);
    out.Put(r.reaction_time_s).Put(r.force_noise_n);
    if (r.push_n > 0.0) out.Put(r.push_n);
    return out.Done();
  }
  std::string operator()(const ErrorReply& m) const {
    int code = 6;
    for (std::size_t i = 0; i < kErrorCodes.size(); ++i) code = m.code == kErrorCodes[i] ? static_cast<int>(i) : code;
    return NumberWriter(kError, seq).Put(code).Done();
  }
  template <class Other>
  std::string operator()(const Other& /*message*/) const {
    NoSuchForm("this reply");
  }
};

struct RequestNumbers {
  std::uint64_t seq;
  std::string operator()(const HelloRequest& m) const {
    return NumberWriter(kHello, seq).Put(m.version).Put(TokenNumber(m.token)).Done();
  }
  std::string operator()(const StateRequest& /*m*/) const { return NumberWriter(kState, seq).Done(); }
  std::string operator()(const ZeroRequest& /*m*/) const { return NumberWriter(kZero, seq).Done(); }
  std::string operator()(const ContactRequest& m) const { return NumberWriter(kContact, seq).Put(m.direction).Done(); }
  std::string operator()(const TransferRequest& m) const {
    return NumberWriter(kTransfer, seq).Put(m.world_T_tool).Done();
  }
  std::string operator()(const LinearRequest& m) const {
    return NumberWriter(kLinear, seq).Put(m.world_T_tool).Put(m.speed_m_s).Put(m.contact_force_n).Done();
  }
  std::string operator()(const GuardedMotion& m) const {
    NumberWriter out(kGuarded, seq);
    return out.Put(m.direction).Put(m.distance_m).Put(m.speed_m_s).Put(m.contact_force_n).Done();
  }
  std::string operator()(const CompliantMotion& m) const { return CompliantToNumbers(seq, m); }
  std::string operator()(const StopRequest& /*m*/) const { return NumberWriter(kStop, seq).Done(); }
  std::string operator()(const StartRequest& /*m*/) const { return NumberWriter(kStart, seq).Done(); }
  std::string operator()(const RecoverRequest& /*m*/) const { return NumberWriter(kRecover, seq).Done(); }
  std::string operator()(const HeartbeatRequest& /*m*/) const { return NumberWriter(kHeartbeat, seq).Done(); }
  std::string operator()(const ByeRequest& /*m*/) const { return NumberWriter(kBye, seq).Done(); }
  template <class Other>
  std::string operator()(const Other& /*message*/) const {
    NoSuchForm("this request");
  }
};

constexpr double kMostSeq = 9007199254740992.0;

}  // namespace

std::string RequestToNumbers(std::uint64_t seq, const Request& request) {
  return std::visit(RequestNumbers{seq}, request);
}

std::string ReplyToNumbers(std::uint64_t seq, const Reply& reply) { return std::visit(ReplyNumbers{seq}, reply); }

Framed<Request> RequestFromNumbers(std::string_view line) {
  NumberReader in(line);
  const std::uint64_t code = in.Whole(1e6);
  const std::uint64_t seq = in.Whole(kMostSeq);
  Framed<Request> framed{seq, RequestFrom(code, in)};
  in.End();
  return framed;
}

Framed<Reply> ReplyFromNumbers(std::string_view line) {
  NumberReader in(line);
  const std::uint64_t code = in.Whole(1e6);
  Framed<Reply> framed{in.Whole(kMostSeq), ErrorReply{}};
  switch (code) {
    case kWelcome: framed.body = WelcomeFrom(in); break;
    case kStateReply: framed.body = StateReply{in.State()}; break;
    case kResult: framed.body = ResultFrom(in); break;
    case kContactReply: {
      ContactReply r;
      r.held_mass_kg = in.Positive();
      r.free_mass_kg = in.Positive();
      r.stiffness_n_m = in.Positive();
      r.damping_ratio = in.NotNegative();
      r.reaction_time_s = in.NotNegative();
      r.force_noise_n = in.NotNegative();
      if (in.More()) r.push_n = in.NotNegative();
      framed.body = r;
      break;
    }
    case kError: framed.body = ErrorReply{kErrorCodes.at(in.Whole(7)), "says the robot"}; break;
    default: RefuseMessage(fmt::format("no reply has the code {}", code));
  }
  in.End();
  return framed;
}

}  // namespace feeler::execution
