#include "feeler/policies/touch/kinematic_walk.h"

#include <algorithm>

#include "feeler/core/clock.h"

namespace feeler::policies {
KinematicWalk Walk(const planner::Problem& problem, Policy& policy, const Hypothesis& truth, int most_moves) {
  KinematicWalk walk;
  const auto timed = [&](const auto& call) {
    const double before = ThreadCpuSeconds();
    auto result = call();
    walk.cpu_s += ThreadCpuSeconds() - before;
    return result;
  };
  Belief belief{problem.start, problem.hypotheses};
  timed([&] {
    policy.Begin(problem);
    return 0;
  });
  while (true) {
    const Decision decision = timed([&] { return policy.Next(belief); });
    if (std::holds_alternative<Insert>(decision)) {
      walk.localized = planner::IsGoal(problem, belief.hypotheses);
      walk.reason = walk.localized ? "localized" : "inserts without being localized";
      return walk;
    }
    if (const auto* give_up = std::get_if<GiveUp>(&decision)) {
      walk.reason = "gave up: " + give_up->reason;
      return walk;
    }
    const auto* move = std::get_if<GuardedMove>(&decision);
    if (move == nullptr) {
      walk.reason = "does not go by guarded moves";
      return walk;
    }
    const Cell end = belief.robot + move->cells * UnitCell(move->direction);
    if (move->cells < 1 || !problem.workspace.Contains(end)) {
      walk.reason = "a guarded move out of the workspace";
      return walk;
    }
    if (walk.moves == most_moves) {
      walk.reason = "no end";
      return walk;
    }
    const Outcome outcome = planner::Simulate(problem, belief.robot, *move, truth);
    walk.cost += problem.cost.Of(outcome, move->direction);
    walk.cells += outcome.cells;
    walk.contacts += outcome.contact ? 1 : 0;
    ++walk.moves;
    std::erase_if(belief.hypotheses, [&](const Hypothesis& h) {
      return !(planner::Simulate(problem, belief.robot, *move, h) == outcome);
    });
    belief.robot += outcome.cells * UnitCell(move->direction);
    if (!timed([&] { return policy.Observe(outcome); })) {
      walk.reason = "no plan for the outcome";
      return walk;
    }
  }
}

}  // namespace feeler::policies
