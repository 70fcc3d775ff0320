#include "feeler/planner/noise/solve_noisy.h"

#include <algorithm>
#include <limits>

#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/noise/confirmed_policy.h"
#include "feeler/planner/noise/noisy_bound.h"
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

class NoisyRun {
 public:
  NoisyRun(const NoisyProblem& noisy, const SolverOptions& options)
      : options_(options),
        watch_(options),
        bound_(noisy),
        tables_(BuildPlanningTables(noisy.problem, options)),
        graph_(noisy, [this](const Cell& robot, auto belief) { return bound_(robot, belief); }),
        first_(graph_, *tables_) {}

  NoisyResult Run() {
    result_.lower_bound = graph_.Heuristic(graph_.Start());
    if (options_.cancellation == nullptr || !options_.cancellation->cancelled()) {
      first_.Run([this](std::int64_t expansions) { return Stop(expansions); });
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
  std::optional<SolverStatus> Stop(std::int64_t expansions) {
    if (bound_.bytes() + graph_.bytes() > options_.memory_limit_bytes) return SolverStatus::kMemoryLimit;
    return watch_.Stop(expansions);
  }

  void Row(double upper) {
    if (!options_.on_bounds) return;
    options_.on_bounds({watch_.wall_s(), result_.trials, result_.expansions, result_.lower_bound, upper});
  }

  template <class MoveOf>
  void Freeze(MoveOf move_of) {
    result_.policy = FreezeNoisyPolicy(graph_, move_of, kLeastReach, &result_.evaluation);
    // What is reported takes nothing from beliefs.
    const std::vector<double> costs = ReplayNoisyPolicy(graph_.noisy(), result_.policy);
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t h = 0; h < costs.size(); ++h) {
      const double weight = graph_.noisy().problem.hypotheses[h].weight;
      sum += weight * costs[h];
      weights += weight;
    }
    result_.evaluation.expected_cost = sum / weights;
  }

  void Certified() {
    BoundedSearch search(graph_, first_, options_.gap);
    const auto account = [&](std::int64_t expansions) {
      result_.trials = search.trials();
      result_.expansions = expansions;
      result_.lower_bound = std::max(result_.lower_bound, search.Lower(graph_.Start()));
    };
    const auto why = search.Run(graph_.Start(), [&](std::int64_t expansions) -> std::optional<SolverStatus> {
      account(expansions);
      if (watch_.RowDue()) Row(search.Upper(graph_.Start()));
      return Stop(expansions);
    });
    account(search.expansions());
    result_.status = why.value_or(SolverStatus::kGap);
    Freeze([&](std::uint32_t b) {
      return search.Improved(b) ? graph_.Actions(b)[static_cast<std::size_t>(search.Action(b))].move : first_.Move(b);
    });
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
      return Stop(result_.expansions);
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
  std::shared_ptr<const PlanningTables> tables_;
  NoisyBeliefGraph graph_;
  ConfirmedPolicy first_;
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
