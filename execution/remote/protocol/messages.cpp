#include "feeler/execution/remote/protocol/messages.h"

#include <array>

#include "feeler/core/error.h"
#include "feeler/execution/remote/protocol/messages_json.h"
#include "feeler/execution/remote/protocol/messages_numbers.h"

namespace feeler::execution {

std::string_view ToString(RobotMode mode) {
  switch (mode) {
    case RobotMode::kWaiting: return "waiting";
    case RobotMode::kReady: return "ready";
    case RobotMode::kMoving: return "moving";
    case RobotMode::kProtectiveStop: return "protective_stop";
    case RobotMode::kFault: return "fault";
  }
  return "";
}

bool IsMotion(const Request& request) {
  return std::holds_alternative<TransferRequest>(request) || std::holds_alternative<LinearRequest>(request) ||
         std::holds_alternative<GuardedMotion>(request) || std::holds_alternative<CompliantMotion>(request) ||
         std::holds_alternative<TwistMotion>(request);
}

std::string_view NameOf(const Request& request) {
  static constexpr std::array<std::string_view, std::variant_size_v<Request>> kNames = {
      "hello", "state", "zero",  "contact", "transfer",  "linear", "guarded", "compliant", "twist",
      "look",  "stop",  "start", "recover", "heartbeat", "bye",    "episode", "verdict"};
  return kNames.at(request.index());
}

std::optional<WireForm> FormOf(std::string_view line) {
  if (line.starts_with('{')) return WireForm::kJson;
  if (line.starts_with('(')) return WireForm::kNumbers;
  return std::nullopt;
}

std::string EncodeRequest(WireForm form, std::uint64_t seq, const Request& request) {
  return form == WireForm::kJson ? RequestToJson(seq, request) : RequestToNumbers(seq, request);
}

std::string EncodeReply(WireForm form, std::uint64_t seq, const Reply& reply) {
  return form == WireForm::kJson ? ReplyToJson(seq, reply) : ReplyToNumbers(seq, reply);
}

namespace {

/// A parser of JSON takes a NUL for the end of the text.
std::string_view WithoutControl(std::string_view line) {
  for (const char c : line) {
    if (static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\r') {
      throw InputError("robot message", "holds a control character", "send lines of text");
    }
  }
  return line;
}

}  // namespace

Framed<Request> DecodeRequest(WireForm form, std::string_view line) {
  return form == WireForm::kJson ? RequestFromJson(WithoutControl(line)) : RequestFromNumbers(line);
}

Framed<Reply> DecodeReply(WireForm form, std::string_view line) {
  return form == WireForm::kJson ? ReplyFromJson(WithoutControl(line)) : ReplyFromNumbers(line);
}

}  // namespace feeler::execution
