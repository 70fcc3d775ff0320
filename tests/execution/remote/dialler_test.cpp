// Laws of the wait for a robot's program that dials in: strangers who hang up, speak nonsense or have another token do
// not end it; a second dialler is told busy; a token that the numbers-only form loses is refused.
#include "feeler/execution/remote/dialler.h"

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/execution/remote/robot_server.h"
#include "feeler/execution/remote/token_file.h"
#include "tests/execution/remote/point_robot.h"

namespace feeler::execution {
namespace {

/// A point robot's program that dials in, and serves until the session is over.
SessionEnd DialIn(int port, const std::string& token) {
  PointRobot robot;
  ServerOptions options;
  options.token = token;
  options.lockstep = true;  // for simulations alone
  ServedRobot served = robot.Served();
  served.begin_episode = [](const EpisodeRequest&) { return EpisodeReply{}; };
  RobotServer server(served, options);
  return server.Serve(Connect({"127.0.0.1", port}, 5.0));
}

TEST(WireDialler, WaitsForTheRightOneAndTurnsTheNextAway) {
  for (const WireForm form : {WireForm::kJson, WireForm::kNumbers}) {
    RemoteOptions options;
    options.form = form;
    options.token = "4711";
    std::vector<std::string> told;
    Dialler dialler("--robot", "listen:127.0.0.1:0", options, [&](const std::string& what) { told.push_back(what); });
    ASSERT_TRUE(dialler.listens());
    const int port = dialler.port();
    auto program = std::async(std::launch::async, [&] {
      { Connection gone = Connect({"127.0.0.1", port}, 5.0); }
      Connection rude = Connect({"127.0.0.1", port}, 5.0);
      rude.Write("GET / HTTP/1.1\r\n\r\n");
      EXPECT_EQ(DialIn(port, "4712"), SessionEnd::kRefused);
      return DialIn(port, "4711");
    });
    std::unique_ptr<RemoteRobot> robot = dialler.Dial();
    robot->Start();
    EXPECT_GE(told.size(), 4U) << "that it waits, and each of three strangers";
    Connection second = Connect({"127.0.0.1", port}, 5.0);
    std::string line;
    ASSERT_EQ(second.ReadLine(line, 5.0), LineStatus::kLine);
    EXPECT_EQ(std::get<ErrorReply>(DecodeReply(form, line).body).code, "busy");
    EXPECT_EQ(robot->Guarded({-Eigen::Vector3d::UnitZ(), 0.01, 0.05, 5.0}).reason, StopReason::kReached);
    robot->Bye();
    EXPECT_EQ(program.get(), SessionEnd::kBye);
    robot.reset();
    auto again = std::async(std::launch::async, [&] {  // dials until it is no longer told busy
      SessionEnd end = SessionEnd::kRefused;
      for (int i = 0; i < 1000 && end == SessionEnd::kRefused; ++i) end = DialIn(port, "4711");
      return end;
    });
    robot = dialler.Dial();
    robot->Bye();
    EXPECT_NE(again.get(), SessionEnd::kRefused);
  }
}

TEST(WireDialler, ACancelledWaitEnds) {
  CancellationToken cancellation;
  cancellation.Cancel();
  RemoteOptions options;
  options.cancellation = &cancellation;
  Dialler waits("--robot", "listen:127.0.0.1:0", options, {});
  EXPECT_THROW(waits.Dial(), WorldError);
  Dialler dials("--robot", "127.0.0.1:1", options, {});
  const double began_s = MonotonicSeconds();
  EXPECT_THROW(dials.Dial(), WorldError);
  EXPECT_LT(MonotonicSeconds() - began_s, 5.0);
}

TEST(WireDialler, AddressesAndTokensAreChecked) {
  RemoteOptions options;
  EXPECT_THROW(Dialler("--robot", "listen:nowhere", options, {}), InputError);
  EXPECT_THROW(Dialler("--robot", "listen:0.0.0.0:0", options, {}), InputError) << "others, and no token";
  options.form = WireForm::kNumbers;
  for (const char* token : {"007", "0", "12a", "1234567890"}) {
    options.token = token;
    EXPECT_THROW(Dialler("--robot", "127.0.0.1:1", options, {}), InputError) << token;
  }
  for (const char* token : {"", "7", "999999999"}) {
    options.token = token;
    EXPECT_NO_THROW(Dialler("--robot", "127.0.0.1:1", options, {})) << token;
  }
  EXPECT_EQ(AsNumber("007"), "7");
  EXPECT_EQ(AsNumber("000"), "0");
  EXPECT_EQ(AsNumber("secret"), "secret");
}

}  // namespace
}  // namespace feeler::execution
