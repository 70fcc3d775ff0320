#include "feeler/planner/noise/solve_noisy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/noise/confirmed_policy.h"
#include "feeler/planner/noise/noisy_bound.h"
#include "feeler/planner/noise/noisy_point_search.h"
#include "feeler/planner/search/bounded_search.h"
#include "feeler/planner/search/rtdp_bel.h"
#include "feeler/planner/search/stop_watch.h"

namespace feeler::planner {
namespace {

/// Beliefs that a policy reaches more rarely end where it is written out.
constexpr double kLeastReach = 1e-9;
/// What taking beliefs for one that agree to 1e-9 may raise a lower bound by, as a share of the cost of being wrong: a
/// hundred moves' worth.
constexpr double kMerged = 1e-7;
/// Up to so many hypotheses bounds are shared between beliefs where exact beliefs have not closed the gap within so
/// many expansions. That closes so much of the gap asked for: a policy that must be surer costs the rest.
constexpr std::size_t kFewHypotheses = 64;
constexpr std::int64_t kBeforeSharing = 3000;
constexpr double kSharedShare = 0.5;
constexpr std::uint32_t kRaisedBeforeStop = 16;
/// The ends of a policy have a probability of 1 in all, up to this, which is rounding.
constexpr double kEnds = 1e-8;

/// Of a time limit so much is kept for the policy, at most so many seconds. Its replay takes about so much CPU time a
/// node and hypothesis.
constexpr double kKeptShare = 0.2;
constexpr double kMostKept_s = 5.0;
constexpr double kReplay_s = 6e-8;

/// A policy that was written out, beside the first one, as an incumbent of BoundedSearch.
class FrozenPolicy {
 public:
  explicit FrozenPolicy(const ConfirmedPolicy& first) : first_(first) {}

  void Set(const NoisyPolicy& policy, const std::vector<std::uint32_t>& beliefs) {
    known_.clear();
    for (std::size_t n = 0; n < beliefs.size(); ++n) {
      known_[beliefs[n]] = {policy.nodes[n].expected_cost, policy.nodes[n].move};
    }
  }
  bool Solved(std::uint32_t /*b*/) const { return true; }
  double Value(std::uint32_t b) const {
    const Known* known = Better(b);
    return known != nullptr ? known->value : first_.Value(b);
  }
  int Action(std::uint32_t /*b*/) const { return 0; }  ///< to be asked for by Move
  GuardedMove Move(std::uint32_t b) const {
    const Known* known = Better(b);
    return known != nullptr ? known->move : first_.Move(b);
  }
  std::int64_t expansions() const { return first_.expansions(); }
  std::size_t bytes() const { return first_.bytes() + known_.size() * (sizeof(Known) + 32); }

 private:
  struct Known {
    double value = 0.0;
    GuardedMove move;
  };
  const Known* Better(std::uint32_t b) const {
    const auto found = known_.find(b);
    return found != known_.end() && found->second.value < first_.Value(b) ? &found->second : nullptr;
  }

  const ConfirmedPolicy& first_;
  std::unordered_map<std::uint32_t, Known> known_;
};

class NoisyRun {
 public:
  NoisyRun(const NoisyProblem& noisy, const SolverOptions& options)
      : options_(options),
        watch_(options),
        bound_(noisy),
        tables_(BuildPlanningTables(noisy.problem, options)),
        graph_(noisy, [this](const Cell& robot, auto belief) { return BoundOf(robot, belief); }),
        first_(graph_, *tables_),
        incumbent_(first_) {}

  NoisyResult Run() {
    result_.lower_bound = graph_.Heuristic(graph_.Start());
    result_.evaluation.expected_cost = std::numeric_limits<double>::infinity();
    if (options_.cancellation == nullptr || !options_.cancellation->cancelled()) {
      first_.Run([this](std::int64_t expansions) { return Stop(expansions, 0); });
    }
    if (options_.solver == SolverKind::kCertified) {
      Certified();
    } else {
      Rtdp();
    }
    const double lower = result_.lower_bound - kMerged * graph_.noisy().WrongCost();
    result_.lower_bound = std::clamp(lower, 0.0, result_.evaluation.expected_cost);
    result_.beliefs = graph_.size();
    Row(result_.evaluation.expected_cost);
    result_.wall_s = watch_.wall_s();
    result_.cpu_s = watch_.cpu_s();
    return std::move(result_);
  }

 private:
  double BoundOf(const Cell& robot, std::span<const WeightedHypothesis> belief) {
    const double bound = bound_(robot, belief);
    return sharing_over_ ? std::max(bound, shared_->LowerOf(robot, belief)) : bound;
  }

  /// The time limits but for what is kept for the policy. Reads the clocks: a backup of a large belief takes
  /// milliseconds.
  bool Late() const {
    const auto over = [](double used_s, double limit_s) {
      return std::isfinite(limit_s) && used_s >= limit_s - std::min(kKeptShare * limit_s, kMostKept_s);
    };
    return over(watch_.wall_s(), options_.time_limit_s) || over(watch_.cpu_s(), options_.cpu_limit_s);
  }
  /// No time is left but for the replay of a policy of so many nodes.
  bool LateFor(std::size_t nodes) const {
    const double replay_s = kReplay_s * static_cast<double>(nodes * graph_.noisy().problem.hypotheses.size());
    const double waits = std::max(1.0, watch_.wall_s() / std::max(1e-3, watch_.cpu_s()));
    return watch_.wall_s() + waits * replay_s >= options_.time_limit_s ||
           watch_.cpu_s() + replay_s >= options_.cpu_limit_s;
  }

  std::optional<SolverStatus> Stop(std::int64_t expansions, std::size_t search_bytes) {
    const std::size_t bytes = bound_.bytes() + graph_.bytes() + first_.bytes() + search_bytes;
    if (bytes + (shared_ ? shared_->bytes() : 0) > options_.memory_limit_bytes) return SolverStatus::kMemoryLimit;
    if (Late()) return SolverStatus::kTimeLimit;
    return watch_.Stop(expansions);
  }

  void Row(double upper) {
    if (!options_.on_bounds) return;
    options_.on_bounds({watch_.wall_s(), result_.trials, result_.expansions, result_.lower_bound, upper});
  }

  /// Writes a policy out and keeps it if it is the cheapest so far.
  template <class MoveOf>
  void Freeze(MoveOf move_of) {
    NoisyEvaluation evaluation;
    std::vector<std::uint32_t> beliefs;
    NoisyPolicy policy = FreezeNoisyPolicy(graph_, move_of, kLeastReach, &evaluation, &beliefs,
                                           [this](std::size_t nodes) { return LateFor(nodes); });
    // A policy that went round for nothing would give up some time.
    const double endless = 1.0 - evaluation.right - evaluation.wrong - evaluation.given_up;
    const double never = endless > kEnds ? endless : 0.0;
    evaluation.given_up += never;
    const bool kept = std::isfinite(result_.evaluation.expected_cost);
    // What is reported takes nothing from beliefs.
    const std::vector<double> costs = ReplayNoisyPolicy(graph_.noisy(), policy);
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t h = 0; h < costs.size(); ++h) {
      const double weight = graph_.noisy().problem.hypotheses[h].weight;
      sum += weight * costs[h];
      weights += weight;
    }
    evaluation.expected_cost = sum / weights + never * graph_.noisy().WrongCost();
    if (kept && evaluation.expected_cost >= result_.evaluation.expected_cost) return;
    incumbent_.Set(policy, beliefs);
    result_.policy = std::move(policy);
    result_.evaluation = evaluation;
  }

  bool Closed() const { return result_.evaluation.expected_cost <= options_.gap * result_.lower_bound; }

  /// Bounded search over exact beliefs from the best policy known, until the gap is closed (nothing), after `most`
  /// expansions, or when a limit holds.
  std::optional<SolverStatus> CloseGap(std::int64_t most) {
    BoundedSearch search(graph_, incumbent_, options_.gap);
    const std::int64_t trials = result_.trials;
    const std::int64_t before = expansions_;
    const auto account = [&] {
      result_.trials = trials + search.trials();
      expansions_ = before + search.expansions() - incumbent_.expansions();
      result_.expansions = first_.expansions() + expansions_;
      result_.lower_bound = std::max(result_.lower_bound, search.Lower(graph_.Start()));
    };
    const auto why = search.Run(graph_.Start(), [&](std::int64_t) -> std::optional<SolverStatus> {
      account();
      if (watch_.RowDue()) Row(search.Upper(graph_.Start()));
      if (expansions_ - before >= most) return SolverStatus::kExpansionLimit;
      return Stop(result_.expansions, search.bytes() + incumbent_.bytes());
    });
    account();
    Freeze([&](std::uint32_t b) {
      return search.Improved(b) ? graph_.Actions(b)[static_cast<std::size_t>(search.Action(b))].move
                                : incumbent_.Move(b);
    });
    return why;
  }

  /// The plans of the shared bounds; where they declare and may not, as the first policy does until they may.
  void FreezeShared() {
    Freeze([&](std::uint32_t b) {
      const GuardedMove move = shared_->Move(b);
      if (move.cells > 0 || graph_.Declared(b) >= 0) return move;
      return first_.Choose(b, [](std::int64_t) { return std::nullopt; });
    });
  }

  /// Shared bounds until they, or the policy that they make, are within the gap.
  std::optional<SolverStatus> Share() {
    shared_.emplace(graph_, bound_);
    shared_->SetClock([this] { return Late(); });
    const std::int64_t trials = result_.trials;
    const std::int64_t before = expansions_;
    std::int64_t next_policy = 1;
    const auto account = [&] {
      result_.trials = trials + shared_->trials();
      expansions_ = before + shared_->expansions();
      result_.expansions = first_.expansions() + expansions_;
      result_.lower_bound = std::max(result_.lower_bound, shared_->Lower(graph_.Start()));
    };
    const double inner = 1.0 + kSharedShare * (options_.gap - 1.0);
    const auto why = shared_->Run(inner, [&](std::int64_t) -> std::optional<SolverStatus> {
      account();
      if (watch_.RowDue()) Row(std::min(shared_->Upper(graph_.Start()), result_.evaluation.expected_cost));
      const bool may = shared_->Upper(graph_.Start()) <= options_.gap * result_.lower_bound;
      if (may && shared_->trials() >= next_policy) {
        next_policy = shared_->trials() + shared_->trials() / 4 + 1;
        FreezeShared();
        if (Closed()) return SolverStatus::kGap;
      }
      return Stop(result_.expansions, incumbent_.bytes());
    });
    account();
    if (why != SolverStatus::kGap) FreezeShared();
    if (why == SolverStatus::kGap || why == SolverStatus::kRounding) return std::nullopt;
    return why;
  }

  void Certified() {
    const bool few = graph_.noisy().problem.hypotheses.size() <= kFewHypotheses;
    auto why = CloseGap(few ? kBeforeSharing : std::numeric_limits<std::int64_t>::max());
    if (few && why == SolverStatus::kExpansionLimit && !Stop(result_.expansions, 0)) {
      why = Share();
      if (!why && !Closed()) {
        sharing_over_ = true;
        for (std::uint32_t b = 0; b < graph_.size() && !why; ++b) {
          graph_.RaiseHeuristic(b, shared_->Lower(b));
          if (b % kRaisedBeforeStop == 0) why = Stop(result_.expansions, incumbent_.bytes());
        }
        if (!why) why = CloseGap(std::numeric_limits<std::int64_t>::max());
      }
    }
    result_.status = why.value_or(SolverStatus::kGap);
    const double apart = result_.evaluation.expected_cost - result_.lower_bound;
    if (!why && apart <= 2.0 * kMerged * graph_.noisy().WrongCost()) {
      result_.status = SolverStatus::kConverged;
    }
  }

  void Rtdp() {
    RtdpBel search(
        graph_, [&](std::uint32_t b) { return options_.epsilon * graph_.Heuristic(b); }, options_.seed);
    const auto why = search.Run(graph_.Start(), [&](std::int64_t expansions) -> std::optional<SolverStatus> {
      result_.trials = search.trials();
      result_.expansions = first_.expansions() + expansions;
      result_.lower_bound = std::max(result_.lower_bound, search.Lower(graph_.Start()));
      if (watch_.RowDue()) Row(first_.Value(graph_.Start()));
      return Stop(result_.expansions, search.bytes());
    });
    result_.lower_bound = std::max(result_.lower_bound, search.Lower(graph_.Start()));
    result_.status = why.value_or(SolverStatus::kConverged);
    Freeze([&](std::uint32_t b) {
      if (!search.Solved(b)) return first_.Move(b);
      return graph_.Actions(b)[static_cast<std::size_t>(search.Action(b))].move;
    });
  }

  const SolverOptions& options_;
  StopWatch watch_;
  NoisyBound bound_;
  std::optional<NoisyPointSearch> shared_;
  bool sharing_over_ = false;  ///< beliefs met from now on begin with its bounds
  std::shared_ptr<const PlanningTables> tables_;
  NoisyBeliefGraph graph_;
  ConfirmedPolicy first_;
  FrozenPolicy incumbent_;
  std::int64_t expansions_ = 0;  ///< of the searches
  NoisyResult result_;
};

}  // namespace

double NoisyResult::Ratio() const {
  if (lower_bound > 0.0) return evaluation.expected_cost / lower_bound;
  return evaluation.expected_cost > 0.0 ? std::numeric_limits<double>::infinity() : 1.0;
}

NoisyResult SolveNoisy(const NoisyProblem& noisy, const SolverOptions& options) {
  Validate(noisy);
  Validate(options);
  return NoisyRun(noisy, options).Run();
}

}  // namespace feeler::planner
