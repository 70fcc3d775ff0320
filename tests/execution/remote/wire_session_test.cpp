// Laws of a session, over loopback with a point robot in lockstep: nothing moves before hello and start, after what is
// not sound, out of sequence, or after the loss of the link; a motion under way comes to rest; a client that heard
// nonsense sends no further motion; one session at a time; the next session starts anew.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/execution/remote/remote_robot.h"
#include "feeler/execution/remote/robot_server.h"
#include "tests/execution/remote/point_robot.h"

namespace feeler::execution {
namespace {

/// A server of a point robot on a port of its own, in a thread, until it goes.
class Cell {
 public:
  explicit Cell(ServerOptions options = {}, const std::vector<std::string>& more_motions = {})
      : listener_("--listen", {"127.0.0.1", 0}) {
    options.lockstep = true;
    ServedRobot served = robot.Served();
    auto& motions = served.capabilities.motions;
    motions.insert(motions.end(), more_motions.begin(), more_motions.end());
    served.begin_episode = [](const EpisodeRequest& asked) {
      EpisodeReply reply;
      reply.episode = asked.episode.value_or(0);
      reply.extents = asked.extents.empty() ? std::vector<int>{2, 2, 2} : asked.extents;
      return reply;
    };
    server = std::make_unique<RobotServer>(served, options);
    thread_ = std::thread([this] {
      while (!ending_.cancelled()) {
        auto connection = listener_.Accept(0.02);
        if (!connection) continue;
        ends.push_back(server->Serve(std::move(*connection), &listener_, &ending_));
        ++over;
      }
    });
  }
  ~Cell() { Stop(); }
  void Stop() {
    ending_.Cancel();
    if (thread_.joinable()) thread_.join();
  }
  /// So many sessions are over: who dials in now is not told "busy".
  void AwaitServed(int count) const {
    while (over < count) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  Connection Dial() const { return Connect({"127.0.0.1", listener_.port()}, 5.0); }
  std::unique_ptr<RemoteRobot> Remote(const std::string& token = "") const {
    RemoteOptions options;
    options.token = token;
    return std::make_unique<RemoteRobot>(Dial(), options);
  }

  std::atomic<int> over{0};  ///< sessions
  PointRobot robot;
  std::unique_ptr<RobotServer> server;
  std::vector<SessionEnd> ends;

 private:
  Listener listener_;
  CancellationToken ending_;
  std::thread thread_;
};

std::string Ask(Connection& connection, const std::string& line) {
  connection.Write(line + "\n");
  std::string reply;
  return connection.ReadLine(reply, 5.0) == LineStatus::kLine ? reply : "";
}

std::string Hello(const std::string& token = "", int version = kProtocolVersion,
                  const std::string& units = std::string(kProtocolUnits)) {
  return EncodeRequest(WireForm::kJson, 0, HelloRequest{version, units, "test", token});
}
std::string Line(std::uint64_t seq, const Request& request) { return EncodeRequest(WireForm::kJson, seq, request); }

TEST(WireSession, AMotionIsTheRobotsOwn) {
  Cell cell;
  const auto remote = cell.Remote();
  remote->Start();
  EXPECT_EQ(remote->welcome().robot, "point");
  const MotionResult free = remote->Guarded(Down());
  EXPECT_EQ(free.reason, StopReason::kReached);
  EXPECT_EQ(free.travelled_m, 0.05);
  const MotionResult floor = remote->Guarded(Down(0.2));
  EXPECT_EQ(floor.reason, StopReason::kContact);
  EXPECT_EQ(floor.world_T_tool.translation().z(), 0.0);
  EXPECT_GT(remote->Time(), 1.9);
  remote->ZeroWrench();
  remote->Bye();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // it is read before the server is told to end
  cell.Stop();
  EXPECT_EQ(cell.robot.zeroed, 1);
  EXPECT_EQ(cell.ends.at(0), SessionEnd::kBye);
}

TEST(WireSession, TheNumbersOnlyFormDrivesTheSameRobot) {
  Cell cell;
  RemoteOptions options;
  options.form = WireForm::kNumbers;
  RemoteRobot remote(cell.Dial(), options);
  remote.Start();
  EXPECT_NEAR(remote.Guarded(Down()).travelled_m, 0.05, 1e-9);
  CompliantMotion spiral;
  for (int i = 1; i <= 10; ++i) spiral.world_T_tool.push_back(MakePose(Eigen::Vector3d(0.001 * i, 0.0, 0.05)));
  const MotionResult pieces = remote.Compliant(spiral);
  EXPECT_EQ(pieces.reason, StopReason::kReached);
  EXPECT_NEAR(pieces.world_T_tool.translation().x(), 0.01, 1e-9);
}

TEST(WireSession, NothingMovesBeforeTheStart) {
  Cell cell;
  const auto remote = cell.Remote();
  const MotionResult refused = remote->Guarded(Down());
  EXPECT_EQ(refused.reason, StopReason::kUnplanned);
  EXPECT_NE(refused.detail.find("not started"), std::string::npos) << refused.detail;
  remote->Start();
  EXPECT_EQ(remote->Guarded(Down()).reason, StopReason::kReached);
  cell.Stop();
  EXPECT_EQ(cell.server->statistics().refused_motions, 1);
  EXPECT_EQ(cell.server->statistics().motions, 1);
}

TEST(WireSession, WrongTokenVersionAndUnitsAreToldApart) {
  ServerOptions options;
  options.token = "secret";
  Cell cell(options);
  const auto code = [&](const std::string& hello) {
    Connection connection = cell.Dial();
    const std::string reply = Ask(connection, hello);
    return std::get<ErrorReply>(DecodeReply(WireForm::kJson, reply).body).code;
  };
  EXPECT_EQ(code(Hello("wrong")), "token");
  EXPECT_EQ(code(Hello("")), "token");
  EXPECT_EQ(code(Hello("secrets")), "token");
  EXPECT_EQ(code(Hello("secret", 2)), "version");
  EXPECT_EQ(code(Hello("secret", 1, "mm kg s deg N")), "units");
  EXPECT_EQ(code(Line(1, StateRequest{})), "sequence");
  EXPECT_EQ(code("GET / HTTP/1.1"), "malformed");
  EXPECT_THROW(cell.Remote("wrong"), InputError);
  cell.Remote("secret")->Start();
  cell.Stop();
  EXPECT_EQ(cell.robot.moved_steps, 0);
}

TEST(WireSession, WhatIsOutOfSequenceOrNotSoundEndsItAndMovesNothing) {
  const std::vector<std::string> bad = {
      Line(1, Down()),          Line(2, Down()),         Line(4, Down()),
      Line(1000000, Down()),    "{\"type\":\"guarded\"", "(7,3,0,0,-1,0.05,0.05,5)",
      std::string(300000, 'x'), Line(3, HelloRequest{}), Line(77, HeartbeatRequest{})};
  for (const std::string& line : bad) {
    Cell cell;
    Connection connection = cell.Dial();
    Ask(connection, Hello());
    Ask(connection, Line(1, StartRequest{}));
    Ask(connection, Line(2, StateRequest{}));
    const std::string reply = Ask(connection, line);
    EXPECT_NE(reply.find("\"error\""), std::string::npos) << line.substr(0, 60) << reply;
    connection.Write(Line(3, Down()) + "\n");  // too late: the session is over
    cell.Stop();
    EXPECT_EQ(cell.robot.moved_steps, 0) << line.substr(0, 60);
  }
}

TEST(WireSession, OneAtATime) {
  Cell cell;
  const auto first = cell.Remote();
  first->Start();
  EXPECT_THROW(cell.Remote(), Error);
  EXPECT_EQ(first->Guarded(Down()).reason, StopReason::kReached);
}

TEST(WireSession, ALinkThatBreaksInAMotionBringsTheRobotToRest) {
  Cell cell;
  Connection connection = cell.Dial();
  Ask(connection, Hello());
  Ask(connection, Line(1, StartRequest{}));
  cell.robot.each_step = [&] {
    if (cell.robot.moved_steps == 50) connection.Shutdown();
  };
  connection.Write(Line(2, Down(0.09)) + "\n");
  while (cell.ends.empty() && cell.server->statistics().lost_links == 0) std::this_thread::yield();
  cell.Stop();
  EXPECT_GE(cell.robot.moved_steps, 50);
  EXPECT_LT(cell.robot.moved_steps, 50 + 110) << "of 1800: at rest within the time of a lost link";
  EXPECT_EQ(cell.ends.at(0), SessionEnd::kLost);
}

TEST(WireSession, AStopIsHeardInAMotion) {
  Cell cell;
  Connection connection = cell.Dial();
  Ask(connection, Hello());
  Ask(connection, Line(1, StartRequest{}));
  cell.robot.each_step = [&] {
    if (cell.robot.moved_steps == 50) connection.Write(Line(3, StopRequest{}) + "\n");
  };
  const auto reply = DecodeReply(WireForm::kJson, Ask(connection, Line(2, Down(0.09)))).body;
  EXPECT_EQ(std::get<ResultReply>(reply).result.reason, StopReason::kAborted);
  EXPECT_EQ(std::get<ResultReply>(reply).result.detail, "stopped by order");
  EXPECT_LT(cell.robot.moved_steps, 200);
}

TEST(WireSession, MotionsOutsideOfTheCapabilitiesAreRefused) {
  Cell cell;
  const auto remote = cell.Remote();
  remote->Start();
  EXPECT_EQ(remote->LinearMove(MakePose(Eigen::Vector3d(3.0, 0.0, 0.1)), 0.1, 5.0).reason, StopReason::kUnplanned);
  EXPECT_EQ(remote->LinearMove(MakePose(Eigen::Vector3d(0.1, 0.0, 0.1)), 1.5, 5.0).reason, StopReason::kUnplanned);
  CompliantMotion hard;
  hard.world_T_tool = {MakePose(Eigen::Vector3d(0.0, 0.0, 0.05))};
  hard.force_limit_n = 500.0;
  EXPECT_EQ(remote->Compliant(hard).reason, StopReason::kUnplanned);
  EXPECT_EQ(remote->FollowTwist({}).reason, StopReason::kUnplanned);
  cell.Stop();
  EXPECT_EQ(cell.robot.moved_steps, 0);
}

TEST(WireSession, ForcesStiffnessesAndRatesHaveTheirLimits) {
  Cell cell({}, {"twist"});
  Connection connection = cell.Dial();
  Ask(connection, Hello());
  Ask(connection, Line(1, StartRequest{}));
  GuardedMotion hard = Down();
  hard.contact_force_n = 1e9;
  CompliantMotion stiff;
  stiff.world_T_tool = {MakePose(Eigen::Vector3d(0.0, 0.0, 0.05))};
  stiff.stiffness_n_m.y() = 2.0 * kMostStiffness_n_m;
  CompliantMotion turned = stiff;
  turned.stiffness_n_m.y() = 1000.0;
  turned.rotational_stiffness_nm_rad = 1e300;
  TwistMotion fast;
  fast.duration_s = 0.1;
  fast.angular_rad_s = {1e9, 0.0, 0.0};
  TwistMotion lever = fast;
  lever.angular_rad_s = {0.0, 0.0, 0.5};
  lever.tool_T_frame = MakePose(Eigen::Vector3d(1e4, 0.0, 0.0));
  TwistMotion away = fast;
  away.angular_rad_s.setZero();
  away.linear_m_s = {0.5, 0.0, 0.0};
  away.duration_s = 9.0;
  const LinearRequest watched{MakePose(Eigen::Vector3d(0.0, 0.0, 0.09)), 0.1, 1000.0};
  std::uint64_t seq = 1;
  for (const Request& request : std::vector<Request>{hard, stiff, turned, fast, lever, away, watched}) {
    const std::string reply = Ask(connection, Line(++seq, request));
    EXPECT_NE(reply.find("\"refused\""), std::string::npos) << seq << reply;
  }
  LinearRequest retreat = watched;  // begins in contact: not watched
  retreat.contact_force_n = 1e6;
  EXPECT_NE(Ask(connection, Line(++seq, retreat)).find("\"reached\""), std::string::npos);
  cell.Stop();
  EXPECT_EQ(cell.server->statistics().motions, 1);
}

TEST(WireSession, ATokenThatBeginsWithZerosIsANumber) {
  ServerOptions options;
  options.token = "007";
  Cell cell(options);
  auto answer = [&, asked = 0](const std::string& hello) mutable {
    cell.AwaitServed(asked++);
    Connection connection = cell.Dial();
    return Ask(connection, hello);
  };
  EXPECT_TRUE(answer("(1,0,1,7)").starts_with("(101,")) << answer("(1,0,1,7)");
  EXPECT_TRUE(answer("(1,0,1,8)").starts_with("(109,"));
  EXPECT_NE(answer(Hello("7")).find("token"), std::string::npos) << "in JSON it is a text";
  EXPECT_NE(answer(Hello("007")).find("welcome"), std::string::npos);
}

TEST(WireFaults, NonsenseEndsTheSessionAndNoFurtherMotionIsSent) {
  for (const WireFault fault : {WireFault::kDrop, WireFault::kMalformed, WireFault::kHalf, WireFault::kNan,
                                WireFault::kBackwards, WireFault::kJump, WireFault::kProtective}) {
    ServerOptions options;
    options.faults.share[static_cast<int>(fault)] = 1.0;
    Cell cell(options);
    const auto remote = cell.Remote();
    remote->Start();
    EXPECT_EQ(remote->BeginEpisode(3).extents, (std::vector<int>{2, 2, 2}));
    int good = 0;
    MotionResult ended;
    for (int i = 0; i < 20; ++i) {
      ended = remote->Guarded(
          {i % 2 == 0 ? Eigen::Vector3d(Eigen::Vector3d::UnitX()) : -Eigen::Vector3d::UnitX(), 0.015, 0.05, 5.0});
      if (ended.reason != StopReason::kReached) break;
      ++good;
    }
    EXPECT_LT(good, 12) << ToString(fault);
    EXPECT_EQ(ended.reason, StopReason::kAborted) << ToString(fault) << ended.detail;
    const MotionResult next = remote->Guarded(Down());
    EXPECT_NE(next.reason, StopReason::kReached) << ToString(fault);
    if (fault == WireFault::kProtective) {
      EXPECT_NE(ended.detail.find("protective stop"), std::string::npos);
      remote->Recover();
      EXPECT_EQ(remote->Guarded(Down()).reason, StopReason::kReached);
    } else {
      EXPECT_NE(ended.detail.find("link lost"), std::string::npos) << ToString(fault) << ended.detail;
    }
    cell.Stop();
    const int motions = good + (fault == WireFault::kProtective ? 2 : 1);
    EXPECT_LE(cell.server->statistics().motions, motions) << ToString(fault);
    EXPECT_EQ(cell.server->statistics().ordered[static_cast<int>(fault)], 1) << ToString(fault);
  }
}

TEST(WireFaults, ARobotOfAnotherVersionIsNotDriven) {
  ServerOptions options;
  options.faults.share[static_cast<int>(WireFault::kVersion)] = 1.0;
  Cell cell(options);
  EXPECT_THROW(cell.Remote(), InputError);
}

TEST(WireFaults, NamesAndNumbersAreChecked) {
  EXPECT_EQ(ParseOrderedFaults("latency=2,drop=0.5").latency_s, 0.002);
  for (const char* bad : {"drops=1", "drop", "drop=2", "drop=x", "latency=-1", "slowed=0", "=1"}) {
    EXPECT_THROW(ParseOrderedFaults(bad), InputError) << bad;
  }
}

/// Frames that a fuzz test sends: FEELER_WIRE_FRAMES, or few.
int Frames() {
  const char* wanted = std::getenv("FEELER_WIRE_FRAMES");
  return wanted != nullptr ? std::max(1, std::atoi(wanted)) : 1200;
}

/// Changes, drops, doubles or adds a few bytes.
std::string Mutated(std::string line, std::mt19937& random) {
  for (unsigned n = 1 + random() % 3; n > 0 && !line.empty(); --n) {
    const std::size_t at = random() % line.size();
    switch (random() % 4) {
      case 0: line[at] = static_cast<char>(random() % 256); break;
      case 1: line.erase(at, 1 + random() % 8); break;
      case 2: line.insert(at, line.substr(at, 1 + random() % 8)); break;
      default: line[at] = "0123456789-eE+.,\"{}[]"[random() % 21]; break;
    }
  }
  return line;
}

TEST(WireFuzz, NoFrameMovesARobot) {
  const std::vector<std::string> seeds = {
      Hello(),  Line(1, StartRequest{}),    Line(1, Down()),           Line(2, Down()), "(1,0,1,0)",
      "(11,1)", "(7,1,0,0,-1,0.01,0.05,5)", "(7,2,0,0,-1,0.01,0.05,5)"};
  Cell cell;
  std::mt19937 random(5);
  constexpr int kFramesASession = 20;
  for (int session = 0; session < Frames() / kFramesASession; ++session) {
    cell.AwaitServed(session);
    Connection connection = cell.Dial();
    if (session % 2 == 0) connection.Write(Hello() + "\n");
    // Starts are left out: without one every motion is refused, however sound the frame.
    for (int i = 0; i < kFramesASession; ++i) {
      std::string line = seeds[random() % seeds.size()];
      if (line.find("start") != std::string::npos || line == "(11,1)") continue;
      if (random() % 3 == 0) line = Mutated(line, random);
      connection.Write(line + (random() % 10 == 0 ? "" : "\n"));
    }
  }
  cell.Stop();
  EXPECT_EQ(cell.robot.moved_steps, 0);
}

/// The robot's side of a session that says nonsense now and then. Returns how many frames it said; `after`: requests
/// that came after it had said what is no sound reply.
int TalkNonsense(Connection connection, std::mt19937& random, int& after) {
  std::string line;
  if (connection.ReadLine(line, 5.0) != LineStatus::kLine) return 0;
  WelcomeReply welcome;
  welcome.lockstep = true;
  welcome.simulated = true;
  welcome.capabilities.motions = {"transfer", "linear", "guarded", "compliant"};
  int said = 0;
  bool unsound = false;
  const auto say = [&](std::uint64_t seq, const Reply& reply) {
    std::string text = EncodeReply(WireForm::kJson, seq, reply);
    if (random() % 4 == 0) text = Mutated(text, random);
    try {
      DecodeReply(WireForm::kJson, text);
    } catch (const InputError&) {
      unsound = true;
    }
    connection.Write(text + "\n");
    ++said;
  };
  say(0, welcome);
  while (connection.ReadLine(line, 5.0) == LineStatus::kLine) {
    if (unsound) ++after;
    const Framed<Request> request = DecodeRequest(WireForm::kJson, line);
    if (random() % 4 == 0) say(0, StateReply{});
    if (IsMotion(request.body)) {
      say(request.seq, ResultReply{});
    } else {
      say(request.seq, StateReply{});
    }
  }
  return said;
}

TEST(WireFuzz, AnExecutorThatHeardNonsenseAsksForNoMotion) {
  Listener listener("--listen", {"127.0.0.1", 0});
  const int wanted = Frames();
  std::atomic<int> said{0};
  int after = 0;
  std::jthread robot([&] {
    std::mt19937 random(11);
    while (said < wanted) {
      if (auto connection = listener.Accept(0.02)) said += TalkNonsense(std::move(*connection), random, after);
    }
  });
  int sessions = 0;
  int lost = 0;
  while (said < wanted) {
    ++sessions;
    try {
      RemoteRobot remote(Connect({"127.0.0.1", listener.port()}, 5.0), {});
      remote.Start();
      for (int i = 0; i < 40 && remote.lost().empty(); ++i) {
        remote.Guarded(Down(0.0));
        if (i % 3 == 0) remote.ZeroWrench();
      }
      if (!remote.lost().empty()) ++lost;
    } catch (const InputError&) {
      ++lost;
    } catch (const WorldError&) {
      ++lost;
    }
  }
  robot.join();
  EXPECT_EQ(after, 0);
  EXPECT_GT(lost, sessions / 2) << "the nonsense is heard";
}

}  // namespace
}  // namespace feeler::execution
