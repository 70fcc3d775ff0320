#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/contact/outcome_model.h"
#include "feeler/policies/policy.h"
#include "feeler/policies/touch/touch_actions.h"

namespace feeler::policies {

/// What the next action is chosen by.
enum class TouchCriterion {
  kInformationGain,         ///< largest expected information gain: as the paper ran it ("tbl")
  kInformationGainPerCost,  ///< per expected cost ("tbl-per-cost")
  /// Hypothesis pruning, adaptive submodular greedy (Javdani et al. 2013): the largest expected weight of ruled out
  /// hypotheses per expected cost ("tbl-submodular").
  kPruningPerCost,
  kAny,  ///< the first sampled action that may touch anything ("random"): a floor
};

struct TouchOptions {
  TouchCriterion criterion = TouchCriterion::kInformationGain;
  int actions = 100;       ///< sampled per planning step, as in the paper; 0: every action there is
  int vicinity_cells = 4;  ///< around the box in which the hypotheses can be touched
  int longest_probe = 16;  ///< cells
  std::string name = "tbl";
  /// Of the contact map of the problems, computed ahead of time; null: computed when an episode begins (some 20 ms).
  std::shared_ptr<const planner::ActiveRegion> region;
};

/// Touch-based localization: planning and execution interleaved. Each planning step samples actions in the vicinity of
/// the hypotheses that are left (see TouchActions), takes the best by the criterion (ties: the first sampled), and
/// has it executed; the belief is updated, and the next step begins. Ends when the goal of the problem is reached, and
/// gives up when no action rules anything out.
class TouchBasedLocalization final : public Policy {
 public:
  /// `outcomes`: null: the contact map of the problem. `seed` and `episode` key the samples. Throws InputError for
  /// options out of range.
  TouchBasedLocalization(TouchOptions options, std::unique_ptr<planner::OutcomeModel> outcomes, std::uint64_t seed,
                         std::uint64_t episode);

  std::string_view name() const override { return options_.name; }
  void Begin(const planner::Problem& problem) override;
  Decision Next(const Belief& belief) override;
  bool Observe(const Outcome& outcome) override;

  /// The best action in a belief; empty if none tells anything. Advances the stream of samples.
  std::optional<TouchAction> Choose(const Belief& belief);
  /// Planning steps since Begin.
  int planning_steps() const { return planning_steps_; }

 private:
  std::optional<TouchAction> BestOf(const Belief& belief, std::vector<TouchAction> candidates);

  TouchOptions options_;
  std::unique_ptr<planner::OutcomeModel> given_outcomes_;
  std::unique_ptr<planner::OutcomeModel> map_outcomes_;
  std::uint64_t seed_;
  std::uint64_t episode_;
  std::optional<RandomStream> random_;
  const planner::Problem* problem_ = nullptr;
  std::optional<TouchActions> actions_;
  std::optional<TouchAction> action_;  ///< under way
  std::size_t leg_ = 0;                ///< of its approach; behind the last one: the probe
  int planning_steps_ = 0;
};

}  // namespace feeler::policies
