#include "feeler/planner/search/random_judgement.h"

#include <array>
#include <cmath>
#include <vector>

#include "feeler/core/random.h"

namespace feeler::planner {

GreedyCompletion<BeliefGraph>::Judgement RandomJudgement(const BeliefGraph& graph, std::uint64_t seed,
                                                         std::uint64_t number) {
  RandomStream stream(seed, number, "greedy completion");
  const double inflation = stream.Uniform(1.0, 2.0);
  const double per_bit = stream.Uniform(0.0, 2.0) * (graph.problem().cost.per_cell + graph.problem().cost.per_action);
  std::array<double, 3> along{};
  for (double& factor : along) factor = std::exp(stream.Uniform(-0.5, 0.5));
  std::vector<double> bits(graph.problem().hypotheses.size() + 1);  // by number of hypotheses
  for (std::size_t n = 1; n < bits.size(); ++n) bits[n] = std::log2(static_cast<double>(n));
  return {[=, &graph](BeliefId b) {
            const std::uint32_t size = graph.sets().info(graph.set(b)).size;
            return inflation * graph.Heuristic(b) + per_bit * graph.Weight(b) * bits[size];
          },
          [=](const BeliefAction& action) {
            return action.cost * along[static_cast<std::size_t>(AxisOf(action.direction))];
          }};
}

}  // namespace feeler::planner
