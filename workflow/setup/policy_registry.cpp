#include "feeler/workflow/setup/policy_registry.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <mutex>
#include <sstream>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/env/contact/mesh_outcomes.h"
#include "feeler/policies/database_policy.h"
#include "feeler/policies/noisy_graph_policy.h"
#include "feeler/policies/open_loop.h"
#include "feeler/policies/spiral/hybrid_policy.h"
#include "feeler/policies/touch/touch_based_localization.h"
#include "feeler/policies/visual/visual_servoing.h"
#include "feeler/workflow/setup/visual_goal.h"

namespace feeler::workflow {
namespace {

using PolicyPointer = std::unique_ptr<policies::Policy>;

/// The active region of a contact map, found once.
class RegionCache {
 public:
  std::shared_ptr<const planner::ActiveRegion> RegionOf(const std::shared_ptr<const planner::ContactMap>& map) {
    const std::lock_guard lock(mutex_);
    if (map_ != map) {
      region_ = std::make_shared<const planner::ActiveRegion>(*map);
      map_ = map;
    }
    return region_;
  }

 private:
  std::mutex mutex_;  // guards both below
  std::shared_ptr<const planner::ContactMap> map_;
  std::shared_ptr<const planner::ActiveRegion> region_;
};

/// The stored policies that episodes have met, each read and decoded once and shared by all episodes and threads.
class StoredPolicies {
 public:
  explicit StoredPolicies(std::shared_ptr<policies::Database> database) : database_(std::move(database)) {}

  /// Null if the database holds none for the problem.
  std::shared_ptr<const planner::PolicyGraph> Get(const planner::Extents& extents) {
    const std::lock_guard lock(mutex_);
    const auto [known, added] = known_.try_emplace(extents);
    if (added) {
      std::optional<policies::StoredProblem> stored = database_->Get(extents);
      if (stored && stored->policy) {
        known->second = std::make_shared<const planner::PolicyGraph>(*std::move(stored->policy));
      }
    }
    return known->second;
  }

 private:
  std::shared_ptr<policies::Database> database_;
  std::mutex mutex_;  // guards known_
  std::map<planner::Extents, std::shared_ptr<const planner::PolicyGraph>> known_;
};

/// What the policies of a factory share.
struct Shared {
  std::shared_ptr<StoredPolicies> stored;  ///< null without a database
  PolicyOptions options;
  std::shared_ptr<planner::PlanningTablesCache> tables = std::make_shared<planner::PlanningTablesCache>(options.store);
  std::shared_ptr<VisualGoalOnce> visual_goal = std::make_shared<VisualGoalOnce>();
  std::shared_ptr<NoisyPolicies> noisy = std::make_shared<NoisyPolicies>(options.noisy);
  std::shared_ptr<RegionCache> regions = std::make_shared<RegionCache>();
};

/// A policy by its name. A new one: a function, and a line in kPolicies.
struct Entry {
  const char* name;
  bool needs_database;
  bool uses_ladder;
  PolicyPointer (*make)(const PolicyRequest& request, const Shared& shared);
};

/// Expansions a step for a problem that the database does not hold: a budget that gives the same policy everywhere.
constexpr std::int64_t kOutsideExpansions = 3000;

PolicyPointer MakeDatabase(const PolicyRequest& request, const Shared& shared) {
  if (auto stored = shared.stored->Get(request.extents)) {
    return std::make_unique<policies::DatabasePolicy>(std::move(stored));
  }
  policies::OnlineOptions online = shared.options.online;
  if (!online.expansion_limit) online.expansion_limit = kOutsideExpansions;
  return std::make_unique<policies::OnlinePolicy>(online, shared.tables);
}

PolicyPointer MakeOnline(const PolicyRequest& /*request*/, const Shared& shared) {
  return std::make_unique<policies::OnlinePolicy>(shared.options.online, shared.tables);
}

PolicyPointer MakeNoisy(const PolicyRequest& request, const Shared& shared) {
  const NoisyPolicyOptions& options = shared.noisy->options();
  return std::make_unique<policies::NoisyGraphPolicy>(shared.noisy->For(request.problem, request.extents),
                                                      policies::Doubt{options.noise, options.declaration.confidence});
}

PolicyPointer MakeOpenLoop(const PolicyRequest& /*request*/, const Shared& /*shared*/) {
  return std::make_unique<policies::OpenLoopPolicy>();
}

PolicyPointer MakeSpiral(const PolicyRequest& request, const Shared& shared) {
  const Task& task = request.setup.task();
  return std::make_unique<policies::SpiralPolicy>(task.insertion, task.cell_m,
                                                  shared.options.spiral.value_or(DerivedSpiral(task)));
}

PolicyPointer MakeHybrid(const PolicyRequest& request, const Shared& shared) {
  const Task& task = request.setup.task();
  const double threshold_m =
      shared.options.hybrid_threshold_m > 0.0 ? shared.options.hybrid_threshold_m : DerivedHybridThreshold(task);
  return std::make_unique<policies::HybridPolicy>(MakeSpiral(request, shared), MakeDatabase(request, shared),
                                                  task.insertion, task.cell_m, threshold_m);
}

PolicyPointer MakeTouch(const PolicyRequest& request, const Shared& shared, const char* name,
                        policies::TouchCriterion criterion, std::unique_ptr<planner::OutcomeModel> outcomes = nullptr) {
  policies::TouchOptions options;
  options.criterion = criterion;
  options.actions = shared.options.tbl_actions;
  options.name = name;
  options.region = shared.regions->RegionOf(request.setup.map);
  return std::make_unique<policies::TouchBasedLocalization>(std::move(options), std::move(outcomes), request.seed,
                                                            request.episode);
}

PolicyPointer MakeTbl(const PolicyRequest& request, const Shared& shared) {
  return MakeTouch(request, shared, "tbl", policies::TouchCriterion::kInformationGain);
}

PolicyPointer MakeTblMesh(const PolicyRequest& request, const Shared& shared) {
  const PlanningSetup& setup = request.setup;
  return MakeTouch(request, shared, "tbl-mesh", policies::TouchCriterion::kInformationGain,
                   std::make_unique<env::MeshOutcomes>(setup.model, setup.opening, setup.map->phase()));
}

PolicyPointer MakeTblPerCost(const PolicyRequest& request, const Shared& shared) {
  return MakeTouch(request, shared, "tbl-per-cost", policies::TouchCriterion::kInformationGainPerCost);
}

PolicyPointer MakeTblSubmodular(const PolicyRequest& request, const Shared& shared) {
  return MakeTouch(request, shared, "tbl-submodular", policies::TouchCriterion::kPruningPerCost);
}

PolicyPointer MakeRandom(const PolicyRequest& request, const Shared& shared) {
  return MakeTouch(request, shared, "random", policies::TouchCriterion::kAny);
}

PolicyPointer MakeVisualServoing(const char* name, std::shared_ptr<const policies::VisualGoal> goal, bool tape) {
  std::unique_ptr<policies::FeatureTracker> tracker =
      tape ? policies::MakeTapeTracker(goal) : policies::MakeSiftTracker(goal);
  policies::VisualServoingOptions options;
  if (!tape) options.frame_period_s = 1.0 / 15.0;  // what finding the features takes
  return std::make_unique<policies::VisualServoingPolicy>(name, std::move(goal), std::move(tracker), options);
}

/// By the corners of red tape where the goal shows one, else by SIFT features.
PolicyPointer MakeVisual(const PolicyRequest& request, const Shared& shared) {
  const auto goal = shared.visual_goal->For(request.setup);
  return MakeVisualServoing("visual-servoing", goal, policies::MakeTapeTracker(goal)->goal_features() > 0);
}

PolicyPointer MakeVisualTape(const PolicyRequest& request, const Shared& shared) {
  return MakeVisualServoing("visual-servoing-tape", shared.visual_goal->For(request.setup), true);
}

PolicyPointer MakeVisualSift(const PolicyRequest& request, const Shared& shared) {
  return MakeVisualServoing("visual-servoing-sift", shared.visual_goal->For(request.setup), false);
}

constexpr Entry kPolicies[] = {
    {"database", true, true, MakeDatabase},
    {"online", false, true, MakeOnline},
    {"noisy", false, true, MakeNoisy},
    {"tbl", false, true, MakeTbl},
    {"tbl-mesh", false, true, MakeTblMesh},
    {"tbl-per-cost", false, true, MakeTblPerCost},
    {"tbl-submodular", false, true, MakeTblSubmodular},
    {"random", false, true, MakeRandom},
    {"hybrid", true, true, MakeHybrid},
    {"spiral", false, false, MakeSpiral},
    {"open-loop", false, false, MakeOpenLoop},
    {"visual-servoing", false, false, MakeVisual},
    {"visual-servoing-tape", false, false, MakeVisualTape},
    {"visual-servoing-sift", false, false, MakeVisualSift},
};

/// Policies that were registered; guarded by `mutex`.
struct Registered {
  std::mutex mutex;
  std::map<std::string, PolicyEntry> entries;
};

Registered& TheRegistered() {
  static Registered registered;
  return registered;
}

bool IsBuiltIn(const std::string& name) {
  return std::ranges::any_of(kPolicies, [&](const Entry& entry) { return name == entry.name; });
}

/// What makes a policy, with the shared state bound to it.
PolicyEntry Find(const std::string& name, const std::shared_ptr<const Shared>& shared = nullptr) {
  for (const Entry& entry : kPolicies) {
    if (name != entry.name) continue;
    return {[make = entry.make, shared](const PolicyRequest& request) { return make(request, *shared); },
            entry.needs_database, entry.uses_ladder};
  }
  {
    Registered& registered = TheRegistered();
    const std::lock_guard lock(registered.mutex);
    if (const auto found = registered.entries.find(name); found != registered.entries.end()) return found->second;
  }
  std::string known;
  for (const std::string& other : PolicyNames()) known += (known.empty() ? "" : ", ") + other;
  throw InputError("--policy", "unknown policy \"" + name + "\"", "choose one of " + known);
}

struct Setting {
  const char* key;
  void (*set)(PolicyOptions& options, double value);
};

policies::SpiralTuning& Spiral(PolicyOptions& options) {
  if (!options.spiral) options.spiral.emplace();
  return *options.spiral;
}

constexpr Setting kSettings[] = {
    {"tbl-actions", [](PolicyOptions& o, double v) { o.tbl_actions = static_cast<int>(v); }},
    {"online-seconds", [](PolicyOptions& o, double v) { o.online.time_limit_s = v; }},
    {"online-expansions", [](PolicyOptions& o, double v) { o.online.expansion_limit = static_cast<std::int64_t>(v); }},
    {"missed-contact", [](PolicyOptions& o, double v) { o.noisy.noise.missed_contact = v; }},
    {"false-stop", [](PolicyOptions& o, double v) { o.noisy.noise.false_stop = v; }},
    {"slip", [](PolicyOptions& o, double v) { o.noisy.noise.slip = v; }},
    {"confidence", [](PolicyOptions& o, double v) { o.noisy.declaration.confidence = v; }},
    {"wrong-cost", [](PolicyOptions& o, double v) { o.noisy.declaration.wrong_cells = v; }},
    {"noisy-expansions", [](PolicyOptions& o, double v) { o.noisy.expansion_limit = static_cast<std::int64_t>(v); }},
    {"spiral-pitch", [](PolicyOptions& o, double v) { Spiral(o).pitch_m = v; }},
    {"spiral-speed", [](PolicyOptions& o, double v) { Spiral(o).speed_m_s = v; }},
    {"spiral-force", [](PolicyOptions& o, double v) { Spiral(o).press_n = v; }},
    {"hybrid-threshold", [](PolicyOptions& o, double v) { o.hybrid_threshold_m = v; }},
};

/// The press of a spiral search, where the force budget allows it: half of that at most. With less, friction and
/// chamfer hold tools back (`feeler experiment spiral-tuning`, on both sockets).
constexpr double kSpiralPressN = 20.0;
/// Pressed with half of the budget of 25 N a tool sinks into the opening as if it fell with this acceleration, m/s^2:
/// the fastest spiral that finds nearly all openings of the tight socket goes 20 mm/s.
constexpr double kSinkingMS2 = 1.3;
/// Half widths of the uncertainty, in tolerances, up to which a spiral is quicker than touch (`feeler experiment
/// baselines`: 3 mm, but not 5, on the plug at 1 mm; nowhere on the tight socket, whose smallest problem is 6.7 wide).
constexpr double kSpiralReach = 4.0;

}  // namespace

PolicyOptions ParsePolicyOptions(const std::vector<std::string>& settings) {
  PolicyOptions options;
  for (const std::string& text : settings) {
    const std::size_t equals = text.find('=');
    const std::string key = text.substr(0, equals);
    const auto* setting =
        std::find_if(std::begin(kSettings), std::end(kSettings), [&](const Setting& s) { return key == s.key; });
    if (setting == std::end(kSettings)) {
      std::string known;
      for (const Setting& s : kSettings) known += (known.empty() ? "" : ", ") + std::string(s.key);
      throw InputError("--policy-option", "unknown option \"" + key + "\"", "KEY=VALUE with a KEY of " + known);
    }
    std::istringstream number(equals == std::string::npos ? "" : text.substr(equals + 1));
    double value = 0.0;
    if (!(number >> value) || !number.eof() || !std::isfinite(value) || value < 0.0 || value > 1e12) {
      throw InputError("--policy-option", "\"" + text + "\" has no sensible value",
                       "give KEY=NUMBER, e.g. " + key + "=1");
    }
    setting->set(options, value);
  }
  return options;
}

policies::SpiralTuning DerivedSpiral(const Task& task) {
  const double catch_m = task.tolerance.lateral_m;
  return {.pitch_m = 2.0 * catch_m, .speed_m_s = std::sqrt(kSinkingMS2 * catch_m), .press_n = kSpiralPressN};
}

double DerivedHybridThreshold(const Task& task) { return kSpiralReach * task.tolerance.lateral_m; }

void RegisterPolicy(const std::string& name, PolicyEntry entry) {
  Registered& registered = TheRegistered();
  const std::lock_guard lock(registered.mutex);
  if (name.empty() || !entry.make) throw InputError("policy \"" + name + "\"", "has no name or no maker", "give both");
  if (IsBuiltIn(name) || !registered.entries.emplace(name, std::move(entry)).second) {
    throw InputError("policy \"" + name + "\"", "is known already", "register it under another name");
  }
}

std::vector<std::string> PolicyNames() {
  std::vector<std::string> names;
  for (const Entry& entry : kPolicies) names.emplace_back(entry.name);
  Registered& registered = TheRegistered();
  const std::lock_guard lock(registered.mutex);
  for (const auto& [name, entry] : registered.entries) names.push_back(name);
  return names;
}

bool UsesLadder(const std::string& name) { return Find(name).uses_ladder; }

PolicyFactory MakePolicyFactory(const std::string& name, std::shared_ptr<policies::Database> database,
                                const PolicyOptions& options) {
  const bool has_database = database != nullptr;
  const PolicyEntry entry =
      Find(name, std::make_shared<const Shared>(
                     Shared{has_database ? std::make_shared<StoredPolicies>(std::move(database)) : nullptr, options}));
  if (entry.needs_database && !has_database) {
    throw InputError("--policy " + name, "needs a database", "give one with --db FILE.db");
  }
  return entry.make;
}

}  // namespace feeler::workflow
