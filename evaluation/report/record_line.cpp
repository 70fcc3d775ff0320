#include "feeler/evaluation/report/record_line.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "feeler/core/json_depth.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

[[noreturn]] void Refuse(const std::string& what) { throw std::invalid_argument(what); }

const json& Member(const json& object, const char* key) {
  if (!object.is_object() || !object.contains(key)) Refuse(std::string("has no \"") + key + "\"");
  return object.at(key);
}

double Number(const json& object, const char* key, double least) {
  const json& value = Member(object, key);
  if (!value.is_number() || !std::isfinite(value.get<double>())) Refuse(std::string("\"") + key + "\" is no number");
  if (value.get<double>() < least) Refuse(std::string("\"") + key + "\" is " + value.dump());
  return value.get<double>();
}

std::int64_t Whole(const json& object, const char* key) {
  const json& value = Member(object, key);
  if (!value.is_number_integer() || value.get<std::int64_t>() < 0) {
    Refuse(std::string("\"") + key + "\" is not a whole number of at least 0");
  }
  return value.get<std::int64_t>();
}

bool Flag(const json& object, const char* key) {
  const json& value = Member(object, key);
  if (!value.is_boolean()) Refuse(std::string("\"") + key + "\" is neither true nor false");
  return value.get<bool>();
}

std::string Text(const json& object, const char* key) {
  const json& value = Member(object, key);
  if (!value.is_string()) Refuse(std::string("\"") + key + "\" is no text");
  return value.get<std::string>();
}

const json& List(const json& object, const char* key) {
  const json& value = Member(object, key);
  if (!value.is_array()) Refuse(std::string("\"") + key + "\" is no list");
  return value;
}

double Rounded(double value, double step) { return std::round(value / step) * step; }

/// [x, y, z, qw, qx, qy, qz]
json PackedPose(const json& object, const char* key) {
  const json& pose = Member(object, key);
  if (pose.is_null()) return nullptr;
  json packed = json::array();
  for (const auto& [part, count] : {std::pair{"position_m", 3U}, std::pair{"quaternion_wxyz", 4U}}) {
    const json& numbers = List(pose, part);
    if (numbers.size() != count) Refuse(std::string("\"") + key + "\" has a " + part + " of another length");
    for (const json& number : numbers) {
      if (!number.is_number() || !std::isfinite(number.get<double>())) {
        Refuse(std::string("\"") + key + "\" holds something that is no number");
      }
      packed.push_back(Rounded(number.get<double>(), 1e-7));
    }
  }
  return packed;
}

/// Lengths in 0.01 mm, forces in 0.1 N, times in ms.
json PackedMoves(const json& record) {
  json packed = json::array();
  for (const json& move : List(record, "moves")) {
    const json& predicted = Member(move, "predicted");
    json range = nullptr;
    if (!predicted.is_null()) {
      if (!predicted.is_array() || predicted.size() != 2 || !predicted[0].is_number() || !predicted[1].is_number()) {
        Refuse("\"predicted\" of a move is not two numbers");
      }
      range = {std::llround(predicted[0].get<double>() * 1e5), std::llround(predicted[1].get<double>() * 1e5)};
    }
    packed.push_back(
        {Text(move, "kind"), Text(move, "direction"), std::llround(Number(move, "commanded_m", -1e3) * 1e5), range,
         std::llround(Number(move, "travelled_m", -1e3) * 1e5), Flag(move, "contact") ? 1 : 0,
         std::llround(Number(move, "peak_force_n", 0.0) * 10.0), std::llround(Number(move, "duration_s", 0.0) * 1e3)});
  }
  return packed;
}

/// "2026-11-29T17:40:12Z"
bool IsTime(const std::string& text) {
  constexpr std::string_view kForm = "dddd-dd-ddTdd:dd:ddZ";
  return std::equal(text.begin(), text.end(), kForm.begin(), kForm.end(),
                    [](char c, char form) { return form == 'd' ? c >= '0' && c <= '9' : c == form; });
}

/// What the judge said; on a robot, where nobody knows what is true, what the executor believes.
bool JudgedOrBelieved(const json& record, const char* key) {
  return Member(record, key).is_null() ? Flag(Member(record, "believed"), key) : Flag(record, key);
}

/// What a player needs, if the record holds a replay.
std::string ReplayLine(const json& record) {
  if (!record.contains("replay") || record.at("replay").is_null()) return "";
  const json& replay = record.at("replay");
  Number(replay, "period_s", 1e-6);
  Number(replay, "start_s", 0.0);
  Whole(replay, "samples");
  Whole(replay, "hypotheses");
  for (const char* key : {"joints", "ruled_out"}) {
    if (Text(replay, key).find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=") !=
        std::string::npos) {
      Refuse(std::string("\"") + key + "\" of the replay is not base64");
    }
  }
  for (const json& contact : List(replay, "contacts")) {
    if (!contact.is_array() || contact.size() != 5) Refuse("a contact of the replay is not five numbers");
    for (const json& number : contact) {
      if (!number.is_number_integer()) Refuse("a contact of the replay is not five whole numbers");
    }
  }
  for (const json& decision : List(replay, "decisions")) {
    if (!decision.is_array() || decision.size() != 8) Refuse("a decision of the replay is not eight entries");
  }
  json line = {{"truth", PackedPose(record, "true_pose")},
               {"told", PackedPose(record, "start_estimate")},
               {"estimate", PackedPose(record, "estimate")},
               {"extents", List(record, "extents")},
               {"moves", PackedMoves(record)},
               {"ladder", List(record, "ladder")},
               {"replay", replay}};
  return line.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

ReportedEpisode ReadRecordLine(const std::string& line, json& record) {
  if (IsNestedDeeper(line)) Refuse("is nested too deep");
  record = ParseJsonText<json>(line);
  if (record.is_discarded()) Refuse("is cut off, or no JSON");
  if (!record.is_object()) Refuse("is no JSON object");
  for (const char* key : {"task", "policy", "noise"}) Text(record, key);
  const std::int64_t episode = Whole(record, "episode");
  Whole(record, "seed");
  ReportedEpisode reported;
  if (record.contains("started")) {
    reported.started = Text(record, "started");
    if (!IsTime(reported.started)) Refuse("\"started\" is no time like 2026-11-29T17:40:12Z");
  }
  reported.dry = record.contains("dry") && Flag(record, "dry");
  reported.inserted = JudgedOrBelieved(record, "inserted");
  reported.ladder = !List(record, "ladder").empty();
  json error_mm = nullptr;
  if (const json& error = Member(record, "error"); !error.is_null()) {
    error_mm = Rounded(1e3 * Number(error, "lateral_m", 0.0), 1e-4);
  }
  std::string extents;
  for (const json& n : List(record, "extents")) {
    if (!n.is_number_integer()) Refuse("\"extents\" are not whole numbers");
    extents += (extents.empty() ? "" : "x") + n.dump();
  }
  reported.row = {episode,
                  reported.inserted ? 1 : 0,
                  JudgedOrBelieved(record, "localized") ? 1 : 0,
                  Text(record, "reason"),
                  Rounded(Number(record, "sim_time_s", 0.0), 1e-4),
                  error_mm,
                  Rounded(Number(record, "path_length_m", 0.0), 1e-5),
                  Number(record, "policy_moves", 0.0),
                  Number(record, "contacts", 0.0),
                  Rounded(Number(record, "peak_force_n", 0.0), 1e-2),
                  Rounded(Number(Member(record, "timing"), "plan_cpu_s", 0.0), 1e-6),
                  extents,
                  List(record, "ladder").size()};
  reported.replay = ReplayLine(record);
  return reported;
}

}  // namespace feeler::evaluation
