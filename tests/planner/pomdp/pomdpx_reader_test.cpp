// Laws of the reader of APPL's format:
// - a factored model, written with tables or with decision diagrams (templates, persistent, deterministic, uniform
//   parts), is the flat model that a hand has worked out, and both writings give the same;
// - fully observed variables are part of the observation; rewards of several tables add up; the parents may be
// variables
//   on arrival; only states that can be met are joined;
// - every malformed file is one InputError that names the line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"
#include "tests/planner/pomdp/rover.h"
#include "tests/planner/pomdp/small_models.h"

namespace feeler::planner {
namespace {

std::size_t Index(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::ranges::find(names, name);
  EXPECT_NE(found, names.end()) << name;
  return static_cast<std::size_t>(found - names.begin());
}

/// Rows by name, so that the order of states does not matter.
std::map<std::string, double> Named(std::span<const SparseEntry> row, const std::vector<std::string>& names) {
  std::map<std::string, double> named;
  for (const SparseEntry& e : row) named[names[e.index]] = e.value;
  return named;
}

void ExpectSame(const Pomdp& a, const Pomdp& b) {
  ASSERT_EQ(a.state_count(), b.state_count());
  EXPECT_EQ(a.actions, b.actions);
  EXPECT_EQ(Named(a.start, a.states), Named(b.start, b.states));
  for (std::size_t action = 0; action < a.action_count(); ++action) {
    for (std::size_t s = 0; s < a.state_count(); ++s) {
      const std::size_t other = b.At(action, Index(b.states, a.states[s]));
      const std::size_t own = a.At(action, s);
      EXPECT_EQ(Named(a.transitions.Row(own), a.states), Named(b.transitions.Row(other), b.states));
      EXPECT_EQ(Named(a.observation_rows.Row(own), a.observations),
                Named(b.observation_rows.Row(other), b.observations));
      EXPECT_DOUBLE_EQ(a.reward[own], b.reward[other]);
    }
  }
}

TEST(PomdpxReader, JoinsWhatAHandJoins) {
  const Pomdp p = ParsePomdpx(Rover(kTableTransitions, kTableSensor), "file");
  EXPECT_EQ(p.state_count(), 6U);
  EXPECT_DOUBLE_EQ(p.discount, 0.95);
  EXPECT_EQ(Named(p.start, p.states), (std::map<std::string, double>{{"s1.good", 0.5}, {"s1.bad", 0.5}}));
  const auto at = [&](const std::string& action, const std::string& state) {
    return p.At(Index(p.actions, action), Index(p.states, state));
  };
  EXPECT_EQ(Named(p.transitions.Row(at("sample", "s0.good")), p.states),
            (std::map<std::string, double>{{"s0.bad", 1.0}}));
  EXPECT_EQ(Named(p.transitions.Row(at("east", "s1.bad")), p.states), (std::map<std::string, double>{{"s2.bad", 1.0}}));
  EXPECT_EQ(Named(p.observation_rows.Row(at("check", "s1.bad")), p.observations),
            (std::map<std::string, double>{{"s1.ogood", 0.2}, {"s1.obad", 0.8}}));
  EXPECT_DOUBLE_EQ(p.reward[at("sample", "s0.good")], 10.0);
  EXPECT_DOUBLE_EQ(p.reward[at("sample", "s0.bad")], -10.0);
  EXPECT_DOUBLE_EQ(p.reward[at("sample", "s1.bad")], -100.0);
  EXPECT_DOUBLE_EQ(p.reward[at("east", "s1.good")], 10.0);
}

TEST(PomdpxReader, DiagramsAndTablesGiveTheSame) {
  const Pomdp tables = ParsePomdpx(Rover(kTableTransitions, kTableSensor), "file");
  ExpectSame(tables, ParsePomdpx(Rover(kDiagramTransitions, kDiagramSensor), "file"));
  ExpectSame(tables, ParsePomdpx(Rover(kTableTransitions, kDiagramSensor), "file"));
}

TEST(PomdpxReader, TheValueIsThatOfTheFlatModel) {
  const Pomdp p = ParsePomdpx(Rover(kDiagramTransitions, kDiagramSensor), "file");
  const Pomdp flat = ParseCassandraPomdp(
      [&] {
        std::string text = FormatCassandraPomdp(p);
        return text;
      }(),
      "flat");
  PomdpSolverOptions options;
  options.precision = 1e-6;
  const PomdpResult a = SolvePomdp(p, options);
  const PomdpResult b = SolvePomdp(flat, options);
  EXPECT_NEAR(a.value_lower, b.value_lower, 1e-6);
  // West, look at the rock from where the sensor is certain, sample if good, leave: worked out by hand.
  const double g = 0.95;
  const double good = 10.0 + g * (0.0 + g * 10.0);
  const double bad = g * 10.0;
  EXPECT_NEAR(a.value_lower, std::max(10.0, g * g * (0.5 * good + 0.5 * bad)), 1e-5);
}

std::string PomdpxErrorOf(const std::string& text) {
  try {
    ParsePomdpx(text, "file");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string Without(std::string text, const std::string& part, const std::string& instead = "") {
  const std::size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return text.replace(at, part.size(), instead);
}

TEST(PomdpxReader, MalformedFilesNameTheLine) {
  const std::string good = Rover(kTableTransitions, kTableSensor);
  const std::string diagram = Rover(kDiagramTransitions, kDiagramSensor);
  const std::pair<std::string, std::string> cases[] = {
      {good.substr(0, good.size() / 2), "no complete XML"},
      {"<pomdp/>", "file:1: the root is no <pomdpx>"},
      {Without(good, "<Discount>0.95</Discount>"), "<pomdpx> without <Discount>"},
      {Without(good, "0.95", "nan"), "file:3: \"nan\" is no number"},
      {Without(good, "0.0 1.0 0.0", "0.0 0.9 0.0"),
       "file:12: the probabilities of rover_0 given no parents sum to 0.9"},
      {Without(good, "0.8 0.2 0.2 0.8", "0.8 0.2 0.2"), "3 numbers for 4 entries"},
      {Without(good, "0.8 0.2 0.2 0.8", "0.8 0.2 0.2 0.7"),
       "the probabilities of sensor given check, s1, bad sum to 0.9"},
      {Without(good, "east s1 s2", "east s1 s7"), "unknown value \"s7\" of variable \"rover_1\""},
      {Without(good, "east s1 s2", "east s2"), "2 values for 3 variables"},
      {Without(good, "<Parent>action rover_0 rock_0</Parent>", "<Parent>action rover_0 stone_0</Parent>"),
       "unknown variable \"stone_0\""},
      {Without(diagram, "<Edge val=\"check\"><SubDAG type=\"persistent\" var=\"rover_1\"/></Edge>"),
       "no branch for value \"check\" of \"action\""},
      {Without(diagram, "<SubDAG type=\"deterministic\" var=\"rock_1\" val=\"bad\"/>"), "<Edge> holds no branch"},
      {Without(diagram, "idref=\"same\"", "idref=\"other\""), "unknown template \"other\""},
      {Without(good, "<NumValues>3</NumValues>", "<NumValues>1000000000</NumValues>"), "file:5: 1e+09 states"},
      {Without(good, "<NumValues>3</NumValues>", "<NumValues>18446744073709551616</NumValues>"), "1.845e+19 states"},
      {Without(good, "<NumValues>3</NumValues>", "<NumValues>1e300</NumValues>"), "1e+300 states"},
      {Without(good, "<NumValues>3</NumValues>", "<NumValues>2.5</NumValues>"), "2.5 values"},
      {Without(good, kTableSensor), "no table of \"sensor\" in <ObsFunction>"},
      {Without(good, "0.95", "1.0"), "file:3: a discount of 1"},
      // What the format does not know, or knows once.
      {Without(good, "<Discount>", "<Discount>0.5</Discount><Discount>"), "file:3: <Discount> twice in <pomdpx>"},
      {Without(Without(good, "<RewardFunction>", "<Rewards>"), "</RewardFunction>", "</Rewards>"),
       "<Rewards> in <pomdpx>"},
      {Without(good, "<Entry><Instance>east s1</Instance><ValueTable>10</ValueTable></Entry>",
               "<Entri><Instance>east s1</Instance><ValueTable>10</ValueTable></Entri>"),
       "<Entri> in <Parameter>"},
      {Without(good, "fullyObs=\"true\"", "fullyObs=\"maybe\""), "file:5: fullyObs=\"maybe\""},
      {Without(good, "<NumValues>3</NumValues>", "<NumValues>3</NumValues><ValueEnum>a b c</ValueEnum>"),
       "file:5: values and their number"},
      {Without(good, "<Parent>action rover_0 rock_0</Parent>", "<Parent>action rover_0 rover_0</Parent>"),
       "parent \"rover_0\" twice"},
      {Without(good, "<Parent>action rover_1 rock_1</Parent>", "<Parent>action sensor rock_1</Parent>"),
       "variable \"sensor\" is a parent of its own"},
      {Without(diagram, "<Edge val=\"ogood\"><Terminal>0.8</Terminal>",
               "<Edge val=\"ogood\"><Terminal>0.8</Terminal><Terminal>0.8</Terminal>"),
       "<Edge> holds more than one branch"},
      {Without(diagram, "<Terminal>0.8</Terminal>", "<Terminal>-0.8</Terminal>"), "-0.8 is no probability"},
      {Without(diagram, "<SubDAG type=\"deterministic\" var=\"sensor\" val=\"obad\"/>",
               "<SubDAG type=\"uniform\" var=\"rock_1\"/>"),
       "uniform of \"rock_1\", which is not the variable of the table"},
      {Without(good, kTableSensor, kTableSensor + kTableSensor), "a second table of \"sensor\" in <ObsFunction>"},
  };
  for (const auto& [text, error] : cases) {
    EXPECT_THAT(PomdpxErrorOf(text), testing::HasSubstr(error));
    EXPECT_TRUE(PomdpxErrorOf(text).starts_with("file:")) << PomdpxErrorOf(text);
    EXPECT_EQ(PomdpxErrorOf(text).find('\n'), std::string::npos);
  }
}

int LineOf(const std::string& text, const std::string& part) {
  return 1 + static_cast<int>(std::ranges::count(text.substr(0, text.find(part)), '\n'));
}

TEST(PomdpxReader, SumsNameTheEntryOrTheBranch) {
  const std::string table = Without(Rover(kTableTransitions, kTableSensor), "0.8 0.2 0.2 0.8", "0.8 0.2 0.2 0.7");
  EXPECT_TRUE(PomdpxErrorOf(table).starts_with("file:" + std::to_string(LineOf(table, "0.8 0.2 0.2 0.7")) + ":"));
  const std::string diagram =
      Without(Rover(kDiagramTransitions, kDiagramSensor), "<Terminal>0.8</Terminal>", "<Terminal>0.7</Terminal>");
  EXPECT_TRUE(PomdpxErrorOf(diagram).starts_with("file:" + std::to_string(LineOf(diagram, "0.7")) + ":"));
  EXPECT_GT(LineOf(diagram, "0.7"), LineOf(diagram, "<Var>sensor"));
}

/// `count` binary variables: all start at s0 unless `start` is "uniform"; `stays` or drawn anew; all or none are seen.
std::string Coins(int count, const std::string& start, bool stays, bool seen) {
  std::string variables, initial, transitions, sensors;
  for (int i = 0; i < count; ++i) {
    const std::string n = std::to_string(i);
    variables += "<StateVar vnamePrev=\"x" + n + "\" vnameCurr=\"y" + n + "\"><NumValues>2</NumValues></StateVar>";
    if (seen) variables += "<ObsVar vname=\"o" + n + "\"><NumValues>2</NumValues></ObsVar>";
    // A parent, so that the size is not the product of what stands alone.
    const std::string parent = i == 0 ? "null" : "x" + std::to_string(i - 1);
    initial += "<CondProb><Var>x" + n + "</Var><Parent>" + parent + "</Parent><Parameter>" +
               Entry(i == 0 ? "-" : "* -", start) + "</Parameter></CondProb>";
    transitions += "<CondProb><Var>y" + n + "</Var><Parent>a x" + n + "</Parent><Parameter>" +
                   Entry(stays ? "* - -" : "* * -", stays ? "identity" : "uniform") + "</Parameter></CondProb>";
    sensors += "<CondProb><Var>o" + n + "</Var><Parent>a</Parent><Parameter>" + Entry("* -", "uniform") +
               "</Parameter></CondProb>";
  }
  return "<pomdpx version=\"1.0\"><Discount>0.9</Discount><Variable>" + variables +
         "<ActionVar vname=\"a\"><NumValues>1</NumValues></ActionVar><RewardVar vname=\"r\"/></Variable>"
         "<InitialStateBelief>" +
         initial + "</InitialStateBelief><StateTransitionFunction>" + transitions + "</StateTransitionFunction>" +
         (seen ? "<ObsFunction>" + sensors + "</ObsFunction>" : "<ObsFunction/>") + "</pomdpx>";
}

TEST(PomdpxReader, WhatDoesNotFitIsRefusedWhileItIsJoined) {
  EXPECT_EQ(ParsePomdpx(Coins(4, "uniform", true, true), "file").state_count(), 16U);
  EXPECT_THAT(PomdpxErrorOf(Coins(34, "uniform", true, false)), testing::HasSubstr("make the model smaller"));
  EXPECT_THAT(PomdpxErrorOf(Coins(34, "1 0", false, false)), testing::HasSubstr("make the model smaller"));
  EXPECT_THAT(PomdpxErrorOf(Coins(34, "1 0", true, true)), testing::HasSubstr("make the model smaller"));
}

TEST(PomdpxReader, JointNamesAreDifferent) {
  std::string text = Coins(2, "uniform", true, true);
  for (const std::string& values : {std::string("a a.b"), std::string("b.c c")}) {
    text = Without(text, "<NumValues>2</NumValues></ObsVar>", "<ValueEnum>" + values + "</ValueEnum></ObsVar>");
  }
  const Pomdp p = ParsePomdpx(text, "file");
  EXPECT_EQ(std::set<std::string>(p.observations.begin(), p.observations.end()),
            (std::set<std::string>{"a.b.c", "a.b.c.2", "a.c", "a.b.b.c"}));
}

TEST(PomdpxReader, NoPrefixOrFlippedByteCrashes) {
  const std::string good = Rover(kDiagramTransitions, kTableSensor);
  for (std::size_t length = 0; length < good.size(); length += 37) PomdpxErrorOf(good.substr(0, length));
  RandomStream random(1, 0, "flips");
  for (int i = 0; i < 500; ++i) {
    std::string text = good;
    for (int k = 0; k < 2; ++k) text[random.Index(text.size())] = static_cast<char>(random.Index(128));
    PomdpxErrorOf(text);
  }
}

}  // namespace
}  // namespace feeler::planner
