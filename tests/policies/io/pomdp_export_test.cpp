// Laws of the POMDP export, checked by parsers and a belief solver of the test's own:
// - the value of the exported POMDP (least expected cost of reaching `done`) is the optimum of the problem, as brute
//   force on the problem itself finds it: singleton and insertable goals, uniform and weighted priors, any cost;
// - also with the smallest admissible penalty; with too small a penalty it is not (the test can tell), and an upper
// bound
//   below the optimum is refused;
// - with a discount the value lies between discount^(n-1) times the optimum and the optimum, n the moves of a policy;
// - the model is well-formed: one successor and one observation for each state and action, `done` absorbing and free;
// - the .pomdpx, flattened, is the same model as the .pomdp;
// - problems that cannot be localized are refused with the pair.
#include "feeler/policies/io/pomdp_export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <regex>
#include <sstream>

#include "feeler/core/error.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "tests/policies/brute_force.h"

namespace feeler::policies {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A deterministic POMDP as tables over names.
struct Model {
  std::vector<std::string> states, actions, observations;
  std::map<std::string, double> start;
  std::map<std::pair<std::string, std::string>, std::string> next;  // action, state
  std::map<std::pair<std::string, std::string>, double> cost;       // action, state
  std::map<std::string, std::string> observed;                      // state on arrival
  double discount = 0.0;
};

std::vector<std::string> Words(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

Model ParsePomdp(const std::string& text) {
  Model model;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = line.substr(0, line.find('#'));
    std::vector<std::string> w = Words(line);
    if (w.empty()) continue;
    const std::string head = w[0];
    const std::vector<std::string> rest(w.begin() + 1, w.end());
    if (head == "discount:") model.discount = std::stod(rest.at(0));
    if (head == "values:") {
      EXPECT_EQ(rest.at(0), "reward");
    }
    if (head == "states:") model.states = rest;
    if (head == "actions:") model.actions = rest;
    if (head == "observations:") model.observations = rest;
    if (head == "start:") {
      EXPECT_EQ(rest.size(), model.states.size());
      for (std::size_t i = 0; i < rest.size(); ++i) {
        if (std::stod(rest[i]) > 0.0) model.start[model.states[i]] = std::stod(rest[i]);
      }
    }
    if (head == "T:") {  // action : state : next 1.0
      EXPECT_EQ(rest.at(5), "1.0");
      const std::vector<std::string> from = rest[2] == "*" ? model.states : std::vector{rest[2]};
      for (const std::string& state : from) {
        EXPECT_TRUE(model.next.emplace(std::pair{rest[0], state}, rest[4]).second) << "two successors: " << line;
      }
    }
    if (head == "R:") model.cost[{rest.at(0), rest.at(2)}] = -std::stod(rest.at(7));  // action : state : * : * reward
    if (head == "O:") {                                                               // * : state : observation 1.0
      EXPECT_EQ(rest.at(0), "*");
      EXPECT_EQ(rest.at(5), "1.0");
      EXPECT_TRUE(model.observed.emplace(rest.at(2), rest.at(4)).second);
    }
  }
  return model;
}

/// Expands the factored model into the flat one, names as in the .pomdp file.
Model ParsePomdpx(const std::string& text) {
  const auto tag = [](const std::string& from, const std::string& name) {
    std::smatch match;
    EXPECT_TRUE(std::regex_search(from, match, std::regex("<" + name + "[^>]*>([^<]*)</" + name + ">"))) << name;
    return match[1].str();
  };
  const auto section = [&](const std::string& begin, const std::string& end) {
    const std::size_t at = text.find(begin);
    EXPECT_NE(at, std::string::npos) << begin;
    return text.substr(at, text.find(end, at) - at);
  };
  const auto entries = [](const std::string& from) {
    std::vector<std::pair<std::vector<std::string>, std::string>> list;
    const std::regex entry("<Instance>([^<]*)</Instance><(Prob|Value)Table>([^<]*)<");
    for (std::sregex_iterator it(from.begin(), from.end(), entry), end; it != end; ++it) {
      list.emplace_back(Words((*it)[1].str()), (*it)[3].str());
    }
    return list;
  };
  Model model;
  model.discount = std::stod(tag(text, "Discount"));
  const auto cells = Words(tag(section("vnamePrev=\"robot_0\"", "</StateVar>"), "ValueEnum"));
  const auto hypotheses = Words(tag(section("vnamePrev=\"target_0\"", "</StateVar>"), "ValueEnum"));
  model.actions = Words(tag(section("<ActionVar", "</ActionVar>"), "ValueEnum"));
  const auto flat = [](const std::string& cell, const std::string& h) {
    return cell == "done" ? cell : cell + "_" + h;
  };
  const auto matching = [](const std::string& pattern, const std::vector<std::string>& values) {
    return pattern == "*" ? values : std::vector<std::string>{pattern};
  };
  const auto start_cell = Words(entries(section("<Var>robot_0", "</CondProb>")).at(0).second);
  const auto prior = Words(entries(section("<Var>target_0", "</CondProb>")).at(0).second);
  for (std::size_t r = 0; r < cells.size(); ++r) {
    model.observed[cells[r] == "done" ? "done" : ""] = "";
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      const double p = std::stod(start_cell.at(r)) * std::stod(prior.at(h));
      if (p > 0.0) model.start[flat(cells[r], hypotheses[h])] = p;
      model.observed[flat(cells[r], hypotheses[h])] = cells[r] == "done" ? "end" : cells[r];
    }
  }
  model.observed.erase("");
  for (const auto& [i, table] : entries(section("<Var>robot_1", "</CondProb>"))) {
    EXPECT_EQ(table, "1.0");
    for (const std::string& action : matching(i.at(0), model.actions)) {
      for (const std::string& cell : matching(i.at(1), cells)) {
        for (const std::string& h : matching(i.at(2), hypotheses)) {
          const auto [at, fresh] = model.next.emplace(std::pair{action, flat(cell, h)}, flat(i.at(3), h));
          EXPECT_TRUE(fresh || at->second == flat(i.at(3), h)) << "two successors";
        }
      }
    }
  }
  for (const auto& [i, table] : entries(section("<Var>reward", "</Func>"))) {
    for (const std::string& action : matching(i.at(0), model.actions)) {
      for (const std::string& cell : matching(i.at(1), cells)) {
        for (const std::string& h : matching(i.at(2), hypotheses)) {
          model.cost[{action, flat(cell, h)}] = 0.0 - std::stod(table);
        }
      }
    }
  }
  std::erase_if(model.cost, [](const auto& item) { return item.second == 0.0; });
  return model;
}

void ExpectWellFormed(const Model& model) {
  for (const std::string& action : model.actions) {
    for (const std::string& state : model.states) {
      ASSERT_TRUE(model.next.contains({action, state})) << action << " " << state;
      ASSERT_TRUE(model.observed.contains(state));
    }
    EXPECT_EQ(model.next.at({action, "done"}), "done");
    EXPECT_FALSE(model.cost.contains({action, "done"}));
  }
  double total = 0.0;
  for (const auto& [state, p] : model.start) total += p;
  EXPECT_NEAR(total, 1.0, 1e-12);
}

/// Least expected cost of reaching `done`: value iteration over the reachable beliefs, from above (from infinity), so
/// that policies that never declare do not count as free.
double Value(const Model& model) {
  using Belief = std::map<std::string, double>;
  std::map<Belief, std::size_t> index;
  std::vector<Belief> beliefs;
  struct Successor {
    double probability;
    std::size_t belief;
  };
  struct Choice {
    double cost = 0.0;
    std::vector<Successor> successors;
  };
  std::vector<std::vector<Choice>> choices;
  // Probabilities are unnormalised (those of the prior): they are sums of no more than the start's own entries.
  const auto add = [&](const Belief& belief) {
    const auto [at, fresh] = index.emplace(belief, beliefs.size());
    if (fresh) beliefs.push_back(belief);
    return at->second;
  };
  add(model.start);
  for (std::size_t b = 0; b < beliefs.size(); ++b) {
    const Belief belief = beliefs[b];
    choices.emplace_back();
    double total = 0.0;
    for (const auto& [state, p] : belief) total += p;
    for (const std::string& action : model.actions) {
      Choice choice;
      std::map<std::string, Belief> parts;
      for (const auto& [state, p] : belief) {
        const auto cost = model.cost.find({action, state});
        if (cost != model.cost.end()) choice.cost += p / total * cost->second;
        const std::string& next = model.next.at({action, state});
        parts[model.observed.at(next)][next] += p;
      }
      for (auto& [observation, part] : parts) {
        if (part.contains("done")) part = {{"done", 1.0}};
        double weight = 0.0;
        for (const auto& [state, p] : part) weight += p;
        choice.successors.push_back({part.contains("done") ? 1.0 : weight / total, add(part)});
      }
      choices[b].push_back(choice);
    }
  }
  std::vector<double> value(beliefs.size(), kInfinity);
  value[index.at({{"done", 1.0}})] = 0.0;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t b = 0; b < beliefs.size(); ++b) {
      for (const Choice& choice : choices[b]) {
        double cost = choice.cost;
        for (const Successor& s : choice.successors) {
          if (s.probability > 0.0) cost += model.discount * s.probability * value[s.belief];
        }
        if (cost < value[b] - 1e-13) value[b] = cost, changed = true;
      }
    }
  }
  return value[0];
}

std::vector<planner::LatticeProblemData> Problems() {
  std::vector<planner::LatticeProblemData> problems = {SmallProblemData(false), SmallProblemData(true)};
  problems.push_back(SmallProblemData(true));
  problems.back().goal = GoalKind::kInsertable;
  problems.back().insertable_spread = Cell(1, 0, 0);
  problems.push_back(SmallProblemData(false));
  problems.back().cost = {0.5, 2.0, 0.0};
  problems.back().move_lengths = {1, 3};
  problems.push_back(SmallProblemData(false));
  problems.back().size = Cell(4, 4, 4);
  problems.back().start = Cell(0, 0, 3);
  problems.back().target = {Cell(1, 1, 0), Cell(1, 1, 1), Cell(2, 1, 0)};
  problems.back().hypotheses = {{Cell(0, 0, 0), 0, 1.0}, {Cell(1, 0, 0), 0, 1.0}, {Cell(0, 1, 1), 0, 2.0}};
  problems.back().move_lengths = {1, 2};
  return problems;
}

TEST(PomdpExport, HasTheValueOfTheProblem) {
  for (std::size_t i = 0; i < Problems().size(); ++i) {
    const planner::Problem problem = planner::MakeLatticeProblem(Problems()[i]);
    const double optimum = BruteForce(problem).Value();
    ASSERT_LT(optimum, kInfinity) << "problem " << i;
    const Model model = ParsePomdp(FormatPomdp(problem));
    ExpectWellFormed(model);
    EXPECT_EQ(model.discount, 1.0);
    EXPECT_NEAR(Value(model), optimum, 1e-9) << "problem " << i;
    // The penalty only needs the optimum itself as bound.
    PomdpOptions tight;
    tight.upper_bound = optimum;
    EXPECT_LE(DeclarePenalty(problem, tight), DeclarePenalty(problem));
    EXPECT_NEAR(Value(ParsePomdp(FormatPomdp(problem, tight))), optimum, 1e-9) << "problem " << i;
    PomdpOptions wrong;
    for (const double share : {0.0, 0.5, 0.999}) {
      wrong.upper_bound = share * optimum;
      EXPECT_THROW(FormatPomdp(problem, wrong), InputError) << "problem " << i << ", share " << share;
    }
    Model cheap = model;
    for (auto& [pair, cost] : cheap.cost) cost = pair.first.starts_with("declare") ? 1e-3 : cost;
    EXPECT_LT(Value(cheap), optimum - 1e-3) << "problem " << i;
  }
}

TEST(PomdpExport, ADiscountMovesTheValueByNoMoreThanItsBound) {
  for (planner::LatticeProblemData data : Problems()) {
    data.cost.per_action = 0.5;  // without it a free loop for ever is the best of a discounted world
    const planner::Problem problem = planner::MakeLatticeProblem(data);
    const double optimum = BruteForce(problem).Value();
    // An optimal policy has at most this many moves, each of which costs at least per_action, on average; and its
    // worst history at most as much cost as the optimum over the smallest weight.
    double smallest = 1.0;
    double total = 0.0;
    for (const planner::Hypothesis& h : problem.hypotheses) total += h.weight;
    for (const planner::Hypothesis& h : problem.hypotheses) smallest = std::min(smallest, h.weight / total);
    const double moves = optimum / smallest / data.cost.per_action;
    for (const double discount : {0.999, 0.99}) {
      ASSERT_GT(data.cost.per_action / (1.0 - discount), optimum) << "delaying for ever would pay";
      PomdpOptions options;
      options.discount = discount;
      const Model model = ParsePomdp(FormatPomdp(problem, options));
      EXPECT_EQ(model.discount, discount);
      const double value = Value(model);
      EXPECT_LT(value, optimum - 1e-6);
      EXPECT_GE(value, std::pow(discount, moves) * optimum - 1e-9);
    }
  }
}

TEST(PomdpExport, BothFormatsSayTheSame) {
  for (const planner::LatticeProblemData& data : Problems()) {
    const planner::Problem problem = planner::MakeLatticeProblem(data);
    const Model flat = ParsePomdp(FormatPomdp(problem));
    const Model factored = ParsePomdpx(FormatPomdpx(problem));
    EXPECT_EQ(flat.actions, factored.actions);
    EXPECT_EQ(flat.start.size(), factored.start.size());
    for (const auto& [state, p] : flat.start) EXPECT_DOUBLE_EQ(factored.start.at(state), p);
    EXPECT_TRUE(flat.next == factored.next);
    EXPECT_TRUE(flat.cost == factored.cost);
    EXPECT_TRUE(flat.observed == factored.observed);
  }
}

TEST(PomdpExport, RefusesWhatItCannotSay) {
  const auto read = [](const std::string& name) {
    return planner::MakeLatticeProblem(ReadLatticeProblem(FEELER_SOURCE_DIR "/tests/data/" + name + ".json"));
  };
  try {
    FormatPomdp(read("unlocalizable"));
    ADD_FAILURE();
  } catch (const NegativeResult& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("cannot be told apart"));
  }
  const planner::Problem small = planner::MakeLatticeProblem(SmallProblemData(false));
  for (const double discount : {0.0, 1.5, -1.0, std::nan("")}) {
    EXPECT_THROW(FormatPomdp(small, {discount, kInfinity}), InputError);
  }
  EXPECT_THROW(FormatPomdpx(small, {1.0, -1.0}), InputError);
  PomdpOptions few;
  few.max_bytes = 4'000'000;
  EXPECT_THROW(FormatPomdp(read("block125"), few), InputError);
  // The limit is that of the text to the byte, not of an estimate of it.
  const planner::Problem slot = read("slot2d");
  const std::size_t size = FormatPomdp(slot).size();
  EXPECT_GT(size, 100'000U);
  few.max_bytes = size;
  EXPECT_EQ(FormatPomdp(slot, few).size(), size);
  few.max_bytes = size - 1;
  EXPECT_THROW(FormatPomdp(slot, few), InputError);
}

}  // namespace
}  // namespace feeler::policies
