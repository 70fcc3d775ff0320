// Laws of the reader of Cassandra's format:
// - every form of the grammar (entries, rows, matrices, wildcards, identity, uniform, reset, start in its five forms,
//   rewards in their four, costs) gives the tables that a hand has worked out;
// - later statements override earlier ones; a file without observations is an MDP;
// - what it writes reads back to the same model;
// - every malformed file is one InputError that names the line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "feeler/core/error.h"
#include "tests/planner/pomdp/small_models.h"

namespace feeler::planner {
namespace {

using Row = std::map<std::uint32_t, double>;

const std::string kHead = "discount: 0.9\nvalues: reward\nstates: a b c\nactions: go stay\nobservations: x y\n";
const std::string kTables = "T: * identity\nO: * uniform\n";

Pomdp Parse(const std::string& text) { return ParseCassandraPomdp(text, "file"); }
Row Start(const std::string& start) { return AsMap(Parse(kHead + start + "\n" + kTables).start); }

std::string ErrorOf(const std::string& text) {
  try {
    Parse(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(CassandraParser, Transitions) {
  const Pomdp p = Parse(kHead +
                        "start: b\n"
                        "T: *\nuniform\n"                         // overridden below
                        "T: go : a\n0.5 0.25 0.25\n"              // a row
                        "T: go : b : * 0.0\nT: go : b : c 1.0\n"  // a wildcard cleared, then an entry
                        "T: go : c reset\n"
                        "T: 1\n1 0 0\n0.0 0.5 0.5\n0 0 1.0\n"  // a matrix, the action by number
                        "T: stay : 2 : a 0.5\nT: stay : c : c 0.5\n"
                        "O: * uniform\n");
  EXPECT_EQ(AsMap(p.transitions.Row(p.At(0, 0))), (Row{{0, 0.5}, {1, 0.25}, {2, 0.25}}));
  EXPECT_EQ(AsMap(p.transitions.Row(p.At(0, 1))), (Row{{2, 1.0}}));
  EXPECT_EQ(AsMap(p.transitions.Row(p.At(0, 2))), (Row{{1, 1.0}}));
  EXPECT_EQ(AsMap(p.transitions.Row(p.At(1, 0))), (Row{{0, 1.0}}));
  EXPECT_EQ(AsMap(p.transitions.Row(p.At(1, 1))), (Row{{1, 0.5}, {2, 0.5}}));
  EXPECT_EQ(AsMap(p.transitions.Row(p.At(1, 2))), (Row{{0, 0.5}, {2, 0.5}}));
}

TEST(CassandraParser, Observations) {
  const Pomdp p =
      Parse(kHead +
            "T: * identity\nO: * uniform\nO: go\n1 0\n0 1\n0.3 0.7\nO: stay : a\n0.1 0.9\nO: * : b : x 0.25\n"
            "O: * : b : y 0.75\n");
  EXPECT_EQ(AsMap(p.observation_rows.Row(p.At(0, 0))), (Row{{0, 1.0}}));
  EXPECT_EQ(AsMap(p.observation_rows.Row(p.At(0, 1))), (Row{{0, 0.25}, {1, 0.75}}));
  EXPECT_EQ(AsMap(p.observation_rows.Row(p.At(0, 2))), (Row{{0, 0.3}, {1, 0.7}}));
  EXPECT_EQ(AsMap(p.observation_rows.Row(p.At(1, 0))), (Row{{0, 0.1}, {1, 0.9}}));
  EXPECT_EQ(AsMap(p.observation_rows.Row(p.At(1, 2))), (Row{{0, 0.5}, {1, 0.5}}));
}

TEST(CassandraParser, RewardsInTheirFourFormsAndWhatOverridesWhat) {
  const std::string tables = "T: * : * uniform\nO: * uniform\n";
  // R(a, s) = sum over three states and two observations, each with probability 1/6.
  const Pomdp p = Parse(kHead + tables +
                        "R: * : * : * : * 6\n"
                        "R: go : a : b : y 12\n"          // an entry
                        "R: go : b : c\n0 18\n"           // a row over observations
                        "R: go : c\n1 2\n3 4\n5 6\n"      // a matrix, states on arrival by observations
                        "R: stay\n1 2 3\n4 5 6\n7 8 9\n"  // a matrix of an MDP, states by states
                        "R: stay : c : a : * 1\n");
  EXPECT_DOUBLE_EQ(p.reward[p.At(0, 0)], (5 * 6.0 + 12.0) / 6.0);
  EXPECT_DOUBLE_EQ(p.reward[p.At(0, 1)], (4 * 6.0 + 18.0) / 6.0);
  EXPECT_DOUBLE_EQ(p.reward[p.At(0, 2)], 21.0 / 6.0);
  EXPECT_DOUBLE_EQ(p.reward[p.At(1, 0)], 2.0);
  EXPECT_DOUBLE_EQ(p.reward[p.At(1, 1)], 5.0);
  EXPECT_DOUBLE_EQ(p.reward[p.At(1, 2)], (1.0 + 8.0 + 9.0) / 3.0);
}

TEST(CassandraParser, CostsAreNegatedRewards) {
  std::string head = kHead;
  head.replace(head.find("reward"), 6, "cost");
  const Pomdp p = Parse(head + kTables + "R: go : * : * : * 3.5e0\nR: stay : * : * : * -1\n");
  EXPECT_TRUE(p.values_are_costs);
  EXPECT_DOUBLE_EQ(p.reward[p.At(0, 1)], -3.5);
  EXPECT_DOUBLE_EQ(p.reward[p.At(1, 1)], 1.0);
}

TEST(CassandraParser, StartInItsForms) {
  EXPECT_EQ(Start(""), (Row{{0, 1.0 / 3}, {1, 1.0 / 3}, {2, 1.0 / 3}}));
  EXPECT_EQ(Start("start: uniform"), (Row{{0, 1.0 / 3}, {1, 1.0 / 3}, {2, 1.0 / 3}}));
  EXPECT_EQ(Start("start: 0.5 0.0 +0.5"), (Row{{0, 0.5}, {2, 0.5}}));
  EXPECT_EQ(Start("start: 1 0 0"), (Row{{0, 1.0}}));
  EXPECT_EQ(Start("start: c"), (Row{{2, 1.0}}));
  EXPECT_EQ(Start("start: 1"), (Row{{1, 1.0}}));
  EXPECT_EQ(Start("start include: a 2"), (Row{{0, 0.5}, {2, 0.5}}));
  EXPECT_EQ(Start("start exclude: b"), (Row{{0, 0.5}, {2, 0.5}}));
}

TEST(CassandraParser, WithoutObservationsTheStateIsObserved) {
  const Pomdp p = Parse("discount: 0.9\nvalues: reward\nstates: 3\nactions: 1\nT: 0 uniform\n");
  EXPECT_EQ(p.observations, (std::vector<std::string>{"0", "1", "2"}));
  EXPECT_EQ(AsMap(p.observation_rows.Row(1)), (Row{{1, 1.0}}));
}

TEST(CassandraParser, OneRewardInDetailCostsLittle) {
  // 1000 x 1000 x 500 rewards, if all were asked for one by one.
  const std::string head = "discount: 0.9\nvalues: reward\nstates: 1000\nactions: 1\nobservations: 500\n";
  const Pomdp p = Parse(head + "T: * uniform\nO: * uniform\nR: 0 : 1 : * : * 3\nR: 0 : 2 : 5 : 7 500000\n");
  EXPECT_EQ(p.reward[1], 3.0);
  EXPECT_NEAR(p.reward[2], 1.0, 1e-12);
  EXPECT_EQ(p.reward[3], 0.0);
}

TEST(CassandraParser, RewardsOfAnMdp) {
  const std::string head = "discount: 0.9\nvalues: reward\nstates: 2\nactions: 2\nT: * uniform\n";
  const Pomdp p = Parse(head + "R: 0 : 0 : 0 1\nR: 0 : 0 : 1 2\nR: 0 : 1 : * 4\nR: 1 : 0\n6 8\nR: 1 : 1 : * : * 9\n");
  EXPECT_EQ(p.reward, (std::vector<double>{1.5, 4.0, 7.0, 9.0}));
  EXPECT_THAT(ErrorOf(head + "R: 0 : 0\n1\nR: 1 : 0 : 0 1\n"), testing::HasSubstr("1 of 2 numbers"));
}

TEST(CassandraParser, MarksAndNumbersOfOtherPrograms) {
  EXPECT_EQ(Parse("\xEF\xBB\xBF" + kHead + kTables).state_count(), 3U);
  EXPECT_EQ(AsMap(Parse(kHead + "start: 1.0 1e-400 0.0\n" + kTables).start), (Row{{0, 1.0}}));
  EXPECT_THAT(ErrorOf(kHead + kTables + "R: go : a : * : * 1e400\n"), testing::HasSubstr("file:8: \"1e400\""));
}

TEST(CassandraParser, WhatIsWrittenReadsBack) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Pomdp p = Parse(RandomModelText(seed, 4, 3, 3, 0.9));
    const Pomdp again = Parse(FormatCassandraPomdp(p));
    ASSERT_EQ(again.state_count(), p.state_count());
    for (std::size_t i = 0; i < p.reward.size(); ++i) {
      EXPECT_DOUBLE_EQ(again.reward[i], p.reward[i]);
      for (const auto& [rows, first] :
           {std::pair{&again.transitions, &p.transitions}, {&again.observation_rows, &p.observation_rows}}) {
        ASSERT_EQ(rows->Row(i).size(), first->Row(i).size());
        for (std::size_t k = 0; k < rows->Row(i).size(); ++k) {
          EXPECT_EQ(rows->Row(i)[k].index, first->Row(i)[k].index);
          EXPECT_NEAR(rows->Row(i)[k].value, first->Row(i)[k].value, 1e-15);
        }
      }
    }
  }
}

TEST(CassandraParser, MalformedFilesNameTheLine) {
  const std::pair<std::string, std::string> cases[] = {
      {kHead + "T: go : a\n0.5 0.2 0.2\n" + "T: go : b identity\n", "file:8: identity in a row"},
      {kHead + kTables + "T: go : a\n0.5 0.2 0.2\n", "file:9: T: go : a (state before): the probabilities sum to 0.9"},
      {kHead + "T: * identity\nO: * uniform\nO: stay : c : x 0.1\n",
       "file:8: O: stay : c (state on arrival): the probabilities sum to 0.6"},
      {kHead + "T: * identity\n",
       "file:6: O: go : a (state on arrival): the file gives no probabilities (give the row)"},
      {kHead + kTables + "R: go : a : * : * 1\nvalues: cost\n", "file:9: values: twice (first on line 2)"},
      {kHead + "discount: 0.8\n" + kTables, "file:6: discount: twice (first on line 1)"},
      {kHead + "start: a\nstart: b\n" + kTables, "file:7: start: twice (first on line 6)"},
      {kHead + "start: a\nstart include: b\n" + kTables, "file:7: start: twice (first on line 6)"},
      {"discount: 0.9\nstates: 2\nactions: 1\nT: 0 identity\nR: 0 : 0 : 0 1\nvalues: cost\n",
       "file:6: values: after rewards"},
      {"discount: 0.9\nstates: 2\nactions: 1\nT: 0 identity\nobservations: 2\n",
       "file:5: observations: after the tables"},
      {"discount: 0.9\nstates: -2\nactions: 1\n", "file:2: \"-2\" is no name of a state"},
      {kHead + "T: fly : a : b 1.0\n", "file:6: unknown action \"fly\""},
      {kHead + "T: go : z : b 1.0\n", "file:6: unknown state \"z\""},
      {kHead + "T: go : 7 : b 1.0\n", "file:6: state 7 of 3"},
      {kHead + "T: go : a : b 1.5\n", "file:6: 1.5 is no probability"},
      {kHead + "T: go : a : b oops\n", "file:6: \"oops\" where a probability should be"},
      {kHead + "O: go : a : z 1.0\n", "file:6: unknown observation \"z\""},
      {kHead + "start: *\n", "file:6: a wildcard where one state must be named"},
      {kHead + "start include: *\n", "file:6: a wildcard"},
      {kHead + "start: 0.5 0.4 0.0\n", "file:6: the probabilities of start sum to 0.9"},
      {kHead + "start: 0.5 0.5\n" + kTables, "2 of 3 numbers"},
      {kHead + "T: go\n1 0 0\n0 1 0\nT: stay\nidentity\n", "file:8: 0 of 3 numbers"},
      {kHead + "T: go : a\n1 0 0 0\n", "file:7: a statement should begin here"},
      {kHead + "O: go : a reset\n", "file:6: reset outside of transitions"},
      {kHead + "T: go : a reset\n", "file:6: reset, and no start"},
      {kHead + "R: go : a : b : x\n", "the file ends where a reward should be"},
      {"discount: 1.5\n", "file:1: discount 1.5 is not in (0, 1]"},
      {"discount: 0.9\nvalues: gain\n", "file:2: values must be reward or cost"},
      {"discount: 0.9\nstates: *\n", "file:2: \"*\" is no name of a state"},
      {"discount: 0.9\nstates: a a\n", "file:2: state \"a\" listed twice"},
      {"discount: 0.9\nstates: 1000000000\nactions: 2\nobservations: 2\n", "file:2: 1e+09 states"},
      {"discount: 0.9\nstates: 99999999999999999999999\n", "file:2: 1.845e+19 states"},
      {"discount: 0.9\nstates: 5000000\nactions: 10\nobservations: 2\nT: 0 identity\n", "file:5: 5e+06 states"},
      {"discount: 0.9\nstates: 100000\nactions: 2\nobservations: 2\nT: * uniform\n", "file:5: 1e+05 states"},
      {"discount: 0.9\nstates: 2\nT: 0 identity\n", "file:3: no actions"},
      {"states: 2\nactions: 1\nobservations: 1\nT: 0 identity\n", "file:4: no discount"},
      {"gibberish", "file:1: a statement should begin here"},
      {"", "no discount"},
  };
  for (const auto& [text, error] : cases) {
    EXPECT_THAT(ErrorOf(text), testing::HasSubstr(error)) << text;
    EXPECT_EQ(ErrorOf(text).find('\n'), std::string::npos);
  }
}

TEST(CassandraParser, DiscountOfOneNeedsGoalsAndCosts) {
  std::string head = kHead;
  head.replace(head.find("0.9"), 3, "1.0");
  EXPECT_THAT(ErrorOf(head + "T: * uniform\nO: * uniform\nR: * : * : * : * -1\n"),
              testing::HasSubstr("file:1: a discount of 1 without goals"));
  const std::string goal = "T: * : * : c 1.0\nO: * uniform\n";
  EXPECT_THAT(ErrorOf(head + goal + "R: go : a : * : * 1\nR: stay : a : * : * 2\nR: * : b : * : * 1\n"),
              testing::HasSubstr("file:8: a discount of 1 with rewards"));
  EXPECT_THAT(ErrorOf(head + goal + "R: go : a : * : * -1\nR: stay : a : * : * 1\n"),
              testing::HasSubstr("file:9: costs and rewards mixed"));
  EXPECT_EQ(ErrorOf(head + goal + "R: * : a : * : * -1\nR: * : b : * : * -1\n"), "no error");
}

TEST(CassandraParser, NoPrefixOrFlippedByteCrashes) {
  for (std::size_t length = 0; length < kTiger.size(); length += 7) ErrorOf(kTiger.substr(0, length));
  RandomStream random(1, 0, "flips");
  for (int i = 0; i < 2000; ++i) {
    std::string text = kTiger;
    for (int k = 0; k < 3; ++k) text[random.Index(text.size())] = static_cast<char>(random.Index(256));
    ErrorOf(text);
  }
}

}  // namespace
}  // namespace feeler::planner
