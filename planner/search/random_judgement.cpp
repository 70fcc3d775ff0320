#include "feeler/planner/search/random_judgement.h"

#include <array>
#include <cmath>

#include "feeler/core/random.h"

namespace feeler::planner {

GreedyCompletion<BeliefGraph>::Judgement RandomJudgement(const BeliefGraph& graph, std::uint64_t seed,
                                                         std::uint64_t number) {
  RandomStream stream(seed, number, "greedy completion");
  const double inflation = stream.Uniform(1.0, 2.0);
  const double per_bit = stream.Uniform(0.0, 2.0) * (graph.problem().cost.per_cell + graph.problem().cost.per_action);
  std::array<double, 3> along{};
  for (double& factor : along) factor = std::exp(stream.Uniform(-0.5, 0.5));
  return {[=, &graph](BeliefId b) {
            const std::uint32_t size = graph.sets().info(graph.set(b)).size;
            return inflation * graph.Heuristic(b) + per_bit * graph.Weight(b) * std::log2(static_cast<double>(size));
          },
          [=](const BeliefAction& action) {
            return action.cost * along[static_cast<std::size_t>(AxisOf(action.direction))];
          }};
}

}  // namespace feeler::planner
