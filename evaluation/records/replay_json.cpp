#include "feeler/evaluation/records/replay_json.h"

#include <cmath>
#include <cstddef>

namespace feeler::evaluation {
namespace {

using nlohmann::ordered_json;

constexpr double kJointStep_rad = 2e-5;
constexpr double kPointStep_m = 1e-5;
constexpr double kForceStep_n = 0.1;

void PutVarint(std::uint64_t value, std::vector<std::uint8_t>& bytes) {
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 0x80));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

std::uint64_t Zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}

std::int64_t Steps(double value, double step) { return std::llround(value / step); }

}  // namespace

std::string Base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t rest = bytes.size() - i;
    const std::uint32_t group = static_cast<std::uint32_t>(bytes[i]) << 16 |
                                (rest > 1 ? static_cast<std::uint32_t>(bytes[i + 1]) << 8 : 0U) |
                                (rest > 2 ? static_cast<std::uint32_t>(bytes[i + 2]) : 0U);
    text += kDigits[group >> 18];
    text += kDigits[group >> 12 & 63U];
    text += rest > 1 ? kDigits[group >> 6 & 63U] : '=';
    text += rest > 2 ? kDigits[group & 63U] : '=';
  }
  return text;
}

std::vector<std::uint8_t> PackJoints(const std::vector<env::JointVector>& q_rad) {
  std::vector<std::uint8_t> bytes;
  std::int64_t before[env::kJointCount] = {};
  for (const env::JointVector& q : q_rad) {
    for (int joint = 0; joint < env::kJointCount; ++joint) {
      const std::int64_t now = Steps(q[joint], kJointStep_rad);
      PutVarint(Zigzag(now - before[joint]), bytes);
      before[joint] = now;
    }
  }
  return bytes;
}

std::vector<int> RuledOutBy(const execution::ExecutionRecord& execution, int hypotheses) {
  std::vector<int> ruled_out(static_cast<std::size_t>(hypotheses), 0);
  for (std::size_t i = 0; i < execution.decisions.size(); ++i) {
    const execution::DecisionRecord& decision = execution.decisions[i];
    if (decision.attempt != 0) break;
    std::size_t left = 0;
    for (int h = 0; h < hypotheses; ++h) {
      if (left < decision.left.size() && decision.left[left] == h) {
        ++left;
      } else if (int& by = ruled_out[static_cast<std::size_t>(h)]; by == 0) {
        by = static_cast<int>(i) + 1;
      }
    }
  }
  return ruled_out;
}

std::vector<std::uint8_t> PackRuns(const std::vector<int>& values) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < values.size();) {
    std::size_t end = i;
    while (end < values.size() && values[end] == values[i]) ++end;
    PutVarint(static_cast<std::uint64_t>(values[i]), bytes);
    PutVarint(end - i, bytes);
    i = end;
  }
  return bytes;
}

ordered_json ReplayJson(const workflow::EpisodeRecord& record) {
  const workflow::Replay& replay = *record.replay;
  const execution::ExecutionRecord& execution = record.execution;
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
  json["decisions"] = ordered_json::array();
  for (const execution::DecisionRecord& d : execution.decisions) {
    json["decisions"].push_back(
        {d.attempt, d.motions, d.direction, d.cells, d.travelled_cells, d.contact, d.outcomes, d.left.size()});
  }
  json["hypotheses"] = execution.hypotheses;
  json["ruled_out"] = Base64(PackRuns(RuledOutBy(execution, execution.hypotheses)));
  return json;
}

}  // namespace feeler::evaluation
