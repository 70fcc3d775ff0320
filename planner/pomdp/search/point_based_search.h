#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "feeler/planner/options/solver_options.h"
#include "feeler/planner/options/solver_result.h"
#include "feeler/planner/pomdp/model/controller.h"
#include "feeler/planner/pomdp/model/observable_classes.h"
#include "feeler/planner/pomdp/model/pomdp.h"
#include "feeler/planner/pomdp/model/pulse.h"
#include "feeler/planner/pomdp/model/state_bounds.h"
#include "feeler/planner/pomdp/search/alpha_store.h"
#include "feeler/planner/pomdp/search/sawtooth.h"

namespace feeler::planner {

/// A controller out of alpha vectors: node i carries out vector `vectors[i].second` of class `vectors[i].first`.
struct PointBasedPlan {
  PomdpController controller;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> vectors;
  std::size_t largest_class = 0;
};

/// Point-based search between two bounds for discounted POMDPs: HSVI (Smith and Simmons 2004, 2005) with SARSOP's
/// pruning of what no visited belief needs (Kurniawati, Hsu and Lee 2008).
///
/// L(b) = max alpha . b: vectors made by backups, each the value of a plan, over the class of the belief
/// (ObservableClasses). U(b): the fast informed bound, and the sawtooth over visited beliefs. A trial takes the action
/// of greatest U, then the outcome of the widest excess over `width / discount^depth`, backs up on the way down and on
/// the way back. Both hold at any time; the search is done when U - L <= precision at the initial belief.
///
/// A successor belief looks only at the vectors and points that are new since it was looked at last; actions are
/// looked at only while their cached U could still change the maximum (bounds only improve).
class PointBasedSearch {
 public:
  /// Everything must outlive the search. The discount must be below 1.
  PointBasedSearch(const Pomdp& pomdp, const ObservableClasses& classes, const StateBounds& bounds);

  /// Until U - L <= precision at the start, or `stop(expansions)` says why not to go on (it is asked within updates,
  /// too: those of large models take long; once it has stopped the search is over). kRounding: trials change nothing
  /// any more.
  std::optional<SolverStatus> Run(double precision,
                                  const std::function<std::optional<SolverStatus>(std::int64_t)>& stop);

  double lower() const { return nodes_[0].bound.lower; }
  double upper() const { return nodes_[0].bound.upper; }
  std::int64_t trials() const { return trials_; }
  std::int64_t expansions() const { return expansions_; }
  std::size_t bytes() const;
  /// The plan behind lower(): its controller is worth lower() at the start. `relinked`: each vector goes on with the
  /// best vector known by now instead of the one it was made of; mostly better and often cyclic, its value is to be
  /// evaluated.
  PointBasedPlan Plan(bool relinked) const;
  /// The vectors of a class, among them one whose value at the start is lower().
  const AlphaStore& alphas(std::size_t class_index) const { return alphas_[class_index]; }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  /// Cached bounds of a belief, and how far the stores have been looked through for them.
  struct Bound {
    double lower = -std::numeric_limits<double>::infinity();
    double upper = std::numeric_limits<double>::infinity();
    AlphaStore::Cursor alphas;
    Sawtooth::Cursor points;
  };
  struct Child {
    double probability = 0.0;
    std::uint32_t outcome = 0;   ///< index into the outcomes of the action
    std::uint32_t node = kNone;  ///< where the belief has been visited
    Bound bound;                 ///< unless it has
  };
  struct Node {
    std::uint32_t class_index = 0;
    std::vector<SparseEntry> belief;
    Bound bound;
    std::vector<std::uint32_t> first_child;  ///< by action, and one past; empty until expanded
    std::vector<Child> children;
    std::vector<double> reward;  ///< by action
  };

  std::optional<SolverStatus> RunTrials(double precision,
                                        const std::function<std::optional<SolverStatus>(std::int64_t)>& stop);
  std::uint32_t Intern(std::uint32_t class_index, std::vector<SparseEntry> belief);
  void Expand(std::uint32_t node);
  Bound& BoundOf(Child& child) { return child.node == kNone ? child.bound : nodes_[child.node].bound; }
  /// The belief after an outcome, normalised, into belief_.
  void Successor(const Node& node, const ClassOutcome& outcome);
  void Refresh(std::uint32_t class_index, std::span<const SparseEntry> belief, Bound& bound);
  void RefreshAction(std::uint32_t node, std::size_t action);
  double ActionUpper(std::uint32_t node, std::size_t action);
  double ActionLower(std::uint32_t node, std::size_t action);
  /// Backs up both bounds; returns the action of greatest upper bound.
  std::size_t Update(std::uint32_t node);
  void AddAlpha(std::uint32_t node, std::size_t action);
  /// The visited successor of widest excess; kNone where none has any.
  std::uint32_t WidestSuccessor(std::uint32_t node, std::size_t action, double width);
  void Prune();

  Pulse pulse_;
  const Pomdp& pomdp_;
  const ObservableClasses& classes_;
  std::vector<AlphaStore> alphas_;  ///< by class
  std::vector<Sawtooth> uppers_;
  std::vector<Node> nodes_;  ///< 0 is the start
  std::unordered_multimap<std::uint64_t, std::uint32_t> index_;
  std::vector<double> dense_, next_dense_;  ///< zero between uses
  std::vector<SparseEntry> belief_;
  std::vector<double> q_upper_;
  std::vector<std::uint8_t> refreshed_;
  double scale_ = 1.0;
  double least_change_ = 0.0;  ///< changes of bounds below this are left out
  std::int64_t changes_ = 0;   ///< of bounds, and beliefs met
  std::int64_t trials_ = 0, expansions_ = 0;
  std::size_t node_bytes_ = 0;
};

}  // namespace feeler::planner
