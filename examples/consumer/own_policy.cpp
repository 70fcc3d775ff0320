// own_policy [TASK]: a solver and a policy of one's own, registered by a call: the solver's policies go into a
// database, the policy runs episodes in physics under its name, as any other.
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>

#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/policies/database_policy.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/setup/database_builder.h"
#include "feeler/workflow/setup/policy_registry.h"
#include "nearest_split.h"

using namespace feeler;

namespace {

/// The own solver's policy for one problem into a database of its own.
void Store(const workflow::PlanningSetup& setup, const planner::Extents& extents, const planner::PolicyGraph& policy) {
  const std::string path = (std::filesystem::temp_directory_path() / "own_policy.db").string();
  std::filesystem::remove(path);
  policies::Database database = policies::Database::Create(path, workflow::IdentityOf(setup, {}));
  policies::StoredProblem stored;
  stored.extents = extents;
  stored.status = "solved";
  stored.solver = "nearest-split";
  stored.expected_cost = policy.expected_cost;
  stored.policy = policy;
  database.Put(stored);
  database.Verify();
  std::filesystem::remove(path);
}

int Run(const char* task) {
  const auto setup = std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup(task));
  const planner::Extents extents = planner::ParseExtents("3x3x3");
  const planner::Problem problem = planner::MakeCuboidProblem(setup->task(), setup->map, extents);
  const auto policy = std::make_shared<const planner::PolicyGraph>(SolveByNearestSplit(problem));
  const planner::PolicyEvaluation evaluation = planner::Evaluate(problem, *policy);
  if (!evaluation.valid() || std::abs(evaluation.expected_cost - policy->expected_cost) > 1e-9) {
    throw NegativeResult("nearest-split", evaluation.fault);
  }
  std::printf("nearest-split: %zu nodes, expected cost %.2f\n", policy->nodes.size(), policy->expected_cost);
  Store(*setup, extents, *policy);

  workflow::RegisterPolicy("nearest-split", {.make = [policy](const workflow::PolicyRequest&) {
                             return std::make_unique<policies::DatabasePolicy>(policy);
                           }});
  workflow::EpisodeOptions options;
  options.family = planner::ParseProblemFamily("3x3x3", setup->task());
  workflow::EpisodeRunner runner(setup, workflow::BuildEpisodeScene(*setup),
                                 workflow::MakePolicyFactory("nearest-split", nullptr), options);
  int inserted = 0;
  constexpr int kEpisodes = 3;
  for (int k = 0; k < kEpisodes; ++k) inserted += runner.Run(static_cast<std::uint64_t>(k)).inserted ? 1 : 0;
  std::printf("%d of %d episodes inserted\n", inserted, kEpisodes);
  return inserted == kEpisodes ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    SetDataFolder(FEELER_DATA);
    return Run(argc > 1 ? argv[1] : "plug");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "own_policy: error: %s\n", error.what());
    return 2;
  }
}
