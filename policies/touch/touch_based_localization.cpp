#include "feeler/policies/touch/touch_based_localization.h"

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::policies {
namespace {

/// Rounds of samples without an informative action among them, before all actions are looked at.
constexpr int kRounds = 3;
/// An action that costs nothing (a touch of a wall that the tool stands at, where only distance counts) is not worth
/// infinitely much.
constexpr double kLeastCost = 1e-6;

double Score(TouchCriterion criterion, const TouchValue& value) {
  const double cost = std::max(value.cost, kLeastCost);
  switch (criterion) {
    case TouchCriterion::kInformationGain: return value.information_gain;
    case TouchCriterion::kInformationGainPerCost: return value.information_gain / cost;
    case TouchCriterion::kPruningPerCost: return value.pruned / cost;
    case TouchCriterion::kAny: return 1.0;
  }
  return 0.0;
}

}  // namespace

TouchBasedLocalization::TouchBasedLocalization(TouchOptions options, std::unique_ptr<planner::OutcomeModel> outcomes,
                                               std::uint64_t seed, std::uint64_t episode)
    : options_(std::move(options)), given_outcomes_(std::move(outcomes)), seed_(seed), episode_(episode) {
  if (options_.actions < 0) throw InputError(options_.name, "a negative number of actions", "give 0 for all actions");
  if (options_.vicinity_cells < 0 || options_.longest_probe < 1) {
    throw InputError(options_.name, "the vicinity or the longest probe is out of range", "see TouchOptions");
  }
}

void TouchBasedLocalization::Begin(const planner::Problem& problem) {
  problem_ = &problem;
  auto region = options_.region ? options_.region : std::make_shared<const planner::ActiveRegion>(*problem.map);
  actions_.emplace(problem, std::move(region), options_.vicinity_cells, options_.longest_probe);
  map_outcomes_ = std::make_unique<planner::MapOutcomes>(problem.map);
  random_.emplace(seed_, episode_, options_.name);
  action_.reset();
  leg_ = 0;
  planning_steps_ = 0;
}

std::optional<TouchAction> TouchBasedLocalization::BestOf(const Belief& belief, std::vector<TouchAction> candidates) {
  planner::OutcomeModel& outcomes = given_outcomes_ ? *given_outcomes_ : *map_outcomes_;
  const bool any = options_.criterion == TouchCriterion::kAny;
  std::optional<TouchAction> best;
  double best_score = 0.0;
  for (TouchAction& action : candidates) {
    TouchValue value;
    if (!actions_->Evaluate(belief, outcomes, action, value)) continue;
    if (!any && value.pruned <= 0.0) continue;
    const double score = Score(options_.criterion, value);
    if (best && score <= best_score) continue;
    best_score = score;
    best = std::move(action);
  }
  return best;
}

std::optional<TouchAction> TouchBasedLocalization::Choose(const Belief& belief) {
  assert(problem_ != nullptr);
  ++planning_steps_;
  const bool any = options_.criterion == TouchCriterion::kAny;
  for (int round = 0; options_.actions > 0 && round < kRounds; ++round) {
    std::vector<TouchAction> sampled;
    for (int i = 0; i < options_.actions; ++i) {
      auto action = actions_->Sample(belief, *random_);
      if (!action) break;
      sampled.push_back(std::move(*action));
      if (any) {
        if (auto touching = BestOf(belief, {sampled.back()})) return touching;
      }
    }
    if (auto best = BestOf(belief, std::move(sampled))) return best;
  }
  return BestOf(belief, actions_->All(belief));
}

Decision TouchBasedLocalization::Next(const Belief& belief) {
  assert(problem_ != nullptr);
  if (planner::IsGoal(*problem_, belief.hypotheses)) return Insert{};
  if (!action_) {
    action_ = Choose(belief);
    leg_ = 0;
    if (!action_) return GiveUp{"no action tells the hypotheses that are left apart"};
  }
  return leg_ < action_->approach.size() ? action_->approach[leg_] : action_->probe;
}

bool TouchBasedLocalization::Observe(const Outcome& outcome) {
  if (!action_) return false;
  // A contact on the way was not foreseen; whatever it tells, the plan is void.
  if (leg_ < action_->approach.size() && !outcome.contact) {
    ++leg_;
  } else {
    action_.reset();
  }
  return true;
}

}  // namespace feeler::policies
