// Laws of the lattice problem file:
// - parse(format(data)) = data, numbers bit for bit;
// - every kind of bad input is one InputError of one line that names the file and the field;
// - mutated files parse to data that keeps the stated bounds or raise InputError, never anything else.
#include "feeler/policies/io/lattice_problem_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/policies/io/json_input.h"
#include "tests/policies/random_policy.h"

namespace feeler::policies {
namespace {

using nlohmann::json;
using planner::LatticeProblemData;

json Sample() {
  return json::parse(R"({"name":"sample","size":[5,4,3],"start":[0,0,2],"tool":[[0,0,0],[0,0,1]],
    "target":[[2,1,0],[2,2,0]],"hypotheses":[[0,0,0,1],[1,0,0,0.5],[0,1,0,0.25]],"move_lengths":[1,2,4],
    "cost":{"per_cell":1,"per_contact":0.5,"per_action":0.125}})");
}

/// The message of the InputError that parsing must raise.
std::string ErrorOf(const std::string& text) {
  try {
    ParseLatticeProblem(text, "file.json");
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "accepted: " << text.substr(0, 400);
  return "";
}

void ExpectSame(const LatticeProblemData& a, const LatticeProblemData& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.start, b.start);
  EXPECT_EQ(a.tool, b.tool);
  EXPECT_EQ(a.target, b.target);
  EXPECT_EQ(a.move_lengths, b.move_lengths);
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.goal, b.goal);
  EXPECT_EQ(a.insertable_spread, b.insertable_spread);
  EXPECT_EQ(a.noise, b.noise);
  ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
  for (std::size_t i = 0; i < a.hypotheses.size(); ++i) {
    EXPECT_EQ(a.hypotheses[i].offset, b.hypotheses[i].offset);
    EXPECT_TRUE(SameBits(a.hypotheses[i].weight, b.hypotheses[i].weight));
  }
}

TEST(LatticeProblemFile, ReadsEveryField) {
  const LatticeProblemData data = ParseLatticeProblem(Sample().dump(), "file.json");
  EXPECT_EQ(data.name, "sample");
  EXPECT_EQ(data.size, Cell(5, 4, 3));
  EXPECT_EQ(data.start, Cell(0, 0, 2));
  EXPECT_EQ(data.tool, (std::vector<Cell>{{0, 0, 0}, {0, 0, 1}}));
  EXPECT_EQ(data.target, (std::vector<Cell>{{2, 1, 0}, {2, 2, 0}}));
  ASSERT_EQ(data.hypotheses.size(), 3U);
  EXPECT_EQ(data.hypotheses[2].offset, Cell(0, 1, 0));
  EXPECT_EQ(data.hypotheses[2].weight, 0.25);
  EXPECT_EQ(data.move_lengths, (std::vector<int>{1, 2, 4}));
  EXPECT_EQ(data.cost, (CostWeights{1.0, 0.5, 0.125}));
  EXPECT_EQ(data.goal, GoalKind::kSingleton);
}

TEST(LatticeProblemFile, RoundTrips) {
  for (std::uint64_t episode = 0; episode < 50; ++episode) {
    RandomStream random(1, episode, "lattice problem");
    LatticeProblemData data = ParseLatticeProblem(Sample().dump(), "file.json");
    for (planner::Hypothesis& h : data.hypotheses) h.weight = std::exp(random.Uniform(-30.0, 30.0));
    data.cost = {random.Uniform(), random.Uniform(), random.Uniform()};
    data.name = "quote \" and \n and \xC3\xA9";
    if (episode % 2 == 1) data.goal = GoalKind::kInsertable, data.insertable_spread = Cell(1, 0, 2);
    if (episode % 3 == 1) data.noise = {random.Uniform(0.0, 0.5), random.Uniform(0.0, 0.5), random.Uniform(0.0, 0.5)};
    const std::string text = FormatLatticeProblem(data);
    ExpectSame(ParseLatticeProblem(text, "file.json"), data);
    EXPECT_EQ(FormatLatticeProblem(ParseLatticeProblem(text, "file.json")), text);
  }
}

TEST(LatticeProblemFile, SampleFilesAreWellFormed) {
  for (const std::string name : {"slot2d", "lshape2d", "pocket3d", "block36", "block64", "block125", "unlocalizable",
                                 "weighted2d", "insertable2d"}) {
    const LatticeProblemData data = ReadLatticeProblem(FEELER_SOURCE_DIR "/tests/data/" + name + ".json");
    EXPECT_EQ(data.name, name);
    ExpectSame(ParseLatticeProblem(FormatLatticeProblem(data), "again"), data);
  }
}

TEST(LatticeProblemFile, BadInputNamesTheField) {
  struct Case {
    std::function<void(json&)> breaks;
    std::string place, what;
  };
  const std::vector<Case> cases = {
      {[](json& j) { j["size"][0] = -5; }, "file.json, size[0]: ", "is -5"},
      {[](json& j) {
         j["noise"] = {{"false_stop", 1.0}};
       },
       "file.json, noise: ", "false_stop is 1"},
      {[](json& j) {
         j["noise"] = {{"slip", -0.1}};
       },
       "file.json, noise.slip: ", "-0.1"},
      {[](json& j) {
         j["noise"] = {{"drift", 0.1}};
       },
       "file.json, noise", "drift"},
      {[](json& j) {
         j["noise"] = {{"missed_contact", 0.7}, {"false_stop", 0.4}};
       },
       "file.json, noise: ", "information"},
      {[](json& j) { j["size"][2] = 0; }, "file.json, size[2]: ", "is 0"},
      {[](json& j) {
         j["size"] = {1000, 1000, 1000};
       },
       "file.json, size: ", "displacements"},
      {[](json& j) {
         j["size"] = {1000000000, 1, 1};
       },
       "file.json, size[0]: ", "is 1000000000"},
      {[](json& j) {
         j["size"] = {5, 4};
       },
       "file.json, size: ", "has 2 elements, not 3"},
      {[](json& j) { j["size"] = "large"; }, "file.json, size: ", "not a list"},
      {[](json& j) {
         j["start"] = {5, 0, 0};
       },
       "file.json, start[0]: ", "outside"},
      {[](json& j) { j["start"][1] = -1; }, "file.json, start[1]: ", "is -1"},
      {[](json& j) {
         j["start"] = {2, 1, 0};
       },
       "file.json, start: ", "is blocked"},
      {[](json& j) {
         j["start"] = {3, 2, 0};
       },
       "file.json, start: ", "hypotheses[1]"},
      {[](json& j) { j["start"][0] = 1.5; }, "file.json, start[0]: ", "not a whole number"},
      {[](json& j) { j["start"][0] = 1.0; }, "file.json, start[0]: ", "not a whole number"},
      {[](json& j) { j["start"][0] = true; }, "file.json, start[0]: ", "not a whole number"},
      {[](json& j) { j["start"][0] = std::uint64_t{18446744073709551615U}; }, "file.json, start[0]: ", "not in"},
      {[](json& j) { j["start"][0] = std::int64_t{4294967296}; }, "file.json, start[0]: ", "not in"},
      {[](json& j) { j["tool"] = json::array(); }, "file.json, tool: ", "at least 1"},
      {[](json& j) { j["target"] = json::array(); }, "file.json, target: ", "at least 1"},
      {[](json& j) {
         j["target"][1] = {1, 2, 3, 4};
       },
       "file.json, target[1]: ", "has 4 elements, not 3"},
      {[](json& j) { j["tool"][0][2] = nullptr; }, "file.json, tool[0][2]: ", "not a whole number"},
      {[](json& j) { j["tool"][0][2] = 1000000; }, "file.json, tool[0][2]: ", "not in"},
      {[](json& j) { j["hypotheses"] = json::array(); }, "file.json, hypotheses: ", "at least 1"},
      {[](json& j) {
         j["hypotheses"][1] = {0, 0, 0, 2};
       },
       "file.json, hypotheses[1]: ", "the same hypothesis as"},
      {[](json& j) {
         j["hypotheses"][1] = {1, 0, 0};
       },
       "file.json, hypotheses[1]: ", "has 3 elements, not 4"},
      {[](json& j) { j["hypotheses"][2][3] = 0; }, "file.json, hypotheses[2][3]: ", "is 0"},
      {[](json& j) { j["hypotheses"][2][3] = -1.5; }, "file.json, hypotheses[2][3]: ", "is -1.5"},
      {[](json& j) { j["hypotheses"][2][3] = "NaN"; }, "file.json, hypotheses[2][3]: ", "not a number"},
      {[](json& j) { j["hypotheses"][2][3] = nullptr; }, "file.json, hypotheses[2][3]: ", "not a number"},
      {[](json& j) { j["move_lengths"] = json::array(); }, "file.json, move_lengths: ", "at least 1"},
      {[](json& j) {
         j["move_lengths"] = {1, 0};
       },
       "file.json, move_lengths[1]: ", "is 0"},
      {[](json& j) {
         j["move_lengths"] = {2, 2};
       },
       "file.json, move_lengths[1]: ", "not greater"},
      {[](json& j) { j["cost"]["per_cell"] = -1; }, "file.json, cost.per_cell: ", "is -1"},
      {[](json& j) {
         j["cost"] = {{"per_cell", 0}};
       },
       "file.json, cost: ", "free"},
      {[](json& j) { j["cost"]["per_mile"] = 1; }, "file.json, cost: ", "unknown key \"per_mile\""},
      {[](json& j) { j["colour"] = 1; }, "file.json: ", "unknown key \"colour\""},
      {[](json& j) { j.erase("tool"); }, "file.json: ", "\"tool\" is missing"},
      {[](json& j) { j["name"] = 7; }, "file.json, name: ", "not a text"},
      {[](json& j) { j["goal"] = "win"; }, "file.json, goal: ", "neither"},
      {[](json& j) {
         j["insertable_spread"] = {1, 1, 1};
       },
       "file.json, insertable_spread: ", "no meaning"},
      {[](json& j) { j = json::array(); }, "file.json: ", "not an object"},
      {[](json& j) { j = 5; }, "file.json: ", "not an object"},
  };
  for (const Case& c : cases) {
    json broken = Sample();
    c.breaks(broken);
    const std::string message = ErrorOf(broken.dump());
    EXPECT_EQ(message.rfind(c.place, 0), 0U) << message;
    EXPECT_NE(message.find(c.what), std::string::npos) << message << " lacks " << c.what;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

TEST(LatticeProblemFile, RefusesTextThatIsNotJson) {
  const std::string whole = Sample().dump();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_NE(ErrorOf(whole.substr(0, length)).find("not valid JSON"), std::string::npos);
  }
  for (const std::string number : {"NaN", "Infinity", "1e999", "01", "+1", "0x10"}) {
    std::string text = whole;
    text.replace(text.find("0.25"), 4, number);
    EXPECT_NE(ErrorOf(text).find("not valid JSON"), std::string::npos) << number;
  }
  EXPECT_NE(ErrorOf("{\"name\":1,\"name\":2}").find("twice"), std::string::npos);
  EXPECT_NE(ErrorOf(std::string(5'000'000, '[')).find("nested"), std::string::npos);
  EXPECT_NE(ErrorOf("\xFF\xFE{}").find("not valid JSON"), std::string::npos);
  EXPECT_NE(ErrorOf(std::string("{\"a\0b\":1}", 9)).find("not valid JSON"), std::string::npos);
}

TEST(LatticeProblemFile, ReportsUnreadableFiles) {
  EXPECT_THROW(ReadLatticeProblem("/nonexistent/file.json"), InputError);
  EXPECT_THROW(ReadLatticeProblem("/tmp"), InputError);
  EXPECT_THROW(ReadTextFile("/dev/zero", 1 << 20), InputError);
  EXPECT_THROW(WriteFileAtomically("/nonexistent/file.json", "text"), InputError);
  EXPECT_THROW(WriteFileAtomically("/tmp", "text"), InputError);
}

TEST(LatticeProblemFile, SurvivesTwentyThousandMutations) {
  const std::string whole = Sample().dump();
  int accepted = 0;
  for (std::uint64_t episode = 0; episode < 22000; ++episode) {
    RandomStream random(2, episode, "mutation");
    const std::string text = Mutate(whole, random);
    try {
      const LatticeProblemData data = ParseLatticeProblem(text, "file.json");
      ASSERT_TRUE((data.start.array() < data.size.array()).all() && (data.start.array() >= 0).all());
      ASSERT_FALSE(data.hypotheses.empty() || data.tool.empty() || data.target.empty());
      for (const planner::Hypothesis& h : data.hypotheses) ASSERT_TRUE(h.weight > 0.0 && std::isfinite(h.weight));
      ++accepted;
    } catch (const InputError& error) {
      ASSERT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(accepted, 100);
}

}  // namespace
}  // namespace feeler::policies
