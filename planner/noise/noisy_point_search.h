#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "feeler/planner/noise/noisy_belief_graph.h"
#include "feeler/planner/noise/noisy_bound.h"
#include "feeler/planner/noise/noisy_outcomes.h"
#include "feeler/planner/options/solver_result.h"

namespace feeler::planner {

/// Bounds that beliefs of one cell share, for noisy problems of few hypotheses: point-based search between two bounds
/// (after HSVI, Smith and Simmons 2004) on the *relaxed* problem, in which a declaration may be made at any probability
/// and pays for being wrong. Its optimum is at most that of the problem (a policy that must be surer is one of it), and
/// the same where the best policy declares nothing below the confidence asked for.
///
/// U(b) = min over vectors of sum b(h) vector(h): a vector holds the cost of one plan under each hypothesis, whatever
/// the belief. L(b): V is concave, and superadditive over weights (docs/planner.md, "Noise"): with a belief b' whose
/// bound L' is known and the largest s with s b' <= b, V(b) >= s L' + bound(b - s b'). Readings repeated in another
/// order give beliefs that differ in the weights by a little: what is found for one holds for the others, nearly.
class NoisyPointSearch {
 public:
  /// Everything must outlive the search.
  NoisyPointSearch(NoisyBeliefGraph& graph, NoisyBound& bound);

  /// Trials are long: `late`, asked after each update, ends one early.
  void SetClock(std::function<bool()> late) { late_ = std::move(late); }

  /// Trials until U <= gap L at the start (nothing), or `stop(expansions)` says why not to go on. May be called again.
  /// `rounding`: trials change nothing any more.
  template <class Stop>
  std::optional<SolverStatus> Run(double gap, Stop stop) {
    while (Upper(graph_.Start()) > gap * Lower(graph_.Start()) + kNothing) {
      if (const auto why = stop(expansions_)) return why;
      if (!Trial(gap)) return late_ && late_() ? SolverStatus::kTimeLimit : SolverStatus::kRounding;
    }
    return std::nullopt;
  }

  double Lower(std::uint32_t b) { return Refreshed(b).lower; }
  double Upper(std::uint32_t b) { return Refreshed(b).upper; }
  /// What the best plan known for the belief begins with; cells = 0: a declaration of the likeliest set. What follows
  /// is no worse than the plan foresees if the moves are asked for from the start on.
  GuardedMove Move(std::uint32_t b);
  /// L of a belief that need not be one of the graph's.
  double LowerOf(const Cell& robot, std::span<const WeightedHypothesis> belief);
  std::int64_t trials() const { return trials_; }
  std::int64_t expansions() const { return expansions_; }  ///< beliefs that were backed up
  std::size_t bytes() const;

 private:
  static constexpr double kNothing = 1e-9;
  static constexpr std::int32_t kDeclares = -1;
  struct State {
    double lower = -1.0;  ///< negative: not met yet
    double upper = 0.0;
    std::int32_t best = kDeclares;          ///< vector of its cell
    std::uint32_t vectors = 0, points = 0;  ///< so many of its cell have been looked at
    bool backed_up = false;
  };
  /// The cost of a plan under each hypothesis.
  struct Vector {
    GuardedMove move;
    std::vector<double> costs;
    std::vector<std::pair<Outcome, std::int32_t>> next;  ///< the plan goes on with: vectors of the cell come to
  };
  struct Share {
    std::uint32_t hypothesis = 0;
    double inverse = 0.0;  ///< 1 / weight
  };
  struct Point {
    std::uint32_t belief = 0;
    double lower = 0.0;
    std::vector<Share> shares;  ///< the heaviest first: most beliefs fail there
  };
  /// Numbers of vectors and points stay; those that are of no use are no longer looked at.
  struct CellBounds {
    std::vector<Vector> vectors;
    std::vector<Point> points;
    std::vector<std::uint32_t> looked_vectors, looked_points;  ///< ascending
    std::vector<std::uint32_t> backed_up;                      ///< beliefs
    std::size_t kept_vectors = 0, kept_points = 0;             ///< by the last pruning
  };

  CellBounds& At(const Cell& robot);
  State& Known(std::uint32_t b);
  State& Refreshed(std::uint32_t b);
  /// s L' + bound(b - s b') of a point, where that may be more than `known`; else 0. The belief is in dense_, too.
  double ByPoint(const Point& point, const Cell& robot, std::span<const WeightedHypothesis> belief, double known);
  void Prune(CellBounds& cell);
  /// One trial from the start; false if it changed nothing.
  bool Trial(double gap);
  /// Backs up both bounds; returns the action of least L.
  std::size_t Update(std::uint32_t b);
  void AddVector(std::uint32_t b, const GuardedMove& move);
  /// Takes a vector for a belief if it is better than what is known.
  void Offer(std::uint32_t b, std::int32_t vector);
  void AddPoint(std::uint32_t b, double lower);
  std::uint32_t WidestSuccessor(std::uint32_t b, std::size_t action, double width);
  double CostUnder(std::uint32_t b, std::int32_t vector, std::uint32_t hypothesis);

  NoisyBeliefGraph& graph_;
  NoisyBound& bound_;
  NoisyMoves moves_;
  double wrong_cost_;
  std::vector<CellBounds> cells_;
  std::vector<State> states_;
  std::vector<double> dense_;  ///< by hypothesis; zero between uses
  std::vector<WeightedHypothesis> rest_;
  std::vector<double> q_lower_;
  std::vector<std::uint8_t> fresh_;
  std::function<bool()> late_;  ///< may be empty
  std::int64_t changes_ = 0;
  std::int64_t trials_ = 0, expansions_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace feeler::planner
