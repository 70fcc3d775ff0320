#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "feeler/core/progress.h"
#include "feeler/core/random.h"
#include "feeler/planner/pomdp/model/controller.h"
#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// What decides the actions of an episode. One object serves one episode at a time.
class PomdpAgent {
 public:
  virtual ~PomdpAgent() = default;
  virtual void Reset() = 0;
  /// May throw Interrupted where it takes long and is to stop: that ends the simulation before this episode.
  virtual std::uint32_t Act() = 0;
  virtual void Observe(std::uint32_t action, std::uint32_t observation) = 0;
};

/// Carries out a controller.
class ControllerAgent : public PomdpAgent {
 public:
  explicit ControllerAgent(const PomdpController& controller) : controller_(controller) {}
  void Reset() override { node_ = controller_.root; }
  std::uint32_t Act() override { return controller_.nodes[node_].action; }
  void Observe(std::uint32_t /*action*/, std::uint32_t observation) override {
    node_ = controller_.Next(node_, observation);
  }

 private:
  const PomdpController& controller_;
  std::uint32_t node_ = 0;
};

/// Keeps the belief, and asks for the action at each.
class BeliefAgent : public PomdpAgent {
 public:
  using Decide = std::function<std::uint32_t(std::span<const SparseEntry> belief)>;
  BeliefAgent(const Pomdp& pomdp, Decide decide) : pomdp_(pomdp), decide_(std::move(decide)) {}
  void Reset() override { belief_ = pomdp_.start; }
  std::uint32_t Act() override { return decide_(belief_); }
  void Observe(std::uint32_t action, std::uint32_t observation) override;

 private:
  const Pomdp& pomdp_;
  Decide decide_;
  std::vector<SparseEntry> belief_;
};

struct SimulationOptions {
  int episodes = 10000;
  std::uint64_t seed = 1;
  /// Steps of an episode at most; 0: until a goal or until the discount leaves less than 1e-6 of the greatest reward, a
  /// million where that would be more, 100000 without discount.
  int max_steps = 0;
  const CancellationToken* cancellation = nullptr;
  ProgressCallback progress = {};
};

struct SimulationResult {
  int episodes = 0;
  double mean = 0.0;        ///< of the discounted sum of rewards
  double half_width = 0.0;  ///< of the 95 % interval of the mean (normal); infinite of one episode
  double steps_mean = 0.0;
  int at_goal = 0;    ///< episodes that ended in an absorbing state
  int cut_short = 0;  ///< episodes that the limit of steps ended before what was to come stopped mattering
};

/// Episodes from the initial belief. Episode k draws from its own streams (seed, k): the same alone or among many.
SimulationResult SimulatePomdp(const Pomdp& pomdp, PomdpAgent& agent, const SimulationOptions& options);

}  // namespace feeler::planner
