#include "feeler/planner/solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/leaving/leaving_bound.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/policy/fit_workspace.h"
#include "feeler/planner/policy/freeze_policy.h"
#include "feeler/planner/policy/indistinguishable.h"
#include "feeler/planner/search/bounded_search.h"
#include "feeler/planner/search/experience.h"
#include "feeler/planner/search/fewest_moves.h"
#include "feeler/planner/search/greedy_completion.h"
#include "feeler/planner/search/open_policy.h"
#include "feeler/planner/search/random_judgement.h"
#include "feeler/planner/search/rtdp_bel.h"
#include "feeler/planner/search/stop_watch.h"

namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Up to so many hypotheses the greedy policy is tried beside the one for openings.
constexpr std::uint32_t kGreedyBesideOpen = 256;
/// Where hypotheses have orientations, which makes the heuristic loose: at most so many further greedy policies, and
/// the inflation of the heuristic in the guess of BoundedSearch.
constexpr std::uint64_t kFurtherPolicies = 120;
constexpr double kGuessInflation = 1.3;

/// epsilon * heur, times the weight of the belief.
struct InflatedHeuristic {
  const BeliefGraph* graph = nullptr;
  double epsilon = 1.0;
  double operator()(BeliefId b) const { return epsilon * graph->Heuristic(b); }
};

/// One attempt at a problem: the belief graph, the clocks, and what every solver does with them.
class SolveRun {
 public:
  SolveRun(const Problem& problem, const SolverOptions& options, const PlanningTables& tables,
           const Experience& experience, bool canonical)
      : options_(options),
        experience_(experience),
        tables_(tables),
        watch_(options),
        graph_(problem, tables.masks(), canonical) {
    heuristic_ = tables.MakeHeuristic(problem, graph_.sets());
    if (options.solver == SolverKind::kCertified && options.heuristic == HeuristicKind::kCertificate &&
        LeavingBound::Fits(problem)) {
      heuristic_ = std::make_unique<WithLeavingBound>(problem, graph_.sets(), std::move(heuristic_));
    }
    graph_.SetHeuristic(heuristic_.get());
    result_.expected_cost = kInfinity;
  }

  SolverResult Run() {
    start_ = graph_.Start();
    if (start_ == kNoBelief) {
      result_.policy = FreezePolicy(graph_, [](BeliefId) { return GuardedMove(); });
    } else {
      weight_ = graph_.Weight(start_);
      switch (options_.solver) {
        case SolverKind::kCertified: RunCertified(); break;
        case SolverKind::kRtdpBel: RunRtdpBel(Inflated(options_.epsilon)); break;
        case SolverKind::kERtdpBel: RunERtdpBel(); break;
      }
    }
    Finish();
    return std::move(result_);
  }

 private:
  InflatedHeuristic Inflated(double epsilon) const { return {&graph_, epsilon}; }

  std::optional<SolverStatus> Stop(std::int64_t expansions) {
    if (graph_.bytes() + heuristic_->bytes() > options_.memory_limit_bytes) return SolverStatus::kExpansionLimit;
    return watch_.Stop(expansions);
  }

  /// RTDP-Bel with heur^E in place of epsilon * heur.
  void RunERtdpBel() {
    if (experience_.kind == ExperienceKind::kNone || experience_.policy == nullptr) {
      return RunRtdpBel(Inflated(options_.epsilon));
    }
    ExperienceMdp mdp = experience_.kind == ExperienceKind::kRollout
                            ? RollOut(graph_, *experience_.policy)
                            : Transplant(graph_, *experience_.problem, *experience_.policy);
    ExperienceHeuristic heuristic(graph_, std::move(mdp), options_.epsilon, options_.jumps);
    RunRtdpBel([&](BeliefId b) { return graph_.Weight(b) * heuristic(b); });
  }

  template <class Initial>
  void RunRtdpBel(Initial initial) {
    RtdpBel search(graph_, initial, options_.seed);
    const auto lower = [&] {
      return std::max(search.Lower(start_), search.Value(start_) / options_.epsilon) / weight_;
    };
    const auto why = search.Run(start_, [&](std::int64_t expansions) {
      if (watch_.RowDue()) Row(search.trials(), expansions, lower(), kInfinity);
      return Stop(expansions);
    });
    result_.lower_bound = lower();
    result_.trials = search.trials();
    result_.expansions = search.expansions();
    if (why) {
      result_.status = *why;
    } else {
      result_.policy = Freeze(search);
    }
  }

  /// A first policy, then BoundedSearch until the gap is closed. A complete policy comes first: it is not interrupted
  /// by limits.
  void RunCertified() {
    result_.lower_bound = graph_.Heuristic(start_) / weight_;
    if (graph_.problem().generous_workspace && tables_.filled().bound) {
      const double bound = tables_.filled().bound->Weighted(graph_.sets(), graph_.set(start_), graph_.robot(start_));
      result_.lower_bound = std::max(result_.lower_bound, bound / weight_);
    }
    GreedyCompletion greedy(graph_, Estimate());
    if (const std::optional<Problem> filled = WithoutDeadEnds()) {
      // Dead ends make beliefs many and the greedy choice short-sighted (it looks into them one by one).
      BeliefGraph filled_graph(*filled, tables_.filled().tables->masks(), graph_.canonical());
      const auto heuristic = tables_.filled().tables->MakeHeuristic(*filled, filled_graph.sets());
      filled_graph.SetHeuristic(heuristic.get());
      OpenPolicy open(graph_, filled_graph, *tables_.filled().bound, greedy);
      open.Run(start_);
      if (graph_.sets().info(graph_.set(start_)).size <= kGreedyBesideOpen || !open.Solved(start_)) Complete(greedy);
      if (open.Solved(start_)) CloseGap(open, 0);
    } else if (Complete(greedy)) {
      if (Oriented()) Improve(greedy);
      CloseGap(greedy, 0);
    }
  }

  std::function<double(BeliefId)> Estimate() {
    if (options_.heuristic != HeuristicKind::kCuboids) return {};
    return [this](BeliefId b) { return heuristic_->Estimate(graph_.set(b), graph_.robot(b)); };
  }

  /// False, and says so in the result, if some hypotheses cannot be told apart.
  bool Complete(GreedyCompletion<BeliefGraph>& greedy) {
    if (!greedy.Run(start_, [](std::int64_t) { return std::optional<SolverStatus>(); })) return true;
    result_.status = SolverStatus::kUnlocalizable;
    result_.expansions = greedy.expansions();
    result_.lower_bound = kInfinity;
    result_.indistinguishable = IndistinguishablePairs(graph_.problem(), tables_.masks());
    return false;
  }

  bool Oriented() const { return graph_.problem().map->orientations() > 1; }

  /// Further policies while the gap is open, with up to half of the budget: with orientations the first may be far off.
  void Improve(GreedyCompletion<BeliefGraph>& greedy) {
    const auto stop = [this](std::int64_t expansions) -> std::optional<SolverStatus> {
      if (expansions >= options_.expansion_limit / 2) return SolverStatus::kExpansionLimit;
      return Stop(expansions);
    };
    for (std::uint64_t number = 0; number < kFurtherPolicies; ++number) {
      if (greedy.Value(start_) <= options_.gap * result_.lower_bound * weight_) return;
      if (greedy.Run(start_, stop, RandomJudgement(graph_, options_.seed, number))) return;
    }
  }

  /// The problem on the map whose dead ends are filled; none where there are none, or the tool is in one.
  std::optional<Problem> WithoutDeadEnds() {
    const Problem& problem = graph_.problem();
    if (!problem.generous_workspace || !tables_.filled().bound) return std::nullopt;
    Problem without = problem;
    without.map = tables_.filled().map;
    for (const Hypothesis& h : problem.hypotheses) {
      if (Blocked(without, problem.start, h)) return std::nullopt;
    }
    return without;
  }

  template <class Incumbent>
  void CloseGap(Incumbent& incumbent, std::int64_t expansions_before) {
    BoundedSearch search(graph_, incumbent, options_.gap, Oriented() ? kGuessInflation : 1.0);
    const auto lower = [&] { return std::max(result_.lower_bound, search.Lower(start_) / weight_); };
    const auto why = search.Run(start_, [&](std::int64_t searched) -> std::optional<SolverStatus> {
      const double upper = search.Upper(start_) / weight_;
      if (watch_.RowDue()) Row(result_.trials + search.trials(), searched + expansions_before, lower(), upper);
      if (upper <= options_.gap * lower()) return SolverStatus::kGap;
      return Stop(searched + expansions_before);
    });
    result_.lower_bound = lower();
    result_.trials += search.trials();
    result_.expansions = search.expansions() + expansions_before;
    result_.status = why.value_or(SolverStatus::kGap);
    result_.policy = Freeze(search);
    if (result_.policy->expected_cost <= result_.lower_bound * (1.0 + 1e-9) + 1e-9) {
      result_.status = SolverStatus::kConverged;
    }
  }

  /// The policy that a search found, with as few moves as its cost allows.
  template <class Search>
  PolicyGraph Freeze(Search& search) {
    const MoveMap moves = FewestMoves(graph_, [&](BeliefId b) {
      const BeliefAction& action = graph_.Actions(b)[static_cast<std::size_t>(search.Action(b))];
      return GuardedMove{action.direction, action.cells};
    });
    return FreezePolicy(graph_, [&](BeliefId b) { return moves.at(b); });
  }

  void Row(std::int64_t trials, std::int64_t expansions, double lower, double upper) {
    options_.on_bounds({watch_.wall_s(), trials, expansions, lower, upper});
  }

  void Finish() {
    if (result_.policy) {
      result_.expected_cost = result_.policy->expected_cost;
      result_.lower_bound = std::min(result_.lower_bound, result_.expected_cost);  // rounding
      result_.policy->lower_bound = result_.lower_bound;
    }
    if (options_.on_bounds) Row(result_.trials, result_.expansions, result_.lower_bound, result_.expected_cost);
    result_.wall_s = watch_.wall_s();
    result_.cpu_s = watch_.cpu_s();
  }

  const SolverOptions& options_;
  const Experience& experience_;
  const PlanningTables& tables_;
  StopWatch watch_;
  BeliefGraph graph_;
  std::unique_ptr<BeliefHeuristic> heuristic_;
  BeliefId start_ = kNoBelief;
  double weight_ = 1.0;
  SolverResult result_;
};

}  // namespace

std::string_view ToString(SolverStatus status) {
  switch (status) {
    case SolverStatus::kConverged: return "converged";
    case SolverStatus::kGap: return "gap";
    case SolverStatus::kTimeLimit: return "time_limit";
    case SolverStatus::kExpansionLimit: return "expansion_limit";
    case SolverStatus::kCancelled: return "cancelled";
    case SolverStatus::kUnlocalizable: return "unlocalizable";
  }
  return "?";
}

std::string_view ToString(ExperienceKind kind) {
  switch (kind) {
    case ExperienceKind::kRollout: return "rollout";
    case ExperienceKind::kNaive: return "naive";
    case ExperienceKind::kNone: return "none";
  }
  return "?";
}

double SolverResult::Ratio() const {
  if (!policy) return kInfinity;
  if (lower_bound > 0.0) return expected_cost / lower_bound;
  return expected_cost > 0.0 ? kInfinity : 1.0;
}

SolverResult Solve(const Problem& problem, const SolverOptions& options, std::shared_ptr<const PlanningTables> tables,
                   const Experience& experience) {
  Validate(problem);
  Validate(options);
  if (experience.kind == ExperienceKind::kNaive && experience.policy != nullptr && experience.problem == nullptr) {
    throw InputError("experience", "a naive experience needs the problem its policy was made for",
                     "pass the problem too");
  }
  if (!tables) tables = BuildPlanningTables(problem, options);
  const bool canonical =
      options.canonical_translation && problem.generous_workspace && options.solver != SolverKind::kERtdpBel;
  if (!problem.generous_workspace) {
    SolverResult result;
    result.indistinguishable = IndistinguishablePairs(problem, tables->masks());
    if (!result.indistinguishable.empty()) {
      result.status = SolverStatus::kUnlocalizable;
      result.expected_cost = kInfinity;
      result.lower_bound = kInfinity;
      return result;
    }
  }
  SolverResult result = SolveRun(problem, options, *tables, experience, canonical).Run();
  if (canonical && result.policy && !StaysInWorkspace(problem, *result.policy)) {
    // Further actions may cost something: what was promised must still hold.
    const double factor = options.solver == SolverKind::kCertified ? options.gap : options.epsilon;
    std::optional<PolicyGraph> fitted = FitIntoWorkspace(problem, *result.policy);
    if (fitted && (fitted->expected_cost <= result.expected_cost * (1.0 + 1e-12) ||
                   fitted->expected_cost <= factor * result.lower_bound)) {
      result.expected_cost = fitted->expected_cost;
      result.policy = std::move(fitted);
      return result;
    }
    result = SolveRun(problem, options, *tables, experience, false).Run();
  }
  return result;
}

}  // namespace feeler::planner
