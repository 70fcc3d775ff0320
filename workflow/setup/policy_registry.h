#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/policies/online_policy.h"
#include "feeler/policies/policy.h"
#include "feeler/policies/spiral/spiral_policy.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/setup/noisy_policies.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// What a policy is made for: one episode.
struct PolicyRequest {
  const planner::Problem& problem;
  planner::Extents extents;
  const PlanningSetup& setup;
  std::uint64_t seed = 1;  ///< of policies that draw, with `episode`
  std::uint64_t episode = 0;
};

/// Gives the policy for an episode; called once each. Safe to call from several threads. A problem that the database
/// does not hold is planned for online: the policy's name says so. Throws InputError for a damaged database.
using PolicyFactory = std::function<std::unique_ptr<policies::Policy>(const PolicyRequest& request)>;

/// Options of policies; each policy reads those that concern it.
struct PolicyOptions {
  int tbl_actions = 100;  ///< sampled per planning step by touch-based localization; 0: every action
  policies::OnlineOptions online;
  NoisyPolicyOptions noisy;
  std::optional<policies::SpiralTuning> spiral;      ///< default: as derived for the task (DerivedSpiral)
  std::shared_ptr<const planner::ArrayStore> store;  ///< of bound tables for the processes of the host; null: none
  double hybrid_threshold_m = 0.0;                   ///< half width of the uncertainty; 0: DerivedHybridThreshold
};
/// Parses "key=value" settings of `--policy-option`: tbl-actions, online-seconds, online-expansions, spiral-pitch,
/// spiral-speed, spiral-force, hybrid-threshold, missed-contact, false-stop, slip, confidence, wrong-cost,
/// noisy-expansions. Throws InputError listing the keys for an unknown one.
PolicyOptions ParsePolicyOptions(const std::vector<std::string>& settings);

/// The spiral for the socket of a task, derived from what it catches, its lateral tolerance: turns two tolerances apart
/// pass every place within one, and the tool sinks in while it crosses that width (under a constant press the time
/// grows as its root, so the speed does). docs/experiments.md holds the measurements.
policies::SpiralTuning DerivedSpiral(const Task& task);
/// Below this half width of the uncertainty `hybrid` spirals: four lateral tolerances.
double DerivedHybridThreshold(const Task& task);

/// How a policy is made, and what it asks for.
struct PolicyEntry {
  PolicyFactory make;
  bool needs_database = false;
  bool uses_ladder = true;  ///< see UsesLadder
};
/// Adds a policy of one's own under a name, for MakePolicyFactory and all that takes names (runs, experiments). Throws
/// InputError if the name is taken, empty, or the entry makes nothing. Safe from any thread.
void RegisterPolicy(const std::string& name, PolicyEntry entry);

/// Names that `MakePolicyFactory` knows.
std::vector<std::string> PolicyNames();

/// Whether episodes of this policy end with the fallback ladder unless told otherwise: it belongs to policies that
/// localize by touch, a baseline that does not is measured as it is. Throws InputError for an unknown name.
bool UsesLadder(const std::string& name);

/// The factory of a policy by its name. `database` serves the policies that read one and may be null for the others.
/// Throws InputError for an unknown name (listing the known) or a missing database.
PolicyFactory MakePolicyFactory(const std::string& name, std::shared_ptr<policies::Database> database,
                                const PolicyOptions& options = {});

}  // namespace feeler::workflow
