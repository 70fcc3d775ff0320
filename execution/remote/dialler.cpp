#include "feeler/execution/remote/dialler.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/execution/remote/token_file.h"

namespace feeler::execution {
namespace {

constexpr std::string_view kListen = "listen:";
constexpr double kDial_s = 10.0;
constexpr double kDialLook_s = 0.1;

}  // namespace

Dialler::Dialler(std::string option, const std::string& text, RemoteOptions options, Tell tell)
    : options_(std::move(options)), tell_(std::move(tell)) {
  if (options_.form == WireForm::kNumbers) RequireNumbersToken(options_.token);
  const bool listens = text.starts_with(kListen);
  address_ = ParseAddress(option, listens ? text.substr(kListen.size()) : text);
  if (!listens) return;
  if (!IsLoopback(address_) && options_.token.empty()) {
    throw InputError(option, "others than this machine reach " + address_.host + ", and there is no token",
                     "listen on 127.0.0.1 or give --token-file");
  }
  // A stranger who says nothing keeps the robot waiting.
  constexpr double kHello_s = 2.0;
  options_.hello_timeout_s = std::min(options_.hello_timeout_s, kHello_s);
  listener_ = std::make_unique<Listener>(option, address_);
}

Dialler::~Dialler() { StopTurningAway(); }

std::unique_ptr<RemoteRobot> Dialler::Dial() {
  if (!listens()) {
    return std::make_unique<RemoteRobot>(Connect(address_, kDial_s, options_.cancellation), options_);
  }
  StopTurningAway();
  if (tell_) tell_(fmt::format("waits for the robot's program on port {}", port()));
  for (;;) {
    if (options_.cancellation != nullptr && options_.cancellation->cancelled()) {
      throw WorldError("robot", "nobody dialled in", "start the robot's program");
    }
    std::optional<Connection> connection = listener_->Accept(kDialLook_s);
    if (!connection) continue;
    try {
      auto robot = std::make_unique<RemoteRobot>(std::move(*connection), options_);
      turns_away_ = std::thread([this] { TurnAway(); });
      return robot;
    } catch (const Error& error) {
      if (tell_) tell_(std::string("who dialled in is not taken: ") + error.what());
    }
  }
}

void Dialler::TurnAway() {
  const std::string busy = EncodeReply(options_.form, 0, ErrorReply{"busy", "another session is under way"}) + "\n";
  while (!dialling_) {
    std::optional<Connection> other = listener_->Accept(kDialLook_s);
    if (!other) continue;
    other->Write(busy, kDialLook_s);
    other->Finish();
  }
}

void Dialler::StopTurningAway() {
  dialling_ = true;
  if (turns_away_.joinable()) turns_away_.join();
  dialling_ = false;
}

}  // namespace feeler::execution
