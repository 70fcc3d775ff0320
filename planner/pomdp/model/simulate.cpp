#include "feeler/planner/pomdp/model/simulate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "feeler/planner/pomdp/model/belief_update.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {
namespace {

constexpr int kUndiscountedSteps = 100000;
constexpr double kDiscountedSteps = 1e6;

std::uint32_t Draw(std::span<const SparseEntry> row, RandomStream& random) {
  double at = random.Uniform();
  for (const SparseEntry& entry : row) {
    at -= entry.value;
    if (at < 0.0) return entry.index;
  }
  return row.back().index;
}

/// Infinitely many without discount.
double StepsThatMatter(const Pomdp& pomdp) {
  if (pomdp.discount == 1.0) return std::numeric_limits<double>::infinity();
  return std::ceil(std::log(1e-6 * (1.0 - pomdp.discount)) / std::log(pomdp.discount));
}

int LongestEpisode(const Pomdp& pomdp, int max_steps) {
  if (max_steps > 0) return max_steps;
  if (pomdp.discount == 1.0) return kUndiscountedSteps;
  return static_cast<int>(std::min(StepsThatMatter(pomdp), kDiscountedSteps));
}

}  // namespace

void BeliefAgent::Observe(std::uint32_t action, std::uint32_t observation) {
  BeliefUpdate update(pomdp_);
  std::vector<SparseEntry> next;
  update(belief_, action, [&](std::uint32_t o, double, const std::vector<SparseEntry>& belief) {
    if (o == observation) next = belief;
  });
  if (!next.empty()) belief_ = std::move(next);  // what the model calls impossible is rounding
}

SimulationResult SimulatePomdp(const Pomdp& pomdp, PomdpAgent& agent, const SimulationOptions& options) {
  const std::vector<std::uint8_t> absorbing = AbsorbingStates(pomdp);
  const int longest = LongestEpisode(pomdp, options.max_steps);
  const bool cuts = longest < StepsThatMatter(pomdp);
  SimulationResult result;
  double squares = 0.0;
  double steps = 0.0;
  for (int episode = 0; episode < options.episodes; ++episode) {
    if (options.progress && episode % 100 == 0) options.progress(episode, options.episodes);
    RandomStream random(options.seed, static_cast<std::uint64_t>(episode), "pomdp-episode");
    agent.Reset();
    std::uint32_t state = Draw(pomdp.start, random);
    double sum = 0.0;
    double weight = 1.0;
    int step = 0;
    const auto cancelled = [&] { return options.cancellation != nullptr && options.cancellation->cancelled(); };
    try {
      for (; step < longest && absorbing[state] == 0 && !cancelled(); ++step) {
        const std::uint32_t action = agent.Act();
        sum += weight * pomdp.reward[pomdp.At(action, state)];
        weight *= pomdp.discount;
        state = Draw(pomdp.transitions.Row(pomdp.At(action, state)), random);
        agent.Observe(action, Draw(pomdp.observation_rows.Row(pomdp.At(action, state)), random));
      }
    } catch (const Interrupted&) {
      break;
    }
    if (cancelled()) break;  // the episode in work is none
    result.at_goal += absorbing[state] != 0 ? 1 : 0;
    result.cut_short += absorbing[state] == 0 && cuts ? 1 : 0;
    ++result.episodes;
    steps += step;
    const double delta = sum - result.mean;  // Welford
    result.mean += delta / result.episodes;
    squares += delta * (sum - result.mean);
  }
  constexpr double kNormal95 = 1.959964;
  result.half_width = result.episodes > 1 ? kNormal95 * std::sqrt(squares / (result.episodes - 1) / result.episodes)
                                          : std::numeric_limits<double>::infinity();
  if (result.episodes > 0) result.steps_mean = steps / result.episodes;
  if (options.progress) options.progress(options.episodes, options.episodes);
  return result;
}

}  // namespace feeler::planner
