#pragma once

#include <algorithm>
#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/belief/hypothesis_sets.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

/// A lower bound for beliefs of many hypotheses of a small target, proven in docs/planner.md, "Leaving".
///
/// On the way on which every step turns out free, a step singles out those hypotheses under which it is blocked: few,
/// where the target is small. The others go on. The bound is the best that a sequence of such steps could do if each
/// singled out as many as any step within reach does, the groups bounded in the same way.
///
/// Certificates know how far it is to what tells one hypothesis from its neighbours; this knows that one has to look
/// for it in many places. For problems with a workspace (lattice files). Deterministic; keeps what it knows of groups,
/// so one object is for one thread.
class LeavingBound {
 public:
  /// The problem must outlive this.
  explicit LeavingBound(const Problem& problem);

  /// False where the bound is not made: generous workspaces (tables of tasks repeat beyond their domain), more than
  /// some hundred hypotheses, and targets with more than some hundred places to touch them from, where it says little.
  static bool Fits(const Problem& problem);

  /// Lower bound on the optimal expected cost of a belief of the problem, times its weight; 0 at goals. `robot` and the
  /// set are in problem coordinates.
  double Weighted(const HypothesisSets& sets, SetId set, const Cell& robot);
  std::size_t bytes() const { return bytes_ + probe_count_ * sizeof(Probe); }

 private:
  /// A hypothesis relative to the cell that the tool is at.
  struct Member {
    std::array<int, 3> offset;
    int orientation = 0;
    auto operator<=>(const Member&) const = default;
  };
  using Group = std::vector<Member>;
  /// A step that tells something: the place it is made from and what those that it singles out cost afterwards.
  struct Probe {
    std::array<std::int16_t, 3> place;
    std::uint32_t group = 0;
  };
  /// The probes of a set, and bounds by the number singled out for each distinct group.
  struct Probes {
    std::vector<Probe> probes;
    std::vector<const std::vector<double>*> groups;
    std::vector<std::unique_ptr<const std::vector<double>>> weighted;  ///< what `groups` points to unless uniform
  };
  /// What steps from places up to some distance from the tool single out.
  struct Layer {
    std::vector<double> rest;  ///< by the number that one step singles out: bound on what they cost afterwards
    std::size_t gone = 0;      ///< how many can have been singled out by now
  };

  void FillFlags(int orientation);
  std::int64_t Linear(const Cell& c) const { return c.x() * strides_[0] + c.y() * strides_[1] + c.z() * strides_[2]; }
  const std::vector<double>& OfGroup(const Group& group);
  std::vector<Layer> LayersOfGroup(const Group& group, const CellBox& box);
  /// Calls f(bounds of the group that is singled out, direction) for each step from a place that singles out some but
  /// not all of those that can get there; returns the directions in which somebody gets further (bits).
  template <class F>
  unsigned ForEachTellingStep(const Group& group, const std::vector<const std::uint8_t*>& tables, const Cell& place,
                              const CellBox& box, F f);
  const Probes& ProbesOfSet(SetId set, const Group& group, const std::vector<double>& weights);
  /// For k = 0 ... size: bound on what any k members cost together, times their weights; `weights` ascend.
  /// `all_start`: only all of them matter.
  std::vector<double> Bounds(const std::vector<double>& weights, const std::vector<Layer>& layers,
                             bool all_start) const;

  const Problem& problem_;
  CellBox domain_;
  std::array<std::int64_t, 3> strides_{};
  /// Per orientation and displacement. Bit k: the place is free and the step in direction k blocked.
  std::vector<std::vector<std::uint8_t>> flags_;
  /// Displacements with flags, and the box around them.
  std::vector<std::vector<Cell>> faces_;
  std::vector<CellBox> face_boxes_;
  std::size_t most_in_goal_ = 1;
  int radius_ = 0;
  std::int64_t lookups_ = 0;
  struct HashOfGroup {
    std::size_t operator()(const Group& group) const;
  };
  /// Looked up only, never walked through.
  std::unordered_map<Group, std::vector<double>, HashOfGroup> known_;
  std::vector<std::vector<double>> zeros_;  ///< bounds of groups that a goal may keep, by size
  std::unordered_map<SetId, Probes> probes_;
  std::size_t probe_count_ = 0;
  std::vector<std::uint32_t> seen_;  ///< places of the workspace: the last set that looked at it, by number
  std::uint32_t sets_seen_ = 0;
  std::size_t bytes_ = 0;  ///< of groups, about
};

/// The greater of two bounds; consistency is not promised.
class WithLeavingBound final : public BeliefHeuristic {
 public:
  /// Sets of fewer hypotheses have only the bound of `other`, which is close there.
  static constexpr std::uint32_t kFewest = 4;

  /// All must outlive this. The sets are in problem coordinates (not canonical).
  WithLeavingBound(const Problem& problem, const HypothesisSets& sets, std::unique_ptr<BeliefHeuristic> other)
      : sets_(sets), other_(std::move(other)), leaving_(problem) {}

  double Weighted(SetId set, const Cell& robot) override {
    const double bound = other_->Weighted(set, robot);
    if (sets_.info(set).size < kFewest) return bound;
    return std::max(bound, leaving_.Weighted(sets_, set, robot));
  }
  std::size_t bytes() const override { return other_->bytes() + leaving_.bytes(); }

 private:
  const HypothesisSets& sets_;
  std::unique_ptr<BeliefHeuristic> other_;
  LeavingBound leaving_;
};

}  // namespace feeler::planner
