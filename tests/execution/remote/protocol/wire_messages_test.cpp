// Laws: a message that is encoded and decoded is the same, bit for bit in the JSON form and to 1e-9 in the numbers-only
// form; every message of ours is one that the schema takes; whatever else comes is refused with InputError and nothing
// else, in both forms and at both ends.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/execution/remote/protocol/messages.h"
#include "feeler/execution/remote/protocol/schema.h"

namespace feeler::execution {
namespace {

Pose SomePose() {
  return MakePose(Eigen::Vector3d(0.1 + 1e-17, -0.7 / 3.0, 1.0 / 7.0), Eigen::Quaterniond(0.3, -0.1, 0.7, 0.2));
}

RobotState SomeState() {
  RobotState state;
  state.time_s = 1.0 / 3.0;
  state.world_T_tool = SomePose();
  state.wrench = {Eigen::Vector3d(0.1, 0.2, -1.0 / 3.0), Eigen::Vector3d(1e-3, 0.0, -2e-3)};
  state.mode = RobotMode::kMoving;
  state.joints_rad = {0.1, -1.0 / 3.0, 2.0, 0.0, -1.5, 3.0};
  return state;
}

std::vector<Request> SomeRequests() {
  CompliantMotion compliant;
  compliant.world_T_tool = {SomePose(), SomePose()};
  TwistMotion twist;
  twist.tool_T_frame = SomePose();
  twist.duration_s = 0.1;
  return {HelloRequest{kProtocolVersion, std::string(kProtocolUnits), "test", "123"},
          StateRequest{},
          ZeroRequest{},
          ContactRequest{Eigen::Vector3d(0.6, 0.0, -0.8)},
          TransferRequest{SomePose()},
          LinearRequest{SomePose(), 0.25, 5.0},
          GuardedMotion{Eigen::Vector3d(0.6, 0.0, -0.8), 1.0 / 3.0, 0.05, 5.0},
          compliant,
          twist,
          LookRequest{},
          StopRequest{},
          StartRequest{},
          RecoverRequest{},
          HeartbeatRequest{},
          ByeRequest{},
          EpisodeRequest{7, {}},
          EpisodeRequest{},
          EpisodeRequest{7, {5, 4, 3}},
          EpisodeRequest{{}, {5, 4, 3, 2, 6}},
          VerdictRequest{}};
}

std::vector<Reply> SomeReplies() {
  WelcomeReply welcome;
  welcome.robot = "a \"robot\"";
  welcome.capabilities.motions = {"transfer", "guarded"};
  welcome.capabilities.arm = "ur10e";
  welcome.state = SomeState();
  ResultReply result;
  result.result = {StopReason::kContact, 1.0 / 3.0, true, 5.5, SomePose(), ""};
  result.state = SomeState();
  PictureReply picture;
  picture.view.width = 2;
  picture.view.height = 1;
  picture.view.rgb = {1, 2, 3, 250, 251, 252};
  EpisodeReply episode;
  episode.seed = std::numeric_limits<std::uint64_t>::max();
  episode.task = "plug";
  episode.extents = {7, 6, 5};
  episode.world_T_estimate = SomePose();
  episode.state = SomeState();
  VerdictReply verdict;
  verdict.world_T_true = SomePose();
  verdict.reason = "too shallow";
  verdict.replay = {{"period_s", 0.05}};
  ContactReply contact;
  contact.push_n = 12.5;
  return {welcome, StateReply{SomeState()}, result, ContactReply{}, contact, picture, episode,
          verdict, ErrorReply{"busy", "x"}};
}

bool HasNumbers(const Request& r) {
  return !std::holds_alternative<TwistMotion>(r) && !std::holds_alternative<LookRequest>(r) &&
         !std::holds_alternative<EpisodeRequest>(r) && !std::holds_alternative<VerdictRequest>(r);
}
bool HasNumbers(const Reply& r) {
  return !std::holds_alternative<PictureReply>(r) && !std::holds_alternative<EpisodeReply>(r) &&
         !std::holds_alternative<VerdictReply>(r);
}

TEST(WireMessages, JsonKeepsEveryBit) {
  std::uint64_t seq = 1;
  for (const Request& request : SomeRequests()) {
    const std::string line = EncodeRequest(WireForm::kJson, ++seq, request);
    const Framed<Request> back = DecodeRequest(WireForm::kJson, line);
    EXPECT_EQ(back.seq, seq);
    EXPECT_EQ(back.body.index(), request.index());
    EXPECT_EQ(EncodeRequest(WireForm::kJson, seq, back.body), line);
    EXPECT_EQ(FaultAgainstSchema("request_" + std::string(NameOf(request)), nlohmann::json::parse(line)), "");
  }
  for (const Reply& reply : SomeReplies()) {
    const std::string line = EncodeReply(WireForm::kJson, ++seq, reply);
    const Framed<Reply> back = DecodeReply(WireForm::kJson, line);
    EXPECT_EQ(back.body.index(), reply.index());
    EXPECT_EQ(EncodeReply(WireForm::kJson, seq, back.body), line);
  }
  const auto guarded = std::get<GuardedMotion>(
      DecodeRequest(WireForm::kJson, EncodeRequest(WireForm::kJson, 1, SomeRequests()[6])).body);
  EXPECT_EQ(guarded.distance_m, 1.0 / 3.0);
  const auto linear = std::get<LinearRequest>(
      DecodeRequest(WireForm::kJson, EncodeRequest(WireForm::kJson, 1, SomeRequests()[5])).body);
  EXPECT_EQ(linear.world_T_tool.matrix(), SomePose().matrix());
}

TEST(WireMessages, NumbersKeepANanometre) {
  std::uint64_t seq = 1;
  for (const Request& request : SomeRequests()) {
    if (!HasNumbers(request)) {
      EXPECT_THROW(EncodeRequest(WireForm::kNumbers, 1, request), InputError);
      continue;
    }
    const std::string line = EncodeRequest(WireForm::kNumbers, ++seq, request);
    EXPECT_LE(std::count(line.begin(), line.end(), ','), 29) << "a script reads at most 30 numbers: " << line;
    const Framed<Request> back = DecodeRequest(WireForm::kNumbers, line);
    EXPECT_EQ(back.seq, seq);
    EXPECT_EQ(back.body.index(), request.index());
  }
  for (const Reply& reply : SomeReplies()) {
    if (!HasNumbers(reply)) {
      EXPECT_THROW(EncodeReply(WireForm::kNumbers, 1, reply), InputError);
      continue;
    }
    const Framed<Reply> back = DecodeReply(WireForm::kNumbers, EncodeReply(WireForm::kNumbers, ++seq, reply));
    EXPECT_EQ(back.body.index(), reply.index());
    if (const auto* state = std::get_if<StateReply>(&back.body)) {
      ASSERT_EQ(state->state.joints_rad.size(), SomeState().joints_rad.size());
      EXPECT_NEAR(state->state.joints_rad[1], SomeState().joints_rad[1], 1e-9);
    }
  }
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
    if (i == 0) q = Eigen::Quaterniond::Identity();
    if (i == 1) q = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY());
    const Pose pose = MakePose(Eigen::Vector3d(normal(random), normal(random), normal(random)), q);
    const auto back = std::get<TransferRequest>(
        DecodeRequest(WireForm::kNumbers, EncodeRequest(WireForm::kNumbers, 1, TransferRequest{pose})).body);
    EXPECT_LT((back.world_T_tool.matrix() - pose.matrix()).cwiseAbs().maxCoeff(), 1e-8) << i;
  }
}

TEST(WireMessages, WhatIsNotSoundIsRefused) {
  const std::vector<std::string> bad = {
      "",
      "{}",
      "[]",
      "null",
      "{\"type\":7}",
      "{\"type\":\"guarded\",\"seq\":1}",
      R"({"type":"state","seq":-1})",
      R"({"type":"state","seq":1.5})",
      R"({"type":"state","seq":1,"more":1})",
      R"({"type":"state","seq":1,"seq":2})",
      R"({"type":"nothing","seq":1})",
      R"({"type":"guarded","seq":1,"direction":[0,0,-2],"distance_m":0.1,"speed_m_s":0.05,"contact_force_n":5})",
      R"({"type":"guarded","seq":1,"direction":[0,0,-0.5],"distance_m":0.1,"speed_m_s":0.05,"contact_force_n":5})",
      R"({"type":"guarded","seq":1,"direction":[0,0,-1],"distance_m":-0.1,"speed_m_s":0.05,"contact_force_n":5})",
      R"({"type":"guarded","seq":1,"direction":[0,0,-1],"distance_m":1e999,"speed_m_s":0.05,"contact_force_n":5})",
      R"({"type":"guarded","seq":1,"direction":[0,0,-1],"distance_m":0.1,"speed_m_s":0,"contact_force_n":5})",
      R"({"type":"transfer","seq":1,"pose":[1,0,0,0, 0,1,0,0, 0,0,2,0]})",
      R"({"type":"transfer","seq":1,"pose":[1,0,0,0, 0,1,0,0, 0,0,-1,0]})",
      R"({"type":"transfer","seq":1,"pose":[1,0,0,0, 0,1,0,0, 0,0,1]})",
      R"({"type":"compliant","seq":1,"poses":[],"speed_m_s":1,"force_limit_n":1,"time_limit_s":1,"stiffness_n_m":[1,1,1],"rotational_stiffness_nm_rad":1})",
      std::string(100000, '['),
      std::string("{\"type\":\"state\",\"seq\":1}\0x", 25)};
  for (const std::string& line : bad) {
    EXPECT_THROW(DecodeRequest(WireForm::kJson, line), InputError) << line.substr(0, 100);
    EXPECT_THROW(DecodeReply(WireForm::kJson, line), InputError) << line.substr(0, 100);
  }
  for (const std::string line : {"",
                                 "()",
                                 "(1)",
                                 "(2)",
                                 "(2,-1)",
                                 "(2,1",
                                 "2,1)",
                                 "(2,1,1)",
                                 "(2,nan)",
                                 "(2,inf)",
                                 "(2,1e300)",
                                 "(99,1)",
                                 "(7,1,0,0,-1,0.1,0.05)",
                                 "(7,1,0,0,-2,0.1,0.05,5)",
                                 "(7,1,0,0,-1,0.1,-0.05,5)",
                                 "(8,1,0.1,5,5,1,1,1,1,0)",
                                 "(2,1,)",
                                 "(2,,1)",
                                 "(2.5,1)",
                                 "((2,1))"}) {
    EXPECT_THROW(DecodeRequest(WireForm::kNumbers, line), InputError) << line;
    EXPECT_THROW(DecodeReply(WireForm::kNumbers, line), InputError) << line;
  }
}

TEST(WireMessages, NotANumberIsNoReply) {
  ResultReply result;
  result.state = SomeState();
  result.result.world_T_tool.translation().x() = std::nan("");
  EXPECT_THROW(DecodeReply(WireForm::kJson, EncodeReply(WireForm::kJson, 1, result)), InputError);
}

/// Flips, cuts, repeats and joins pieces of sound frames.
std::string Mutated(const std::vector<std::string>& seeds, std::mt19937& random) {
  std::string text = seeds[random() % seeds.size()];
  for (unsigned i = 0; i <= random() % 4; ++i) {
    const std::size_t at = text.empty() ? 0 : random() % text.size();
    switch (random() % 6) {
      case 0:
        if (!text.empty()) text[at] = static_cast<char>(random() % 256);
        break;
      case 1: text.erase(at, 1 + random() % 8); break;
      case 2: text.insert(at, 1, "{}[](),:\"0-.eE9n"[random() % 16]); break;
      case 3: text = text.substr(0, at); break;
      case 4: {
        const std::string& other = seeds[random() % seeds.size()];
        text = text.substr(0, at) + other.substr(random() % (other.size() + 1));
        break;
      }
      default: text.insert(at, text.substr(at, 1 + random() % 12)); break;
    }
  }
  return text;
}

TEST(WireFuzz, FramesAreReadOrRefused) {
  std::vector<std::string> seeds;
  for (const Request& r : SomeRequests()) {
    seeds.push_back(EncodeRequest(WireForm::kJson, 3, r));
    if (HasNumbers(r)) seeds.push_back(EncodeRequest(WireForm::kNumbers, 3, r));
  }
  for (const Reply& r : SomeReplies()) {
    seeds.push_back(EncodeReply(WireForm::kJson, 3, r));
    if (HasNumbers(r)) seeds.push_back(EncodeReply(WireForm::kNumbers, 3, r));
  }
  const char* wanted = std::getenv("FEELER_WIRE_FRAMES");  // the long form: 100000 at each end, under sanitizers
  const int frames = wanted != nullptr ? std::atoi(wanted) : 4000;
  std::mt19937 random(11);
  int read = 0;
  for (int i = 0; i < frames; ++i) {
    const std::string line = Mutated(seeds, random);
    for (const WireForm form : {WireForm::kJson, WireForm::kNumbers}) {
      try {
        DecodeRequest(form, line);
        ++read;
      } catch (const InputError&) {
      }
      try {
        DecodeReply(form, line);
        ++read;
      } catch (const InputError&) {
      }
    }
  }
  EXPECT_GT(read, frames / 100);
  EXPECT_LT(read, 2 * frames);
}

}  // namespace
}  // namespace feeler::execution
