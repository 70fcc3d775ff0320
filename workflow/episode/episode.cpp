#include "feeler/workflow/episode/episode.h"

#include <cmath>
#include <utility>

#include "feeler/core/clock.h"
#include "feeler/core/error.h"
#include "feeler/env/model/task_pieces.h"
#include "feeler/env/scene/oversize_target.h"
#include "feeler/execution/recovery/online_planner.h"
#include "feeler/workflow/episode/fall_in_draw.h"

namespace feeler::workflow {
namespace {

/// While it lives the recorder sees every physics step.
class Watched {
 public:
  Watched(env::SimulatedRobot& robot, ReplayRecorder& recorder) : robot_(robot) {
    robot_.SetObserver([&recorder](const env::World& world) { recorder.See(world); }, 0.0);
    recorder.See(robot_.world());
  }
  ~Watched() { robot_.SetObserver({}, 0.0); }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

 private:
  env::SimulatedRobot& robot_;
};

}  // namespace

std::shared_ptr<const env::Scene> BuildEpisodeScene(const PlanningSetup& setup) {
  return std::make_shared<const env::Scene>(env::BuildScene(setup.model));
}

EpisodeRunner::EpisodeRunner(std::shared_ptr<const PlanningSetup> setup, std::shared_ptr<const env::Scene> scene,
                             PolicyFactory policy_factory, EpisodeOptions options)
    : setup_(std::move(setup)),
      policy_factory_(std::move(policy_factory)),
      options_(std::move(options)),
      noise_(ParseFaults(options_.noise)) {
  if (noise_.oversize_m > 0.0) {
    scene = std::make_shared<const env::Scene>(env::WithOversizeTarget(*scene, noise_.oversize_m));
  }
  if (options_.perception) {
    if (noise_.outside || noise_.fall_in || noise_.yaw_error_rad > 0.0) {
      throw InputError("noise", "'" + noise_.name + "' says where the target stands, and so does perception",
                       "leave out one of them");
    }
    options_.placement = Placement::kWorkspace;
    camera_cell_ = std::make_unique<CameraCell>(scene, options_.perception->finder, options_.perception->noise);
  } else if (options_.placement == Placement::kWorkspace) {
    placements_ = std::make_unique<PlacementSampler>(scene);
  }
  environment_ = std::make_unique<env::InsertionEnv>(std::move(scene));
  online_planner_ = std::make_shared<execution::OnlinePlanner>();
}

EpisodeDraw EpisodeRunner::Draw(std::uint64_t episode) {
  if (camera_cell_) {
    return DrawPerceived(setup_->task(), *options_.perception, options_.family, options_.seed, episode, *camera_cell_);
  }
  Task task = setup_->task();
  PlacementDraw placement{task.world_T_target, 0};
  if (placements_) {
    RandomStream random(options_.seed, episode, "placement");
    placement = placements_->Draw(random);
  }
  task.world_T_target = placement.world_T_target;
  EpisodeDraw draw = DrawEpisode(task, options_.family, options_.seed, episode, noise_);
  draw.rejected_placements = placement.rejected;
  return draw;
}

EpisodeRecord EpisodeRunner::Run(std::uint64_t episode) {
  const Task& task = setup_->task();
  const double cpu_start_s = ThreadCpuSeconds();
  EpisodeDraw draw = Draw(episode);
  EpisodeRecord record;
  record.task = task.name;
  record.noise = noise_.name;
  record.seed = options_.seed;
  record.episode = episode;
  record.placement = ToString(options_.placement);
  record.rejected_placements = draw.rejected_placements;
  record.extents = draw.extents;
  record.world_T_true = draw.world_T_true;
  record.world_T_estimate0 = draw.world_T_estimate;
  record.perception = draw.perception;
  if (!draw.failure.empty()) {
    record.reason = draw.failure;
    record.timing.cpu_s = ThreadCpuSeconds() - cpu_start_s;
    return record;
  }
  const planner::Problem problem = planner::MakeCuboidProblem(task, setup_->map, draw.extents);
  const double plan_start_s = ThreadCpuSeconds();
  const std::unique_ptr<policies::Policy> policy =
      policy_factory_({problem, draw.extents, *setup_, options_.seed, episode});
  const double lookup_cpu_s = ThreadCpuSeconds() - plan_start_s;
  if (noise_.fall_in) {
    RandomStream random(options_.seed, episode, "truth that falls in");
    const auto truth = DrawFallIn(task, problem, *policy, draw.world_T_estimate, random);
    if (truth) draw.world_T_true = TurnedByFault(task, noise_, options_.seed, episode, *truth);
  }
  record.world_T_true = draw.world_T_true;
  record.truth_outside = TruthOutside(task, draw);

  env::ResetOptions reset;
  reset.episode = episode;
  reset.world_T_estimate = draw.world_T_estimate;
  reset.world_T_target = draw.world_T_true;
  reset.extents = AxisExtents(task, draw.extents);
  reset.noise = noise_.robot;
  reset.start = env::StartPlace::kHome;
  reset.withhold_true_pose = options_.withhold_true_pose;
  environment_->Reset(options_.seed, reset);

  record.policy = policy->name();

  env::SimulatedRobot& robot = environment_->robot();
  ReplayRecorder recorder(robot.world().scene());
  std::optional<Watched> watched;
  if (options_.replay) watched.emplace(robot, recorder);

  const std::unique_ptr<Robot> wrapped = options_.wrap_robot ? options_.wrap_robot(robot) : nullptr;
  Robot& driven = wrapped ? *wrapped : robot;

  const double transfer_start_s = ThreadCpuSeconds();
  const MotionResult transfer = driven.Transfer(execution::LatticeStartPose(task, problem, draw.world_T_estimate));
  record.timing.transfer_cpu_s = ThreadCpuSeconds() - transfer_start_s;

  recorder.MarkStart(robot.Time());
  if (transfer.reason == StopReason::kReached) {
    execution::ExecutorOptions options;
    if (reset.noise.contact_threshold_n > options.contact_force_n) {
      options = execution::ExecutorOptions::WithFriction();
      options.contact_force_n = reset.noise.contact_threshold_n;
    }
    options.ladder = options_.ladder;
    options.online_planner = online_planner_;
    if (setup_->map->orientations() > 1) {
      options.travel_model = env::MakeExactTravel(setup_->model, env::Opening::kOpen);
    }
    if (options_.confirm_limit_m) options.confirm_limit_m = *options_.confirm_limit_m;
    record.execution = execution::Execute(task, problem, draw.world_T_estimate, *policy, driven, options);
  } else {
    record.execution.reason = "transfer to the start pose: " + std::string(ToString(transfer.reason)) +
                              (transfer.detail.empty() ? "" : ", " + transfer.detail);
  }

  if (options_.replay) record.replay = recorder.Take(robot.world());

  // The score: from here on the truth may be looked at.
  const env::InsertionVerdict verdict = environment_->Judge();
  if (record.execution.world_T_estimate) {
    record.error = PoseErrorOf(task, draw.world_T_true, *record.execution.world_T_estimate);
    record.localized = WithinTolerance(task.tolerance, *record.error);
  }
  record.inserted = verdict.inserted;
  record.depth_m = verdict.depth_m;
  record.lateral_m = verdict.lateral_m;
  const env::RobotStatistics& statistics = environment_->robot().statistics();
  record.peak_force_n = statistics.peak_force_n;
  record.impulse_ns = statistics.impulse_ns;
  record.forbidden_contacts = statistics.forbidden_contacts;
  if (record.inserted) {
    record.reason = "inserted";
  } else if (record.execution.inserted) {
    record.reason = "believed inserted, but " + std::string(env::ToString(verdict.reason));
  } else {
    record.reason = record.execution.reason;
  }
  if (!record.inserted && draw.perception && record.truth_outside) {
    record.reason = "truth outside the hypotheses: " + record.reason;
  }
  record.timing.plan_cpu_s = lookup_cpu_s + record.execution.policy_cpu_s;
  record.timing.cpu_s = ThreadCpuSeconds() - cpu_start_s;
  return record;
}

}  // namespace feeler::workflow
