// Cassandra's `.pomdp` format. The grammar is that of pomdp.org ("POMDP file grammar"), one function a production.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <unordered_map>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/files/cassandra_tokens.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/files/table_builder.h"

namespace feeler::planner {
namespace {

/// States, actions or observations: a count, or names.
struct Names {
  std::string kind;  ///< "state", "action", "observation"
  std::size_t count = 0;
  std::vector<std::string> names;  ///< empty where only the count is given
  std::unordered_map<std::string, std::uint32_t> index;

  std::vector<std::string> InFull() const {
    std::vector<std::string> all = names;
    for (std::size_t i = all.size(); i < count; ++i) all.push_back(fmt::format("{}", i));
    return all;
  }
};

/// First and one past the last of what a name or a wildcard stands for.
struct Range {
  std::uint32_t begin = 0, end = 0;
  bool all = false;
  std::uint32_t or_any() const { return all ? RewardStatements::kAny : begin; }
};

class Parser {
 public:
  Parser(std::string_view text, const std::string& name, const std::function<bool()>& stop)
      : pulse_(stop), tokens_(text, name, &pulse_), name_(name) {}

  Pomdp Parse() {
    while (!tokens_.done()) Statement();
    RequirePreamble("the tables");
    return Finish();
  }

 private:
  void Statement() {
    if (!tokens_.AtStatement()) {
      tokens_.Next("a statement");
      tokens_.Fail("a statement should begin here",
                   "discount:, values:, states:, actions:, observations:, start:, T:, O: or R:");
    }
    const std::string word(tokens_.Next("a statement"));
    if (word == "start") return Start();
    tokens_.Expect(":", "\":\"");
    if (word == "discount") return Discount();
    if (word == "values") return Values();
    if (word == "states") return List(states_);
    if (word == "actions") return List(actions_);
    if (word == "observations") return List(observations_);
    RequirePreamble(word + ":");
    if (word == "T") return Transition();
    if (word == "O") return Observation();
    if (word == "R") return Reward();
    tokens_.Fail("E: belongs to another format", "leave it out");
  }

  /// Tables refer to what stands before them: given again later it would mean another model.
  void RequireOnce(int& first_line, const char* what) {
    if (first_line > 0) tokens_.Fail(fmt::format("{} twice (first on line {})", what, first_line), "leave one out");
    first_line = tokens_.line();
  }

  void Discount() {
    RequireOnce(discount_line_, "discount:");
    discount_ = tokens_.Number("the discount");
    if (!(*discount_ > 0.0 && *discount_ <= 1.0)) {
      tokens_.Fail(fmt::format("discount {:g} is not in (0, 1]", *discount_), "give one above 0 and at most 1");
    }
  }

  void Values() {
    RequireOnce(values_line_, "values:");
    if (rewards_ && rewards_->size() > 0) tokens_.Fail("values: after rewards", "give it before the first R:");
    const std::string_view word = tokens_.Next("reward or cost");
    if (word != "reward" && word != "cost") tokens_.Fail("values must be reward or cost", "choose one");
    costs_ = word == "cost";
  }

  void List(Names& list) {
    if (&list == &observations_ && mdp_) {
      tokens_.Fail("observations: after the tables", "give it before the first T:, O: or R:");
    }
    if (list.count > 0) tokens_.Fail(fmt::format("{}s given twice", list.kind), "leave one list out");
    const int line = tokens_.line();
    while (!tokens_.AtStatement()) {
      const std::string word(tokens_.Next("a name"));
      if (CassandraTokens::IsInteger(word) && list.names.empty() && tokens_.AtStatement()) {
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), list.count);
        // What cannot be held is refused here, before anything of the size is allocated.
        if (error != std::errc()) list.count = ~std::size_t{0};
        RequireFits(fmt::format("{}:{}", name_, line), static_cast<double>(&list == &states_ ? list.count : 1),
                    static_cast<double>(&list == &actions_ ? list.count : 1), static_cast<double>(list.count));
        break;
      }
      const char first = word[0];
      if (word == ":" || word == "*" || (first >= '0' && first <= '9') || CassandraTokens::IsNumber(word)) {
        tokens_.Fail(fmt::format("\"{}\" is no name of a {}", word, list.kind),
                     "give a count, or names that begin with a letter");
      }
      if (!list.index.emplace(word, static_cast<std::uint32_t>(list.names.size())).second) {
        tokens_.Fail(fmt::format("{} \"{}\" listed twice", list.kind, word), "leave one out");
      }
      list.names.push_back(word);
    }
    list.count = std::max(list.count, list.names.size());
    if (list.count == 0) tokens_.FailAt(line, fmt::format("no {}s", list.kind), "give a count or names");
  }

  /// Before the first table: everything has a size, and the tables fit.
  void RequirePreamble(const std::string& what) {
    if (transitions_) return;
    if (!discount_) tokens_.Fail("no discount before " + what, "add discount:");
    if (states_.count == 0) tokens_.Fail("no states before " + what, "add states:");
    if (actions_.count == 0) tokens_.Fail("no actions before " + what, "add actions:");
    mdp_ = observations_.count == 0;
    if (mdp_) {
      observations_.count = states_.count;
      observations_.names = states_.names;
      observations_.index = states_.index;
    }
    const auto s = static_cast<double>(states_.count);
    const auto a = static_cast<double>(actions_.count);
    const auto o = static_cast<double>(observations_.count);
    RequireFits(fmt::format("{}:{}", name_, tokens_.line()), s, a, s * a * 2.0 + o * 4.0);
    if ((s + 1.0) * (s + 1.0) * (a + 1.0) * (o + 1.0) > 1e19) {
      tokens_.Fail("too many states, actions and observations", "make the model smaller");
    }
    transitions_.emplace(actions_.count * states_.count, states_.count);
    observation_rows_.emplace(actions_.count * states_.count, observations_.count);
    rewards_.emplace(actions_.count, states_.count, observations_.count);
  }

  Range Name(const Names& list, bool wildcard) {
    const std::string word(tokens_.Next("the name of a " + list.kind));
    if (word == "*") {
      if (!wildcard) tokens_.Fail("a wildcard where one " + list.kind + " must be named", "name it");
      return {0, static_cast<std::uint32_t>(list.count), true};
    }
    std::uint32_t index = 0;
    if (CassandraTokens::IsInteger(word)) {
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
      if (error != std::errc() || index >= list.count) {
        tokens_.Fail(fmt::format("{} {} of {}", list.kind, word, list.count),
                     fmt::format("they count from 0 to {}", list.count - 1));
      }
    } else {
      const auto found = list.index.find(word);
      if (found == list.index.end()) {
        tokens_.Fail(fmt::format("unknown {} \"{}\"", list.kind, word), fmt::format("list it under {}s:", list.kind));
      }
      index = found->second;
    }
    return {index, index + 1, false};
  }

  double Probability() {
    const double p = tokens_.Number("a probability");
    if (!(p >= 0.0 && p <= 1.0 + kSumTolerance)) tokens_.Fail(fmt::format("{:g} is no probability", p), "give 0 to 1");
    return p;
  }

  /// |columns| numbers, or `uniform`; `reset` in transitions. Zeros are left out.
  std::vector<SparseEntry> Row(std::size_t columns, bool transition) {
    std::vector<SparseEntry> row;
    if (tokens_.Accept("uniform")) return Uniform(columns);
    if (tokens_.Peek() == "reset") {
      tokens_.Next("reset");
      if (!transition) tokens_.Fail("reset outside of transitions", "give the probabilities");
      if (!start_) tokens_.Fail("reset, and no start", "give start: before");
      return *start_;
    }
    for (std::size_t i = 0; i < columns; ++i) {
      RequireMore(columns, i);
      const double p = Probability();
      if (p != 0.0) row.push_back({static_cast<std::uint32_t>(i), p});
    }
    return row;
  }

  void RequireMore(std::size_t wanted, std::size_t have) {
    if (tokens_.AtStatement()) tokens_.Fail(fmt::format("{} of {} numbers", have, wanted), "give one a column");
  }

  std::vector<SparseEntry> Uniform(std::size_t columns) {
    RequireSpace(static_cast<double>(columns));
    std::vector<SparseEntry> row(columns);
    for (std::size_t i = 0; i < columns; ++i) {
      row[i] = {static_cast<std::uint32_t>(i), 1.0 / static_cast<double>(columns)};
    }
    return row;
  }

  /// What a wildcard or a word writes out must fit, before it is written.
  void RequireSpace(double more) {
    const double entries =
        transitions_ ? static_cast<double>(transitions_->entries() + observation_rows_->entries()) : 0.0;
    RequireFits(fmt::format("{}:{}", name_, tokens_.line()), static_cast<double>(states_.count),
                static_cast<double>(actions_.count), entries + more);
  }

  template <class F>
  void ForEachRow(const Range& a, const Range& s, F f) {
    for (std::uint32_t action = a.begin; action < a.end; ++action) {
      for (std::uint32_t state = s.begin; state < s.end; ++state) f(action * states_.count + state);
    }
  }

  void AssignAll(RowsBuilder& rows, const Range& a, const Range& s, const std::vector<SparseEntry>& row) {
    RequireSpace(static_cast<double>(a.end - a.begin) * (s.end - s.begin) * static_cast<double>(row.size()));
    ForEachRow(a, s, [&](std::size_t i) {
      pulse_(row.size() + 10);
      rows.Assign(i, row, tokens_.line());
    });
  }

  void Transition() { Table(*transitions_, states_, true); }
  void Observation() {
    if (mdp_) tokens_.Fail("O: in a file without observations", "add observations:");
    Table(*observation_rows_, observations_, false);
  }

  /// `T: a : s : s' p`, `T: a : s row`, `T: a matrix`; the same for `O:`, whose state is the one on arrival.
  void Table(RowsBuilder& rows, const Names& columns, bool transition) {
    const Range a = Name(actions_, true);
    const Range all{0, static_cast<std::uint32_t>(states_.count), true};
    if (!tokens_.Accept(":")) {
      if (tokens_.Accept("identity")) {
        if (columns.count != states_.count) tokens_.Fail("identity, and the table is not square", "give the rows");
        for (std::uint32_t s = 0; s < states_.count; ++s) AssignAll(rows, a, {s, s + 1, false}, {{s, 1.0}});
      } else if (tokens_.Peek() == "uniform") {
        AssignAll(rows, a, all, Row(columns.count, transition));
      } else {
        for (std::uint32_t s = 0; s < states_.count; ++s) {
          AssignAll(rows, a, {s, s + 1, false}, Row(columns.count, transition));
        }
      }
      return;
    }
    const Range s = Name(states_, true);
    if (!tokens_.Accept(":")) {
      if (tokens_.Peek() == "identity") {
        tokens_.Next("identity");
        tokens_.Fail("identity in a row", "it stands for a matrix");
      }
      return AssignAll(rows, a, s, Row(columns.count, transition));
    }
    const Range to = Name(columns, true);
    const double p = Probability();
    if (to.all) {
      if (p != 0.0)
        RequireSpace(static_cast<double>(a.end - a.begin) * (s.end - s.begin) * static_cast<double>(columns.count));
      ForEachRow(a, s, [&](std::size_t i) {
        pulse_(columns.count);
        rows.Fill(i, p, tokens_.line());
      });
    } else {
      RequireSpace(static_cast<double>(a.end - a.begin) * (s.end - s.begin));
      ForEachRow(a, s, [&](std::size_t i) {
        pulse_(10);
        rows.Set(i, to.begin, p, tokens_.line());
      });
    }
  }

  void SetReward(const Range& a, const Range& s, std::uint32_t to, std::uint32_t o) {
    const double value = tokens_.Number("a reward");
    if (value != 0.0) {
      int& first = (value > 0.0) != costs_ ? first_gain_line_ : first_loss_line_;
      if (first == 0) first = tokens_.line();
    }
    rewards_->Set(a.or_any(), s.or_any(), to, o, costs_ ? -value : value);
  }

  /// `R: a : s : s' : o r`, `R: a : s : s' row`, `R: a : s matrix`, `R: a matrix` (states by states: of an MDP).
  /// Without observations also `R: a : s : s' r` and `R: a : s row`, over the states on arrival.
  void Reward() {
    constexpr std::uint32_t kAny = RewardStatements::kAny;
    const Range a = Name(actions_, true);
    if (!tokens_.Accept(":")) {
      for (std::uint32_t s = 0; s < states_.count; ++s) {
        for (std::uint32_t to = 0; to < states_.count; ++to) {
          RequireMore(states_.count * states_.count, s * states_.count + to);
          SetReward(a, {s, s + 1, false}, to, kAny);
        }
      }
      return;
    }
    const Range s = Name(states_, true);
    if (!tokens_.Accept(":")) {
      for (std::uint32_t to = 0; to < states_.count; ++to) {
        if (mdp_) RequireMore(states_.count, to);
        mdp_ ? SetReward(a, s, to, kAny) : RewardRow(a, s, to);
      }
      return;
    }
    const Range to = Name(states_, true);
    if (!tokens_.Accept(":")) return mdp_ ? SetReward(a, s, to.or_any(), kAny) : RewardRow(a, s, to.or_any());
    const Range o = Name(observations_, true);
    SetReward(a, s, to.or_any(), o.or_any());
  }

  void RewardRow(const Range& a, const Range& s, std::uint32_t to) {
    for (std::uint32_t o = 0; o < observations_.count; ++o) {
      RequireMore(observations_.count, o);
      SetReward(a, s, to, o);
    }
  }

  /// `start: uniform`, a state, or a distribution; `start include:` and `start exclude:` states, uniform over them.
  void Start() {
    if (states_.count == 0) tokens_.Fail("start before states", "give states: first");
    const bool include = tokens_.Accept("include");
    const bool exclude = !include && tokens_.Accept("exclude");
    tokens_.Expect(":", "\":\"");
    RequireOnce(start_line_, "start:");
    if (include || exclude) {
      std::vector<std::uint8_t> in(states_.count, exclude ? 1 : 0);
      while (!tokens_.AtStatement()) in[Name(states_, false).begin] = include ? 1 : 0;
      start_.emplace();
      for (std::uint32_t s = 0; s < states_.count; ++s) {
        if (in[s] != 0) start_->push_back({s, 1.0});
      }
      if (start_->empty()) tokens_.FailAt(start_line_, "no state to start in", "include one");
      for (SparseEntry& entry : *start_) entry.value = 1.0 / static_cast<double>(start_->size());
      return;
    }
    if (tokens_.Peek() == "uniform") {
      start_ = Row(states_.count, false);
      return;
    }
    const bool one = tokens_.Peek() == "*" || !CassandraTokens::IsNumber(tokens_.Peek()) ||
                     (states_.count > 1 && CassandraTokens::IsInteger(tokens_.Peek()) && tokens_.AtStatement(1));
    if (one) {
      start_ = {{Name(states_, false).begin, 1.0}};
      return;
    }
    RowsBuilder row(1, states_.count);
    row.Assign(0, Row(states_.count, false), start_line_);
    const auto fail = [&](std::size_t, double sum, int line) {
      tokens_.FailAt(line, fmt::format("the probabilities of start sum to {:.6g}, not 1", sum), "mend them");
    };
    const SparseRows finished = row.Finish(fail, pulse_);
    start_ = finished.entries;
  }

  Pomdp Finish() {
    Pomdp pomdp;
    pomdp.name = name_;
    pomdp.discount = *discount_;
    pomdp.values_are_costs = costs_;
    pomdp.states = states_.InFull();
    pomdp.actions = actions_.InFull();
    pomdp.observations = observations_.InFull();
    const auto fail = [&](const char* table, const char* state) {
      return [&, table, state](std::size_t row, double sum, int line) {
        const std::size_t s = row % states_.count;
        tokens_.FailAt(
            line > 0 ? line : tokens_.line(),
            fmt::format("{}: {} : {} ({}): {}", table, pomdp.actions[row / states_.count], pomdp.states[s], state,
                        line > 0 ? fmt::format("the probabilities sum to {:.6g}, not 1", sum)
                                 : std::string("the file gives no probabilities")),
            line > 0 ? "mend the row" : "give the row");
      };
    };
    pomdp.transitions = transitions_->Finish(fail("T", "state before"), pulse_);
    if (mdp_) {
      for (std::size_t i = 0; i < actions_.count * states_.count; ++i) {
        observation_rows_->Assign(i, {{static_cast<std::uint32_t>(i % states_.count), 1.0}}, 0);
      }
    }
    pomdp.observation_rows = observation_rows_->Finish(fail("O", "state on arrival"), pulse_);
    pomdp.reward = rewards_->Expected(pomdp.transitions, pomdp.observation_rows, pulse_);
    pomdp.start = start_ ? *start_ : Uniform(states_.count);
    if (*discount_ == 1.0 && first_gain_line_ > 0 && first_loss_line_ > 0) {
      tokens_.FailAt(
          first_gain_line_,
          fmt::format("costs and rewards mixed (line {} has the other sign), at a discount of 1", first_loss_line_),
          "give a discount below 1, or costs alone");
    }
    if (*discount_ == 1.0) {
      try {
        RequireSolvable(pomdp);
      } catch (const InputError&) {
        tokens_.FailAt(first_gain_line_ > 0 ? first_gain_line_ : discount_line_,
                       first_gain_line_ > 0 ? "a discount of 1 with rewards"
                                            : "a discount of 1 without goals (absorbing states that cost nothing)",
                       "give a discount below 1, or costs and a goal");
      }
    }
    return pomdp;
  }

  Pulse pulse_;
  CassandraTokens tokens_;
  std::string name_;
  std::optional<double> discount_;
  int discount_line_ = 0, values_line_ = 0, start_line_ = 0, first_gain_line_ = 0, first_loss_line_ = 0;
  bool costs_ = false, mdp_ = false;
  Names states_{"state", 0, {}, {}}, actions_{"action", 0, {}, {}}, observations_{"observation", 0, {}, {}};
  std::optional<RowsBuilder> transitions_, observation_rows_;
  std::optional<RewardStatements> rewards_;
  std::optional<std::vector<SparseEntry>> start_;
};

}  // namespace

Pomdp ParseCassandraPomdp(std::string_view text, const std::string& name, const std::function<bool()>& stop) {
  return Parser(text, name, stop).Parse();
}

}  // namespace feeler::planner
