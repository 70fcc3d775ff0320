#include "feeler/execution/remote/protocol/messages_json.h"

#include <array>
#include <functional>

#include "feeler/core/error.h"
#include "feeler/core/printable.h"
#include "feeler/execution/records/base64.h"
#include "feeler/execution/remote/protocol/schema.h"
#include "feeler/execution/remote/protocol/wire_pose.h"
#include "feeler/policies/io/json_input.h"

namespace feeler::execution {
namespace {

using nlohmann::json;

constexpr std::size_t kMostText = 400;

json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json PoseRows(const Pose& pose) {
  json list = json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) list.push_back(pose.matrix()(row, column));
  }
  return list;
}

json StateJson(const RobotState& state) {
  const Wrench& w = state.wrench;
  json item = {
      {"time_s", state.time_s},
      {"pose", PoseRows(state.world_T_tool)},
      {"wrench", {w.force_n.x(), w.force_n.y(), w.force_n.z(), w.torque_nm.x(), w.torque_nm.y(), w.torque_nm.z()}},
      {"mode", ToString(state.mode)}};
  if (!state.joints_rad.empty()) item["joints"] = state.joints_rad;
  return item;
}

json CapabilitiesJson(const Capabilities& c) {
  json item = {{"motions", c.motions},
               {"payload_kg", c.payload_kg},
               {"force_noise_n", c.force_noise_n},
               {"contact_force_n", c.contact_force_n},
               {"reaction_time_s", c.reaction_time_s},
               {"effective_mass_kg", c.effective_mass_kg},
               {"stopping_time_s", c.stopping_time_s},
               {"max_speed_m_s", c.max_speed_m_s},
               {"max_force_n", c.max_force_n},
               {"workspace_min_m", Vector(c.workspace_min_m)},
               {"workspace_max_m", Vector(c.workspace_max_m)}};
  if (!c.arm.empty()) item["arm"] = c.arm;
  return item;
}

// What a message has beside `type` and `seq`.
struct RequestBody {
  json operator()(const HelloRequest& m) const {
    return {{"version", m.version}, {"units", m.units}, {"client", m.client}, {"token", m.token}};
  }
  json operator()(const ContactRequest& m) const { return {{"direction", Vector(m.direction)}}; }
  json operator()(const TransferRequest& m) const { return {{"pose", PoseRows(m.world_T_tool)}}; }
  json operator()(const LinearRequest& m) const {
    return {{"pose", PoseRows(m.world_T_tool)}, {"speed_m_s", m.speed_m_s}, {"contact_force_n", m.contact_force_n}};
  }
  json operator()(const GuardedMotion& m) const {
    return {{"direction", Vector(m.direction)},
            {"distance_m", m.distance_m},
            {"speed_m_s", m.speed_m_s},
            {"contact_force_n", m.contact_force_n}};
  }
  json operator()(const CompliantMotion& m) const {
    json poses = json::array();
    for (const Pose& pose : m.world_T_tool) poses.push_back(PoseRows(pose));
    return {{"poses", poses},
            {"speed_m_s", m.speed_m_s},
            {"force_limit_n", m.force_limit_n},
            {"time_limit_s", m.time_limit_s},
            {"stiffness_n_m", Vector(m.stiffness_n_m)},
            {"rotational_stiffness_nm_rad", m.rotational_stiffness_nm_rad},
            {"rest_time_s", m.rest_time_s}};
  }
  json operator()(const TwistMotion& m) const {
    return {{"tool_T_frame", PoseRows(m.tool_T_frame)},
            {"linear_m_s", Vector(m.linear_m_s)},
            {"angular_rad_s", Vector(m.angular_rad_s)},
            {"duration_s", m.duration_s},
            {"contact_force_n", m.contact_force_n}};
  }
  json operator()(const EpisodeRequest& m) const {
    json item = {{"episode", m.episode ? json(*m.episode) : json()}};
    if (!m.extents.empty()) item["extents"] = m.extents;
    return item;
  }
  template <class Empty>
  json operator()(const Empty& /*message*/) const {
    return json::object();
  }
};

struct ReplyBody {
  json operator()(const WelcomeReply& m) const {
    return {{"type", "welcome"},
            {"version", m.version},
            {"units", m.units},
            {"robot", m.robot},
            {"simulated", m.simulated},
            {"lockstep", m.lockstep},
            {"link_timeout_s", m.link_timeout_s},
            {"capabilities", CapabilitiesJson(m.capabilities)},
            {"state", StateJson(m.state)}};
  }
  json operator()(const StateReply& m) const { return {{"type", "state"}, {"state", StateJson(m.state)}}; }
  json operator()(const ResultReply& m) const {
    return {{"type", "result"},
            {"reason", ToString(m.result.reason)},
            {"travelled_m", m.result.travelled_m},
            {"contact", m.result.contact},
            {"peak_force_n", m.result.peak_force_n},
            {"pose", PoseRows(m.result.world_T_tool)},
            {"detail", Printable(m.result.detail, kMostText)},
            {"state", StateJson(m.state)}};
  }
  json operator()(const ContactReply& m) const {
    json reply = {{"type", "contact"},
                  {"held_mass_kg", m.held_mass_kg},
                  {"free_mass_kg", m.free_mass_kg},
                  {"stiffness_n_m", m.stiffness_n_m},
                  {"damping_ratio", m.damping_ratio},
                  {"reaction_time_s", m.reaction_time_s},
                  {"force_noise_n", m.force_noise_n}};
    if (m.push_n > 0.0) reply["push_n"] = m.push_n;
    return reply;
  }
  json operator()(const PictureReply& m) const {
    const CameraView& view = m.view;
    return {{"type", "picture"},
            {"width", view.width},
            {"height", view.height},
            {"rgb_base64", ToBase64(view.rgb)},
            {"fx", view.fx},
            {"fy", view.fy},
            {"cx", view.cx},
            {"cy", view.cy},
            {"tool_T_camera", PoseRows(view.tool_T_camera)}};
  }
  json operator()(const EpisodeReply& m) const {
    return {{"type", "episode"},
            {"seed", m.seed},
            {"episode", m.episode},
            {"task", m.task},
            {"noise", m.noise},
            {"placement", m.placement},
            {"rejected_placements", m.rejected_placements},
            {"extents", m.extents},
            {"estimate", PoseRows(m.world_T_estimate)},
            {"contact_threshold_n", m.contact_threshold_n},
            {"force_budget_n", m.force_budget_n},
            {"failure", Printable(m.failure, kMostText)},
            {"state", StateJson(m.state)}};
  }
  json operator()(const VerdictReply& m) const {
    return {{"type", "verdict"},
            {"true_pose", PoseRows(m.world_T_true)},
            {"truth_outside", m.truth_outside},
            {"fault_values", m.fault_values},
            {"contact_parameters", m.contact_parameters},
            {"inserted", m.inserted},
            {"reason", m.reason},
            {"depth_m", m.depth_m},
            {"lateral_m", m.lateral_m},
            {"peak_force_n", m.peak_force_n},
            {"impulse_ns", m.impulse_ns},
            {"forbidden_contacts", m.forbidden_contacts},
            {"replay", m.replay}};
  }
  json operator()(const ErrorReply& m) const {
    return {{"type", "error"}, {"code", m.code}, {"text", Printable(m.text, kMostText)}};
  }
};

Eigen::Vector3d VectorOf(const json& list) {
  return {list[0].get<double>(), list[1].get<double>(), list[2].get<double>()};
}

Pose PoseOf(const json& list) {
  Pose pose = Pose::Identity();
  for (int i = 0; i < 12; ++i) pose.matrix()(i / 4, i % 4) = list[static_cast<std::size_t>(i)].get<double>();
  return SoundPose(pose);
}

RobotState StateOf(const json& item) {
  RobotState state;
  state.time_s = item["time_s"].get<double>();
  state.world_T_tool = PoseOf(item["pose"]);
  const json& w = item["wrench"];
  state.wrench.force_n = VectorOf(w);
  state.wrench.torque_nm = {w[3].get<double>(), w[4].get<double>(), w[5].get<double>()};
  const std::string mode = item["mode"].get<std::string>();
  for (const RobotMode known :
       {RobotMode::kWaiting, RobotMode::kReady, RobotMode::kMoving, RobotMode::kProtectiveStop, RobotMode::kFault}) {
    if (ToString(known) == mode) state.mode = known;
  }
  if (item.contains("joints")) state.joints_rad = item["joints"].get<std::vector<double>>();
  return state;
}

Capabilities CapabilitiesOf(const json& item) {
  Capabilities c;
  c.motions = item["motions"].get<std::vector<std::string>>();
  if (item.contains("arm")) c.arm = item["arm"].get<std::string>();
  c.payload_kg = item["payload_kg"].get<double>();
  c.force_noise_n = item["force_noise_n"].get<double>();
  c.contact_force_n = item["contact_force_n"].get<double>();
  c.reaction_time_s = item["reaction_time_s"].get<double>();
  c.effective_mass_kg = item["effective_mass_kg"].get<double>();
  c.stopping_time_s = item["stopping_time_s"].get<double>();
  c.max_speed_m_s = item["max_speed_m_s"].get<double>();
  c.max_force_n = item["max_force_n"].get<double>();
  c.workspace_min_m = VectorOf(item["workspace_min_m"]);
  c.workspace_max_m = VectorOf(item["workspace_max_m"]);
  return c;
}

/// What the other end wrote, fit to be shown.
std::string TextOf(const json& item) { return Printable(item.get<std::string>(), kMostText); }

std::vector<int> ExtentsOf(const json& item) {
  auto extents = item.get<std::vector<int>>();
  if (extents.size() == 4) RefuseMessage("extents are three numbers, or five");
  return extents;
}

CompliantMotion CompliantOf(const json& item) {
  CompliantMotion motion;
  for (const json& pose : item["poses"]) motion.world_T_tool.push_back(PoseOf(pose));
  motion.speed_m_s = item["speed_m_s"].get<double>();
  motion.force_limit_n = item["force_limit_n"].get<double>();
  motion.time_limit_s = item["time_limit_s"].get<double>();
  motion.stiffness_n_m = VectorOf(item["stiffness_n_m"]);
  motion.rotational_stiffness_nm_rad = item["rotational_stiffness_nm_rad"].get<double>();
  if (item.contains("rest_time_s")) motion.rest_time_s = item["rest_time_s"].get<double>();
  return motion;
}

TwistMotion TwistOf(const json& item) {
  TwistMotion motion;
  motion.tool_T_frame = PoseOf(item["tool_T_frame"]);
  motion.linear_m_s = VectorOf(item["linear_m_s"]);
  motion.angular_rad_s = VectorOf(item["angular_rad_s"]);
  motion.duration_s = item["duration_s"].get<double>();
  motion.contact_force_n = item["contact_force_n"].get<double>();
  return motion;
}

Request RequestOf(const std::string& type, const json& item) {
  if (type == "hello") {
    return HelloRequest{item["version"].get<int>(), item["units"].get<std::string>(), item["client"].get<std::string>(),
                        item["token"].get<std::string>()};
  }
  if (type == "state") return StateRequest{};
  if (type == "zero") return ZeroRequest{};
  if (type == "contact") return ContactRequest{SoundDirection(VectorOf(item["direction"]))};
  if (type == "transfer") return TransferRequest{PoseOf(item["pose"])};
  if (type == "linear") {
    return LinearRequest{PoseOf(item["pose"]), item["speed_m_s"].get<double>(), item["contact_force_n"].get<double>()};
  }
  if (type == "guarded") {
    return GuardedMotion{SoundDirection(VectorOf(item["direction"])), item["distance_m"].get<double>(),
                         item["speed_m_s"].get<double>(), item["contact_force_n"].get<double>()};
  }
  if (type == "compliant") return CompliantOf(item);
  if (type == "twist") return TwistOf(item);
  if (type == "look") return LookRequest{};
  if (type == "stop") return StopRequest{};
  if (type == "start") return StartRequest{};
  if (type == "recover") return RecoverRequest{};
  if (type == "heartbeat") return HeartbeatRequest{};
  if (type == "bye") return ByeRequest{};
  if (type == "episode") {
    EpisodeRequest episode;
    if (!item["episode"].is_null()) episode.episode = item["episode"].get<std::uint64_t>();
    if (item.contains("extents")) episode.extents = ExtentsOf(item["extents"]);
    return episode;
  }
  return VerdictRequest{};
}

MotionResult ResultOf(const json& item) {
  MotionResult result;
  const std::string reason = item["reason"].get<std::string>();
  for (const StopReason known : {StopReason::kReached, StopReason::kContact, StopReason::kForceLimit,
                                 StopReason::kTimeLimit, StopReason::kUnplanned, StopReason::kAborted}) {
    if (ToString(known) == reason) result.reason = known;
  }
  result.travelled_m = item["travelled_m"].get<double>();
  result.contact = item["contact"].get<bool>();
  result.peak_force_n = item["peak_force_n"].get<double>();
  result.world_T_tool = PoseOf(item["pose"]);
  result.detail = TextOf(item["detail"]);
  return result;
}

CameraView PictureOf(const json& item) {
  CameraView view;
  view.width = item["width"].get<int>();
  view.height = item["height"].get<int>();
  const auto bytes = FromBase64(item["rgb_base64"].get_ref<const std::string&>());
  const std::size_t expected =
      std::size_t{3} * static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
  if (!bytes || bytes->size() != expected) RefuseMessage("a picture is not as large as it says");
  view.rgb = *bytes;
  view.fx = item["fx"].get<double>();
  view.fy = item["fy"].get<double>();
  view.cx = item["cx"].get<double>();
  view.cy = item["cy"].get<double>();
  view.tool_T_camera = PoseOf(item["tool_T_camera"]);
  return view;
}

EpisodeReply EpisodeOf(const json& item) {
  EpisodeReply m;
  m.seed = item["seed"].get<std::uint64_t>();
  m.episode = item["episode"].get<std::uint64_t>();
  m.task = TextOf(item["task"]);
  m.noise = TextOf(item["noise"]);
  m.placement = TextOf(item["placement"]);
  m.rejected_placements = item["rejected_placements"].get<int>();
  m.extents = ExtentsOf(item["extents"]);
  m.world_T_estimate = PoseOf(item["estimate"]);
  m.contact_threshold_n = item["contact_threshold_n"].get<double>();
  m.force_budget_n = item["force_budget_n"].get<double>();
  m.failure = TextOf(item["failure"]);
  m.state = StateOf(item["state"]);
  return m;
}

VerdictReply VerdictOf(const json& item) {
  VerdictReply m;
  m.world_T_true = PoseOf(item["true_pose"]);
  m.truth_outside = item["truth_outside"].get<bool>();
  const auto numbers = [&](const char* key, std::map<std::string, double>& values) {
    for (const auto& [name, value] : item[key].items()) {
      if (!value.is_number()) throw InputError("robot message", std::string(key) + " holds no number", "send numbers");
      values[name] = value.get<double>();
    }
  };
  numbers("fault_values", m.fault_values);
  if (item.contains("contact_parameters")) numbers("contact_parameters", m.contact_parameters);
  m.inserted = item["inserted"].get<bool>();
  m.reason = TextOf(item["reason"]);
  m.depth_m = item["depth_m"].get<double>();
  m.lateral_m = item["lateral_m"].get<double>();
  m.peak_force_n = item["peak_force_n"].get<double>();
  m.impulse_ns = item["impulse_ns"].get<double>();
  m.forbidden_contacts = item["forbidden_contacts"].get<int>();
  m.replay = item["replay"];
  return m;
}

Reply ReplyOf(const std::string& type, const json& item) {
  if (type == "welcome") {
    WelcomeReply m;
    m.version = item["version"].get<int>();
    m.units = item["units"].get<std::string>();
    m.robot = TextOf(item["robot"]);
    m.simulated = item["simulated"].get<bool>();
    m.lockstep = item["lockstep"].get<bool>();
    m.link_timeout_s = item["link_timeout_s"].get<double>();
    m.capabilities = CapabilitiesOf(item["capabilities"]);
    m.state = StateOf(item["state"]);
    return m;
  }
  if (type == "state") return StateReply{StateOf(item["state"])};
  if (type == "result") return ResultReply{ResultOf(item), StateOf(item["state"])};
  if (type == "contact") {
    ContactReply response;
    response.held_mass_kg = item["held_mass_kg"].get<double>();
    response.free_mass_kg = item["free_mass_kg"].get<double>();
    response.stiffness_n_m = item["stiffness_n_m"].get<double>();
    response.damping_ratio = item["damping_ratio"].get<double>();
    response.reaction_time_s = item["reaction_time_s"].get<double>();
    response.force_noise_n = item["force_noise_n"].get<double>();
    response.push_n = item.value("push_n", 0.0);
    return response;
  }
  if (type == "picture") return PictureReply{PictureOf(item)};
  if (type == "episode") return EpisodeOf(item);
  if (type == "verdict") return VerdictOf(item);
  return ErrorReply{TextOf(item["code"]), TextOf(item["text"])};
}

/// The document, if the schema takes it as "PREFIX_TYPE".
json Checked(std::string_view line, const char* prefix, std::string& type) {
  json document;
  try {
    document = policies::ParseJson(line, "robot message");
  } catch (const InputError&) {
    RefuseMessage("is not valid JSON");
  }
  if (!document.is_object() || !document.contains("type") || !document["type"].is_string()) {
    RefuseMessage("is no object with a type");
  }
  type = document["type"].get<std::string>();
  const std::string fault = FaultAgainstSchema(prefix + type, document);
  if (!fault.empty()) RefuseMessage(Printable(type + ": " + fault, kMostText));
  return document;
}

std::string Dump(json& message, std::uint64_t seq) {
  message["seq"] = seq;
  return message.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

std::string RequestToJson(std::uint64_t seq, const Request& request) {
  json message = std::visit(RequestBody{}, request);
  message["type"] = NameOf(request);
  return Dump(message, seq);
}

std::string ReplyToJson(std::uint64_t seq, const Reply& reply) {
  json message = std::visit(ReplyBody{}, reply);
  return Dump(message, seq);
}

Framed<Request> RequestFromJson(std::string_view line) {
  std::string type;
  const json document = Checked(line, "request_", type);
  return {document["seq"].get<std::uint64_t>(), RequestOf(type, document)};
}

Framed<Reply> ReplyFromJson(std::string_view line) {
  std::string type;
  const json document = Checked(line, "reply_", type);
  return {document["seq"].get<std::uint64_t>(), ReplyOf(type, document)};
}

}  // namespace feeler::execution
