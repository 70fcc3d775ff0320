#include "feeler/evaluation/records/replay_json.h"

#include <cmath>
#include <cstddef>

#include "feeler/execution/records/base64.h"

namespace feeler::evaluation {
namespace {

using nlohmann::ordered_json;

constexpr double kJointStep_rad = 2e-5;
constexpr double kPointStep_m = 1e-5;
constexpr double kForceStep_n = 0.1;

std::uint64_t Zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}

std::int64_t Steps(double value, double step) { return std::llround(value / step); }

}  // namespace

std::string Base64(std::span<const std::uint8_t> bytes) { return execution::ToBase64(bytes); }

std::vector<std::uint8_t> PackJoints(const std::vector<env::JointVector>& q_rad) {
  std::vector<std::uint8_t> bytes;
  std::int64_t before[env::kJointCount] = {};
  for (const env::JointVector& q : q_rad) {
    for (int joint = 0; joint < env::kJointCount; ++joint) {
      const std::int64_t now = Steps(q[joint], kJointStep_rad);
      execution::PutVarint(Zigzag(now - before[joint]), bytes);
      before[joint] = now;
    }
  }
  return bytes;
}

ordered_json RobotReplay(const workflow::Replay& replay) {
  ordered_json json;
  json["period_s"] = replay.period_s;
  json["start_s"] = replay.start_s;
  json["samples"] = replay.q_rad.size();
  json["joints"] = Base64(PackJoints(replay.q_rad));
  json["contacts"] = ordered_json::array();
  for (const workflow::ReplayContact& contact : replay.contacts) {
    json["contacts"].push_back({contact.sample, Steps(contact.point_m.x(), kPointStep_m),
                                Steps(contact.point_m.y(), kPointStep_m), Steps(contact.point_m.z(), kPointStep_m),
                                Steps(contact.force_n, kForceStep_n)});
  }
  return json;
}

}  // namespace feeler::evaluation
