// Laws of the executor's end, over loopback with a robot that answers as it is told: one that cannot be trusted is
// refused at hello; one that is not ready gets no motion; a motion that cannot have ended so ends the session; what was
// measured of contacts stands above what the robot says.
#include "feeler/execution/remote/remote_robot.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "feeler/core/error.h"
#include "tests/execution/remote/point_robot.h"

namespace feeler::execution {
namespace {

/// A robot of one session, in a thread, that answers as it is told.
class Teller {
 public:
  Teller(WelcomeReply welcome, std::function<Reply(const Request&)> answer, std::uint64_t welcome_seq = 0)
      : listener_("--listen", {"127.0.0.1", 0}),
        thread_([this, welcome = std::move(welcome), answer = std::move(answer), welcome_seq] {
          std::optional<Connection> connection = listener_.Accept(5.0);
          std::string line;
          if (!connection || connection->ReadLine(line, 5.0) != LineStatus::kLine) return;
          connection->Write(EncodeReply(WireForm::kJson, welcome_seq, welcome) + "\n");
          while (connection->ReadLine(line, 5.0) == LineStatus::kLine) {
            const Framed<Request> request = DecodeRequest(WireForm::kJson, line);
            if (IsMotion(request.body)) ++motions;
            if (request.seq != 0)
              connection->Write(EncodeReply(WireForm::kJson, request.seq, answer(request.body)) + "\n");
          }
        }) {}
  std::unique_ptr<RemoteRobot> Remote(RemoteOptions options = {}) const {
    return std::make_unique<RemoteRobot>(Connect({"127.0.0.1", listener_.port()}, 5.0), options);
  }
  std::atomic<int> motions{0};

 private:
  Listener listener_;
  std::jthread thread_;
};

WelcomeReply Welcome(bool simulated = true) {
  WelcomeReply welcome;
  welcome.robot = "teller";
  welcome.simulated = welcome.lockstep = simulated;
  welcome.capabilities.motions = {"transfer", "linear", "guarded", "compliant"};
  return welcome;
}

Reply Ready(const Request& /*request*/) { return StateReply{}; }

TEST(WireRobot, ARobotThatCannotBeTrustedIsRefusedAtHello) {
  const auto refused = [](const std::function<void(WelcomeReply&)>& change, const std::string& word,
                          const RemoteOptions& options = {}, std::uint64_t seq = 0) {
    WelcomeReply welcome = Welcome(false);
    change(welcome);
    Teller teller(welcome, Ready, seq);
    try {
      teller.Remote(options);
      ADD_FAILURE() << word;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
    EXPECT_EQ(teller.motions, 0);
  };
  refused([](WelcomeReply& w) { w.lockstep = true; }, "lockstep");
  refused([](WelcomeReply& w) { w.link_timeout_s = 60.0; }, "silent for 60 s");
  refused([](WelcomeReply& w) { w.capabilities.contact_force_n = 1e9; }, "tells contacts from");
  refused([](WelcomeReply&) {}, "number 5", {}, 5);
  RemoteOptions slow;
  slow.heartbeat_s = 0.5;
  refused([](WelcomeReply&) {}, "--heartbeat", slow);
  RemoteOptions patient;
  patient.link_timeout_s = 60.0;
  WelcomeReply silent = Welcome(false);
  silent.link_timeout_s = 30.0;
  Teller teller(silent, Ready);
  EXPECT_NO_THROW(teller.Remote(patient)) << "as the operator allows";
}

TEST(WireRobot, ARobotThatIsNotReadyGetsNoMotion) {
  const auto in_mode = [](RobotMode mode) {
    return [mode](const Request& request) -> Reply {
      RobotState state;
      state.mode = mode;
      if (IsMotion(request)) return ResultReply{{}, state};
      return StateReply{state};
    };
  };
  for (const RobotMode mode : {RobotMode::kWaiting, RobotMode::kProtectiveStop, RobotMode::kFault}) {
    Teller teller(Welcome(), in_mode(mode));
    const auto remote = teller.Remote();
    EXPECT_THROW(remote->Start(), WorldError) << ToString(mode);
    if (mode == RobotMode::kWaiting) continue;
    EXPECT_EQ(remote->Guarded(Down()).reason, StopReason::kAborted);
    EXPECT_EQ(teller.motions, 0) << ToString(mode);
  }
}

TEST(WireRobot, AMotionThatCannotHaveEndedSoEndsTheSession) {
  const auto ended = [](const std::function<void(ResultReply&)>& change) {
    Teller teller(Welcome(), [&](const Request& request) -> Reply {
      if (!IsMotion(request)) return StateReply{};
      ResultReply result;
      result.result.world_T_tool.translation() = Eigen::Vector3d(0.0, 0.0, -0.02);
      result.result.travelled_m = 0.02;
      change(result);
      result.state.world_T_tool = result.result.world_T_tool;
      return result;
    });
    const auto remote = teller.Remote();
    remote->Start();
    const MotionResult first = remote->Guarded(Down(0.02));
    EXPECT_EQ(remote->lost().empty(), first.reason == StopReason::kReached);
    EXPECT_EQ(remote->spoke_nonsense(), !remote->lost().empty());
    const std::string lost = remote->lost();
    if (!lost.empty()) remote->Guarded(Down(0.02));
    EXPECT_EQ(teller.motions, 1) << "no motion after it";
    return lost;
  };
  EXPECT_EQ(ended([](ResultReply&) {}), "");
  EXPECT_NE(ended([](ResultReply& r) { r.result.world_T_tool = Pose::Identity(); }).find("'reached'"),
            std::string::npos);
  EXPECT_NE(ended([](ResultReply& r) {
              r.result.world_T_tool.linear() = Eigen::AngleAxisd(3.0, Eigen::Vector3d::UnitX()).toRotationMatrix();
            }).find("turned"),
            std::string::npos);
  EXPECT_NE(ended([](ResultReply& r) {
              r.result.reason = StopReason::kContact;
              r.result.world_T_tool.translation().z() = 0.02;
            }).find("other way"),
            std::string::npos);
  EXPECT_NE(ended([](ResultReply& r) { r.result.travelled_m = -5000.0; }).find("travelled"), std::string::npos);
}

TEST(WireRobot, WhatWasMeasuredOfContactsStandsAboveWhatTheRobotSays) {
  const auto told = [](const Request& request) -> Reply {
    if (std::holds_alternative<ContactRequest>(request)) return ErrorReply{"refused", "\x1b[31mno\nidea"};
    return StateReply{};
  };
  WelcomeReply welcome = Welcome();
  welcome.capabilities.effective_mass_kg = 7.0;
  welcome.capabilities.reaction_time_s = 0.03;
  Teller teller(welcome, told);
  RemoteOptions options;
  options.measured.stiffness_n_m = 1234.0;
  const auto remote = teller.Remote(options);
  const ContactResponse contact = remote->Contact(Eigen::Vector3d::UnitX());
  EXPECT_EQ(contact.held_mass_kg, 7.0);
  EXPECT_EQ(contact.reaction_time_s, 0.03);
  EXPECT_EQ(contact.stiffness_n_m, 1234.0);
}

}  // namespace
}  // namespace feeler::execution
