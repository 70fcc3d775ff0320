#include "feeler/planner/pomdp/search/solve_pomdp.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <queue>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/model/observable_classes.h"
#include "feeler/planner/pomdp/model/pulse.h"
#include "feeler/planner/pomdp/search/point_based_search.h"
#include "feeler/planner/pomdp/search/pomdp_belief_graph.h"
#include "feeler/planner/pomdp/search/pomdp_experience.h"
#include "feeler/planner/search/bounded_search.h"
#include "feeler/planner/search/rtdp_bel.h"

namespace feeler::planner {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
/// Controllers with more unknowns than this are not evaluated for a better value than the one that is proven already.
constexpr std::size_t kEvaluatedUnknowns = 400'000;
/// Beliefs of a controller written out of a search, at most.
constexpr std::size_t kControllerNodes = 5'000;
constexpr std::size_t kExperienceBeliefs = 50'000;
/// Without discount its controller goes on blindly at beliefs that are less probable than this.
constexpr double kRare = 1e-3;
/// Trials over beliefs themselves by which RTDP-Bel judges first whether its values still move.
constexpr int kTrialWindow = 1000;
/// What comes before the search may be late by so much (one that may not begin at all is of little use), and each of
/// the two steps after it: writing the policy out, and evaluating it.
constexpr double kGrace_s = 0.5;

/// The policies that always do the same, as an incumbent of BoundedSearch (which see for the interface).
class BlindIncumbent {
 public:
  BlindIncumbent(const PomdpBeliefGraph& graph, const StateBounds& bounds) : graph_(graph), bounds_(bounds) {}
  /// False where none of them reaches a goal for certain.
  bool Solved(std::uint32_t b) { return Value(b) < kUnbounded; }
  double Value(std::uint32_t b) {
    if (b >= values_.size()) values_.resize(std::max<std::size_t>(graph_.size(), b + std::size_t{1}), kUnknown);
    if (values_[b] == kUnknown) values_[b] = graph_.to_goal() - BestRow(bounds_.blind, graph_.Belief(b));
    return values_[b];
  }
  int Action(std::uint32_t b) const {
    int best = 0;
    double most = -kUnbounded;
    for (std::size_t a = 0; a < bounds_.blind.size(); ++a) {
      double value = 0.0;
      for (const SparseEntry& s : graph_.Belief(b)) value += s.value * bounds_.blind[a][s.index];
      if (value > most) most = value, best = static_cast<int>(a);
    }
    return best;
  }
  std::int64_t expansions() const { return 0; }
  std::size_t bytes() const { return values_.capacity() * sizeof(double); }

 private:
  static constexpr double kUnknown = -kUnbounded;
  const PomdpBeliefGraph& graph_;
  const StateBounds& bounds_;
  std::vector<double> values_;
};

/// A node of a controller whose action is not settled yet: the likeliest come first.
struct ToFreeze {
  double probability = 0.0;  ///< of one way that leads there
  std::uint32_t number = 0;
  bool operator<(const ToFreeze& other) const {
    return probability != other.probability ? probability < other.probability : number > other.number;
  }
};

class Attempt {
 public:
  Attempt(const Pomdp& whole, const PomdpSolverOptions& options)
      : options_(options),
        start_(std::chrono::steady_clock::now()),
        cpu_start_s_(ThreadCpuSeconds()),
        states_(ReachableStates(whole)),
        restricted_(states_.size() < whole.state_count() ? Restrict(whole, states_) : Pomdp()),
        pomdp_(states_.size() < whole.state_count() ? restricted_ : whole) {
    for (const double r : pomdp_.reward) least_reward_ = std::min(least_reward_, r);
  }

  PomdpResult Run() {
    RequireReachableGoal();
    bounds_ = ComputeStateBounds(pomdp_, {.stop = [this] { return Stop(0).has_value(); }});
    bytes_ = pomdp_.bytes() + 3 * pomdp_.reward.size() * sizeof(double);
    result_.value_upper = BestRow(bounds_.informed, pomdp_.start);
    result_.value_lower = BestRow(bounds_.blind, pomdp_.start);
    KeepBlind();
    Row(true);
    switch (options_.kind) {
      case PomdpSolverKind::kPointBased: PointBased(); break;
      case PomdpSolverKind::kCertified: Certified(); break;
      case PomdpSolverKind::kRtdpBel:
      case PomdpSolverKind::kERtdpBel: Rtdp(); break;
    }
    if (result_.controller) result_.value_lower = worth_;
    result_.value_upper = std::max(result_.value_upper, result_.value_lower);  // rounding
    Row(true);
    result_.wall_s = Wall();
    result_.cpu_s = ThreadCpuSeconds() - cpu_start_s_;
    return std::move(result_);
  }

 private:
  double Wall() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

  bool Cancelled() {
    const bool cancelled = options_.cancellation != nullptr && options_.cancellation->cancelled();
    if (cancelled && cancelled_at_s_ < 0.0) cancelled_at_s_ = Wall();
    return cancelled;
  }

  std::optional<SolverStatus> Stop(std::int64_t expansions) {
    if (expansions >= options_.expansion_limit) return SolverStatus::kExpansionLimit;
    if (Cancelled()) return SolverStatus::kCancelled;
    if (Wall() >= options_.time_limit_s) return SolverStatus::kTimeLimit;
    return std::nullopt;
  }

  /// Stop() of what comes before the search.
  bool Late() {
    const auto why = Stop(0);
    return why && (why != SolverStatus::kTimeLimit || Wall() >= options_.time_limit_s + kGrace_s);
  }

  void Row(bool now) {
    if (!options_.on_bounds) return;
    const double wall = Wall();
    if (!now && wall < next_row_s_) return;
    next_row_s_ = std::max(0.1, wall * 1.25);
    options_.on_bounds({wall, result_.trials, result_.expansions, result_.value_lower, result_.value_upper});
  }

  /// Without discount: from each state some way must lead to a goal, or no policy has a finite value.
  void RequireReachableGoal() {
    if (pomdp_.discount < 1.0) return;
    const std::vector<std::uint8_t> kept = SurelyEnding(pomdp_, [this] { return Stop(0).has_value(); });
    for (const SparseEntry& s : pomdp_.start) {
      if (kept[s.index] != 0) continue;
      throw NegativeResult(
          pomdp_.name, fmt::format("no policy reaches a goal from state \"{}\" for certain", pomdp_.states[s.index]));
    }
  }

  /// Where the search cannot begin: the state bounds, and the best of the policies that always do the same.
  void BlindAlone(SolverStatus status) {
    result_.status = status;
    const std::uint32_t action = result_.controller->nodes[0].action;
    FullAlphaVector full{action, {}, least_reward_ / (1.0 - pomdp_.discount)};
    for (std::uint32_t s = 0; s < states_.size(); ++s) full.values.push_back({states_[s], bounds_.blind[action][s]});
    result_.alphas.push_back(std::move(full));
  }

  void PointBased() {
    const double outcome_bytes = OutcomeBytes(pomdp_);
    if (static_cast<double>(bytes_) + outcome_bytes > static_cast<double>(options_.memory_limit_bytes)) {
      return BlindAlone(SolverStatus::kMemoryLimit);
    }
    bytes_ += static_cast<std::size_t>(outcome_bytes);
    const auto found = FindObservableClasses(pomdp_, [this] { return Late(); });
    if (!found) return BlindAlone(Stop(0).value_or(SolverStatus::kTimeLimit));
    const ObservableClasses& classes = *found;
    result_.classes = classes.classes.size();
    PointBasedSearch search(pomdp_, classes, bounds_);
    const auto account = [&] {
      result_.trials = search.trials();
      result_.expansions = search.expansions();
      result_.value_lower = std::max(result_.value_lower, search.lower());
      result_.value_upper = std::min(result_.value_upper, search.upper());
    };
    const auto why = search.Run(options_.precision, [&](std::int64_t expansions) -> std::optional<SolverStatus> {
      account();
      Row(false);
      if (OutOfMemory(search.bytes())) return SolverStatus::kMemoryLimit;
      return Stop(expansions);
    });
    account();
    result_.status = why.value_or(SolverStatus::kConverged);
    const PointBasedPlan plan = search.Plan(false);
    for (const auto& [c, v] : plan.vectors) {
      const AlphaVector& vector = search.alphas(c)[v];
      FullAlphaVector full{vector.action, {}, least_reward_ / (1.0 - pomdp_.discount)};
      for (std::uint32_t i = 0; i < vector.values.size(); ++i) {
        full.values.push_back({states_[classes.classes[c].states[i]], vector.values[i]});
      }
      result_.alphas.push_back(std::move(full));
    }
    Keep(plan.controller, result_.value_lower);
    const PointBasedPlan relinked = search.Plan(true);
    if (relinked.controller.nodes.size() * relinked.largest_class <= kEvaluatedUnknowns) Offer(relinked.controller);
  }

  void Keep(const PomdpController& controller, double worth) {
    result_.controller = controller;
    worth_ = worth;
  }

  /// The best of the policies that always do the same.
  void KeepBlind() {
    if (result_.value_lower == -kUnbounded) return;
    std::uint32_t best = 0;
    double most = -kUnbounded;
    for (std::uint32_t a = 0; a < bounds_.blind.size(); ++a) {
      const double value = BestRow({bounds_.blind[a]}, pomdp_.start);
      if (value > most) most = value, best = a;
    }
    Keep({{{best, {}, 0}}, 0}, most);
  }

  /// Takes a controller if it is worth more than the one that is kept.
  void Offer(const PomdpController& controller) {
    const double give_up_s = GiveUp();
    const auto value = EvaluateController(pomdp_, controller, [&] { return GivenUp(give_up_s); });
    if (!value || value->value <= worth_) return;
    Keep(controller, value->value);
    result_.value_lower = std::max(result_.value_lower, worth_);
  }

  /// When a step of what follows a search is cut short.
  double GiveUp() {
    if (Cancelled()) return Wall() + kGrace_s;
    return std::min(std::max(Wall(), options_.time_limit_s) + kGrace_s, Wall() + std::max(2.0, 0.1 * Wall()));
  }
  bool GivenUp(double give_up_s) {
    return Wall() > give_up_s || (Cancelled() && Wall() > cancelled_at_s_ + 2.0 * kGrace_s);
  }

  /// The policy of a search: `action_of(b)` is an index into the actions of a belief, or negative where it is not
  /// known. There, where the policy comes with a probability below `rare`, and where it is cut short for being too
  /// large, it goes on blindly. Nothing where that would not reach a goal.
  template <class ActionOf>
  std::optional<PomdpController> Freeze(PomdpBeliefGraph& graph, ActionOf action_of, double rare = 0.0) {
    const double give_up_s = GiveUp();
    graph.SetStop([this, give_up_s] { return GivenUp(give_up_s); });
    std::optional<PomdpController> controller = FreezeUntil(graph, action_of, rare, give_up_s);
    StopWithSearch(graph);
    return controller;
  }

  /// A belief may take long to expand: there the search looks at its limits, too.
  void StopWithSearch(PomdpBeliefGraph& graph) {
    graph.SetStop([this] { return Stop(0).has_value(); });
  }

  template <class ActionOf>
  std::optional<PomdpController> FreezeUntil(PomdpBeliefGraph& graph, ActionOf action_of, double rare,
                                             double give_up_s) {
    BlindIncumbent blind(graph, bounds_);
    PomdpController controller;
    std::map<std::uint32_t, std::uint32_t> number;
    std::vector<std::uint32_t> beliefs;
    std::priority_queue<ToFreeze> open;
    const auto of = [&](std::uint32_t b, double probability) {
      const auto [found, added] = number.try_emplace(b, static_cast<std::uint32_t>(beliefs.size()));
      if (added) {
        open.push({probability, found->second});
        beliefs.push_back(b);
        controller.nodes.emplace_back();
      }
      return found->second;
    };
    of(graph.Start(), 1.0);
    while (!open.empty()) {
      const auto [probability, i] = open.top();
      open.pop();
      frozen_cut_ = beliefs.size() > kControllerNodes || GivenUp(give_up_s);
      int index = -1;
      try {
        if (!frozen_cut_ && probability >= rare) index = action_of(beliefs[i]);
      } catch (const Interrupted&) {
        frozen_cut_ = true;
      }
      PomdpController::Node node{0, {}, i};
      if (index < 0) {
        if (!blind.Solved(beliefs[i])) return std::nullopt;
        node.action = static_cast<std::uint32_t>(blind.Action(beliefs[i]));
      } else {
        const PomdpBeliefGraph::Action action = graph.Actions(beliefs[i])[static_cast<std::size_t>(index)];
        node.action = action.action;
        for (std::uint32_t k = 0; k < action.count; ++k) {
          const PomdpBeliefGraph::Successor next = graph.Successors(action)[k];
          node.branches.push_back({next.observation, of(next.belief, probability * next.share)});
        }
      }
      controller.nodes[i] = std::move(node);
    }
    return controller;
  }

  template <class Search>
  std::optional<SolverStatus> RunSearch(PomdpBeliefGraph& graph, Search search) {
    StopWithSearch(graph);
    try {
      return search();
    } catch (const Interrupted&) {
      return Stop(0).value_or(SolverStatus::kTimeLimit);
    }
  }

  /// The model and its bounds count, too.
  bool OutOfMemory(std::size_t search_bytes) const { return bytes_ + search_bytes > options_.memory_limit_bytes; }

  /// Initial beliefs that are goals already.
  bool Trivial(const PomdpBeliefGraph& graph) {
    if (!graph.Trivial()) return false;
    result_.value_lower = result_.value_upper = 0.0;
    Keep({{{}}, 0}, 0.0);
    return true;
  }

  void Certified() {
    PomdpBeliefGraph graph(pomdp_, bounds_, 0);
    if (Trivial(graph)) return;
    BlindIncumbent incumbent(graph, bounds_);
    const double least = std::max({graph.Heuristic(graph.Start()), options_.precision, 1e-9});
    BoundedSearch search(graph, incumbent, 1.0 + 0.5 * options_.precision / least);
    const auto account = [&](std::int64_t expansions) {
      result_.trials = search.trials();
      result_.expansions = expansions;
      result_.value_lower =
          std::max(result_.value_lower, graph.to_goal() - graph.start_share() * search.Upper(graph.Start()));
      result_.value_upper =
          std::min(result_.value_upper, graph.to_goal() - graph.start_share() * search.Lower(graph.Start()));
    };
    const auto stop = [&](std::int64_t expansions) -> std::optional<SolverStatus> {
      account(expansions);
      if (pomdp_.discount == 1.0 && search.trials() >= next_offer_) {
        next_offer_ = 2 * search.trials();
        OfferCyclic(graph, search, incumbent);
      }
      Row(false);
      if (result_.value_upper - result_.value_lower <= options_.precision) return SolverStatus::kConverged;
      if (OutOfMemory(graph.bytes() + search.bytes() + incumbent.bytes())) return SolverStatus::kMemoryLimit;
      return Stop(expansions);
    };
    const auto why = RunSearch(graph, [&] { return search.Run(graph.Start(), stop); });
    account(search.expansions());
    result_.beliefs = graph.size();
    result_.status = why.value_or(SolverStatus::kConverged);
    const double proven = graph.to_goal() - graph.start_share() * search.Upper(graph.Start());
    if (proven == -kUnbounded) return;
    const auto controller = Freeze(graph, [&](std::uint32_t b) { return search.Improved(b) ? search.Action(b) : -1; });
    if (!controller) return;
    // Unless it was cut short it is worth what is proven, which evaluating it may not show to the last digit.
    if (!frozen_cut_ && proven >= worth_) Keep(*controller, proven);
    Offer(*controller);
  }

  /// Following U never comes back to a belief, and may so never learn of a policy that must: the one that follows L is
  /// tried now and then.
  template <class Search>
  void OfferCyclic(PomdpBeliefGraph& graph, Search& search, BlindIncumbent& blind) {
    const auto controller = Freeze(graph, [&](std::uint32_t b) {
      if (!graph.expanded(b) && blind.Solved(b)) return -1;
      return Least(graph, b, [&](std::uint32_t next) { return search.Lower(next); });
    });
    if (controller) Offer(*controller);
  }

  void Rtdp() {
    PomdpBeliefGraph graph(pomdp_, bounds_, options_.levels);
    if (Trivial(graph)) return;
    if (options_.kind == PomdpSolverKind::kERtdpBel && options_.experience != nullptr) {
      StopWithSearch(graph);
      std::optional<PomdpExperience> experience;
      try {
        experience.emplace(graph, *options_.experience, options_.epsilon, kExperienceBeliefs,
                           [this] { return Stop(0).has_value(); });
      } catch (const Interrupted&) {
        result_.status = Stop(0).value_or(SolverStatus::kTimeLimit);
        return;
      }
      return RunRtdp(graph, [&](std::uint32_t b) { return (*experience)(b); });
    }
    RunRtdp(graph, [&](std::uint32_t b) { return options_.epsilon * graph.Heuristic(b); });
  }

  template <class Initial>
  void RunRtdp(PomdpBeliefGraph& graph, Initial initial) {
    RtdpBel search(graph, initial, options_.seed);
    const auto stop = [&](std::int64_t expansions) -> std::optional<SolverStatus> {
      result_.trials = search.trials();
      result_.expansions = expansions;
      Row(false);
      if (OutOfMemory(graph.bytes() + search.bytes())) return SolverStatus::kMemoryLimit;
      return Stop(expansions);
    };
    std::optional<SolverStatus> why;
    // Without discount evidence that discretised beliefs do not show would leave them without a way to a goal.
    const bool labelled = options_.levels == 0 || pomdp_.discount < 1.0;
    const bool exactly = options_.levels > 0 && (options_.exact_trials || !labelled);
    if (labelled) {
      why = RunLabelled(graph, search, exactly, stop);
      // The discretised model proves nothing: what its policy is worth is found by evaluating it on the POMDP itself.
      OfferAlso(Freeze(graph, [&](std::uint32_t b) {
        if (search.Solved(b)) return search.Action(b);
        return Least(graph, b, [&](std::uint32_t next) { return search.Value(next); });
      }));
    }
    if (exactly && !why) {
      why = RunSearch(graph, [&] { return search.RunExactly(options_.precision, kTrialWindow, stop); });
      if (pomdp_.discount == 1.0) OfferAlso(FreezeExact(graph, search, kRare));
      if (pomdp_.discount < 1.0 || !Stop(0)) OfferAlso(FreezeExact(graph, search, 0.0));
    }
    result_.status = why.value_or(SolverStatus::kConverged);
    result_.trials = search.trials();
    result_.expansions = search.expansions();
    result_.beliefs = graph.size();
    if (options_.simulate > 0 && result_.controller) {
      ControllerAgent agent(*result_.controller);
      result_.simulated = SimulatePomdp(
          pomdp_, agent, {.episodes = options_.simulate, .seed = options_.seed, .cancellation = options_.cancellation});
    }
  }

  /// Nothing where it converged, or where trials over the beliefs themselves are to follow and two thirds of the limits
  /// are used up: what is discretised too coarsely never converges.
  template <class Search, class SearchStop>
  std::optional<SolverStatus> RunLabelled(PomdpBeliefGraph& graph, Search& search, bool more_follows, SearchStop stop) {
    if (!more_follows) return RunSearch(graph, [&] { return search.Run(graph.Start(), stop); });
    const double until_s = Wall() + (options_.time_limit_s - Wall()) * 2.0 / 3.0;
    bool cut = false;
    const auto some = [&](std::int64_t expansions) -> std::optional<SolverStatus> {
      if (const auto why = stop(expansions)) return why;
      cut = expansions >= options_.expansion_limit / 3 * 2 || Wall() >= until_s;
      return cut ? std::optional(SolverStatus::kTimeLimit) : std::nullopt;
    };
    const auto why = RunSearch(graph, [&] { return search.Run(graph.Start(), some); });
    return cut ? std::nullopt : why;
  }

  void OfferAlso(const std::optional<PomdpController>& controller) {
    if (controller) Offer(*controller);
    if (!result_.controller) result_.controller = controller;
  }

  /// Greedy for the table of a search over discretised beliefs, from the beliefs themselves; blind where the search has
  /// not been, and where it comes with a probability below `rare`: what it knows there may go round for ever.
  template <class Search>
  std::optional<PomdpController> FreezeExact(const PomdpBeliefGraph& table, Search& search, double rare) {
    PomdpBeliefGraph exact(pomdp_, bounds_, 0);
    const auto greedy = [&](std::uint32_t b) {
      const std::uint32_t known = table.Find(exact.Belief(b));
      if (known == PomdpBeliefGraph::kNone || !search.Updated(known)) return -1;
      return Least(exact, b, [&](std::uint32_t next) {
        const std::uint32_t behind = table.Find(exact.Belief(next));
        return behind == PomdpBeliefGraph::kNone ? options_.epsilon * exact.Heuristic(next) : search.Value(behind);
      });
    };
    return Freeze(exact, greedy, rare);
  }

  /// The action of least cost; negative in a dead end.
  template <class Value>
  static int Least(PomdpBeliefGraph& graph, std::uint32_t b, Value value) {
    int best = -1;
    double least = kUnbounded;
    int index = 0;
    for (const PomdpBeliefGraph::Action& action : graph.Actions(b)) {
      double cost = action.cost;
      graph.ForEachShare(action, [&](std::uint32_t next, double share) { cost += share * value(next); });
      if (cost < least) least = cost, best = index;
      ++index;
    }
    return best;
  }

  const PomdpSolverOptions& options_;
  std::chrono::steady_clock::time_point start_;
  double cpu_start_s_ = 0.0;
  std::vector<std::uint32_t> states_;  ///< of the whole model
  Pomdp restricted_;                   ///< empty where all can be met
  const Pomdp& pomdp_;                 ///< what can be met of it
  double least_reward_ = 0.0;
  StateBounds bounds_;
  PomdpResult result_;
  double worth_ = -kUnbounded;  ///< of result_.controller, at least
  bool frozen_cut_ = false;     ///< the last controller out of Freeze goes on blindly for being too large
  std::int64_t next_offer_ = 1;
  std::size_t bytes_ = 0;         ///< of what is there before the search
  double cancelled_at_s_ = -1.0;  ///< when that was seen first; negative: not cancelled
  double next_row_s_ = 0.0;
};

}  // namespace

std::string_view ToString(PomdpSolverKind kind) {
  switch (kind) {
    case PomdpSolverKind::kPointBased: return "point-based";
    case PomdpSolverKind::kCertified: return "certified";
    case PomdpSolverKind::kRtdpBel: return "rtdp-bel";
    case PomdpSolverKind::kERtdpBel: return "e-rtdp-bel";
  }
  return "?";
}

void Validate(const PomdpSolverOptions& options) {
  const auto require = [](bool holds, const char* option, const char* what) {
    if (!holds) throw InputError(option, what, "see feeler solve --help");
  };
  require(options.precision > 0.0 && std::isfinite(options.precision), "--precision", "must be above 0");
  require(options.levels >= 0 && options.levels <= 1'000'000, "--levels", "must be 0 to 1000000");
  require(options.epsilon >= 1.0 && std::isfinite(options.epsilon), "--epsilon", "must be at least 1");
  require(options.time_limit_s > 0.0, "--time-limit", "must be above 0");
  require(options.expansion_limit >= 1, "--expansion-limit", "must be at least 1");
  require(options.simulate >= 0, "--simulate", "must be at least 0");
}

PomdpResult SolvePomdp(const Pomdp& pomdp, const PomdpSolverOptions& options) {
  Validate(options);
  RequireSolvable(pomdp);
  if (options.kind == PomdpSolverKind::kPointBased && pomdp.discount == 1.0) {
    throw InputError("--solver point-based", "the discount is 1", "take certified");
  }
  if (options.experience != nullptr) Validate(pomdp, *options.experience, "experience");
  return Attempt(pomdp, options).Run();
}

}  // namespace feeler::planner
