#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "feeler/execution/remote/remote_robot.h"
#include "feeler/execution/remote/socket.h"

namespace feeler::execution {

/// The way to a robot: "HOST:PORT" dials, "listen:HOST:PORT" waits for the robot's program to dial in.
///
/// Laws of waiting: who hangs up, is silent, speaks nonsense or has another token, version or unit is told of and sent
/// away, and the wait goes on; while a session is under way who else dials in is told "busy".
class Dialler {
 public:
  using Tell = std::function<void(const std::string&)>;

  /// `option` is named where `text` is no address; `tell` hears what people should know. Throws InputError, too, for a
  /// token that the form cannot carry, and for one that is missing where others than this machine could dial in.
  Dialler(std::string option, const std::string& text, RemoteOptions options, Tell tell);
  ~Dialler();
  Dialler(const Dialler&) = delete;
  Dialler& operator=(const Dialler&) = delete;

  /// A session, after hello; the one before must be over. Throws WorldError when nobody answers, or when the wait was
  /// cancelled, and InputError for a robot that was dialled and refuses.
  std::unique_ptr<RemoteRobot> Dial();
  bool listens() const { return listener_ != nullptr; }
  /// That it listens on, or dials.
  int port() const { return listens() ? listener_->port() : address_.port; }

 private:
  void TurnAway();
  void StopTurningAway();

  RemoteOptions options_;
  Tell tell_;
  Address address_;
  std::unique_ptr<Listener> listener_;
  std::atomic<bool> dialling_{false};  ///< nobody is turned away
  std::thread turns_away_;
};

}  // namespace feeler::execution
