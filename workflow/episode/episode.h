#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/execution/executor.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/episode/episode_faults.h"
#include "feeler/workflow/episode/episode_perception.h"
#include "feeler/workflow/episode/episode_record.h"
#include "feeler/workflow/setup/placement_draw.h"
#include "feeler/workflow/setup/planning_setup.h"
#include "feeler/workflow/setup/policy_registry.h"

namespace feeler::workflow {

struct EpisodeOptions {
  std::uint64_t seed = 1;
  /// The problems an episode may meet, drawn uniformly; one problem: always that one.
  planner::ProblemFamily family;
  /// Hypotheses come from a camera, which looks at a target placed in the workspace; null: they are drawn around it.
  std::shared_ptr<const EpisodePerception> perception;
  Placement placement = Placement::kNominal;  ///< where the target stands, before uncertainty comes into it
  std::string noise = "ideal";                ///< names of FaultNames(), with commas between
  bool ladder = true;                         ///< fallbacks when the policy does not come to an insertion
  /// How well the position across the insertion must be known before the insertion; default: the executor's.
  std::optional<double> confirm_limit_m;
  /// What no contact is to push harder than while the tool feels, N; default: as ForceBudget says.
  std::optional<double> force_budget_n;
  /// Keep what the episode looked like in its record. Not for a robot that somebody else observes.
  bool replay = false;
  /// Stands between the executor and the simulated robot: a driver that is to be tried, or a robot of another language.
  /// Empty: the executor drives the simulated robot itself. Called at the start of each episode.
  std::function<std::unique_ptr<Robot>(env::SimulatedRobot&)> wrap_robot;
  /// Nobody but the scoring sees the true pose: the environment leaves it out of its info, too.
  bool withhold_true_pose = false;
  double force_offset_n = 0.0;  ///< of the force sensor along z, beside the noise
};

/// The force budget of episodes with those faults, N: the one that is wanted, or the task's, or what the noise of the
/// force sensor asks for where that is more (a contact must be told from noise before the budget is used up). Throws
/// InputError for a wanted one below that.
double ForceBudget(const Task& task, const EpisodeFaults& faults, const std::optional<double>& wanted_n);

/// The world of the task's episodes: robot, tool, target, fixtures.
std::shared_ptr<const env::Scene> BuildEpisodeScene(const PlanningSetup& setup, const env::SceneOptions& options = {});

/// One attempt: reset, hypotheses, transfer to the start pose, localize by touch, insert, score.
/// One object per thread; the scene is shared.
class EpisodeRunner {
 public:
  EpisodeRunner(std::shared_ptr<const PlanningSetup> setup, std::shared_ptr<const env::Scene> scene,
                PolicyFactory policy_factory, EpisodeOptions options);

  EpisodeRecord Run(std::uint64_t episode);

  // The same in steps, for a robot that somebody else moves.
  /// Draws the episode and places everything. `reason` of the record is empty, or why there is no episode. Null as
  /// policy factory will do, unless a fault asks where the policy probes. `extents`: of this problem, not one drawn
  /// from the family; all else is drawn as ever.
  EpisodeRecord Begin(std::uint64_t episode, const std::optional<planner::Extents>& extents = std::nullopt);
  /// Adds what is true of the world as it stands, and says so in `reason`: the score of what `execution` believes.
  void Score(EpisodeRecord& record);

  const EpisodeOptions& options() const { return options_; }
  const Task& task() const { return setup_->task(); }
  const EpisodeFaults& faults() const { return noise_; }
  double force_budget_n() const { return force_budget_n_; }
  /// The world of the runner, e.g. to watch it.
  env::InsertionEnv& environment() { return *environment_; }

 private:
  EpisodeDraw Draw(std::uint64_t episode, const planner::ProblemFamily& family);
  EpisodeRecord Describe(std::uint64_t episode, const EpisodeDraw& draw) const;
  void DrawTruthThatFallsIn(std::uint64_t episode, const planner::Problem& problem, policies::Policy& policy,
                            EpisodeDraw& draw) const;
  void Place(std::uint64_t episode, const EpisodeDraw& draw, EpisodeRecord& record);

  std::shared_ptr<const PlanningSetup> setup_;
  PolicyFactory policy_factory_;
  EpisodeOptions options_;
  EpisodeFaults noise_;
  double force_budget_n_;
  std::shared_ptr<execution::OnlinePlanner> online_planner_;
  std::unique_ptr<env::InsertionEnv> environment_;
  std::unique_ptr<PlacementSampler> placements_;  ///< if the target is placed in the workspace
  std::unique_ptr<CameraCell> camera_cell_;       ///< if a camera looks for it
};

/// The numbers first..end-1.
std::vector<std::int64_t> EpisodeRange(std::int64_t first, std::int64_t end);

/// Runs episodes on several threads; hands the records to `on_record` in the order of `episodes`. Stops early, after
/// the records finished so far, when cancelled. Returns how many were handed over.
std::int64_t RunEpisodes(const std::vector<std::int64_t>& episodes, Parallelism jobs,
                         const std::function<EpisodeRunner()>& make_runner,
                         const std::function<void(const EpisodeRecord&)>& on_record, const ProgressCallback& progress,
                         const CancellationToken* cancellation);

}  // namespace feeler::workflow
