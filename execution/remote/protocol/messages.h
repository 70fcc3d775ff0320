#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/robot.h"

namespace feeler::execution {

// The messages of docs/robot-protocol.md as data. SI units; poses are of the tool reference frame in the base frame of
// the robot, the frame of `feeler::Robot`.

inline constexpr int kProtocolVersion = 1;
inline constexpr std::string_view kProtocolUnits = "m kg s rad N";
/// Both ends send at least so often on a link in real time.
inline constexpr double kHeartbeat_s = 0.02;
/// A link that was silent for so long is lost.
inline constexpr double kLinkTimeout_s = 0.1;

/// Joints that a robot may tell of.
inline constexpr std::size_t kMostJoints = 12;

enum class WireForm { kJson, kNumbers };

enum class RobotMode {
  kWaiting,         ///< for the operator's start
  kReady,           ///< at rest
  kMoving,          ///< within a motion
  kProtectiveStop,  ///< stopped by itself; moves again after `recover` alone
  kFault,           ///< moves no more in this session
};
std::string_view ToString(RobotMode mode);

struct RobotState {
  double time_s = 0.0;  ///< on the clock of the robot
  Pose world_T_tool = Pose::Identity();
  Wrench wrench;
  RobotMode mode = RobotMode::kReady;
  std::vector<double> joints_rad;  ///< from the base outwards; empty: not told
};

/// What a robot can do and may do; the executor keeps within it.
struct Capabilities {
  std::string arm;                   ///< a description that comes with Feeler (models/robots); empty: not told
  std::vector<std::string> motions;  ///< of transfer, linear, guarded, compliant, twist, look
  double payload_kg = 0.0;           ///< carried at most, gripper and tool included
  double force_noise_n = 0.0;        ///< standard deviation of a force reading
  double contact_force_n = 5.0;      ///< least net force that it can tell as a contact
  double reaction_time_s = 0.004;    ///< from a contact until the tool is being stopped
  double effective_mass_kg = 25.0;   ///< what an obstacle has to stop
  double stopping_time_s = 0.1;      ///< from the order, or the loss of the link, to rest
  double max_speed_m_s = 0.25;
  double max_force_n = 100.0;                                         ///< largest force limit of a compliant motion
  Eigen::Vector3d workspace_min_m = Eigen::Vector3d::Constant(-2.0);  ///< the tool may be in this box
  Eigen::Vector3d workspace_max_m = Eigen::Vector3d::Constant(2.0);
};

// Requests.
struct HelloRequest {
  int version = kProtocolVersion;
  std::string units = std::string(kProtocolUnits);
  std::string client;
  std::string token;
};
struct StateRequest {};
struct ZeroRequest {};
struct ContactRequest {
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();
};
struct TransferRequest {
  Pose world_T_tool = Pose::Identity();
};
struct LinearRequest {
  Pose world_T_tool = Pose::Identity();
  double speed_m_s = 0.0;
  double contact_force_n = 0.0;
};
struct LookRequest {};
struct StopRequest {};
struct StartRequest {};  ///< the operator lets the robot move
struct RecoverRequest {};
struct HeartbeatRequest {};
struct ByeRequest {};
struct EpisodeRequest {                  ///< simulations only: a new episode begins
  std::optional<std::uint64_t> episode;  ///< default: the one after the last
  std::vector<int> extents;              ///< asked for, 3 numbers, or 5 with angles; empty: as the simulation draws
};
struct VerdictRequest {};  ///< simulations only: what is true, after the end

using Request = std::variant<HelloRequest, StateRequest, ZeroRequest, ContactRequest, TransferRequest, LinearRequest,
                             GuardedMotion, CompliantMotion, TwistMotion, LookRequest, StopRequest, StartRequest,
                             RecoverRequest, HeartbeatRequest, ByeRequest, EpisodeRequest, VerdictRequest>;

// Replies.
struct WelcomeReply {
  int version = kProtocolVersion;
  std::string units = std::string(kProtocolUnits);
  std::string robot;       ///< make and model, for people
  bool simulated = false;  ///< answers episode and verdict
  bool lockstep = false;   ///< its time passes in motions alone, as fast as it can: no heartbeats
  double link_timeout_s = kLinkTimeout_s;
  Capabilities capabilities;
  RobotState state;
};
struct StateReply {
  RobotState state;
};
struct ResultReply {
  MotionResult result;
  RobotState state;
};
using ContactReply = ContactResponse;  ///< what a contact along a direction would be like, as the robot stands
struct PictureReply {
  CameraView view;
};
struct EpisodeReply {  ///< what an executor is told of an episode
  std::uint64_t seed = 0;
  std::uint64_t episode = 0;
  std::string task;
  std::string noise;
  std::string placement;
  int rejected_placements = 0;
  std::vector<int> extents;                  ///< 3 numbers, or 5 with angles
  Pose world_T_estimate = Pose::Identity();  ///< of the target
  double contact_threshold_n = 5.0;          ///< contacts are told from here on
  double force_budget_n = 0.0;               ///< that the run states; 0: the executor's own
  std::string failure;                       ///< why there is no episode; empty if there is one
  RobotState state;
};
struct VerdictReply {
  Pose world_T_true = Pose::Identity();  ///< of the target
  bool truth_outside = false;
  std::map<std::string, double> fault_values;        ///< what faults with ranges came to, in their units
  std::map<std::string, double> contact_parameters;  ///< how contact feels there (docs/file-formats.md); may be empty
  bool inserted = false;
  std::string reason;  ///< of the judge
  double depth_m = 0.0;
  double lateral_m = 0.0;
  double peak_force_n = 0.0;
  double impulse_ns = 0.0;
  int forbidden_contacts = 0;
  nlohmann::json replay;  ///< null, or what the robot's side of a replay is (docs/file-formats.md)
};
struct ErrorReply {
  std::string code;  ///< version, units, token, busy, sequence, malformed, refused, fault
  std::string text;
};

using Reply = std::variant<WelcomeReply, StateReply, ResultReply, ContactReply, PictureReply, EpisodeReply,
                           VerdictReply, ErrorReply>;

/// Whether it makes the robot move.
bool IsMotion(const Request& request);
/// The word in its `type`.
std::string_view NameOf(const Request& request);

template <class Body>
struct Framed {
  std::uint64_t seq = 0;  ///< of requests: one more each time; replies carry that of their request, heartbeats 0
  Body body;
};

// One line without its end. Decoders take any bytes and throw InputError for what is no sound message of the form.
std::string EncodeRequest(WireForm form, std::uint64_t seq, const Request& request);
std::string EncodeReply(WireForm form, std::uint64_t seq, const Reply& reply);
Framed<Request> DecodeRequest(WireForm form, std::string_view line);
Framed<Reply> DecodeReply(WireForm form, std::string_view line);

/// By its first character: '{' or '('. Empty for any other.
std::optional<WireForm> FormOf(std::string_view line);

}  // namespace feeler::execution
