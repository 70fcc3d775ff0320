#include "feeler/workflow/episode/episode.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "feeler/core/clock.h"
#include "feeler/core/error.h"
#include "feeler/env/model/contact_settings.h"
#include "feeler/env/model/task_pieces.h"
#include "feeler/env/scene/oversize_target.h"
#include "feeler/execution/records/scored_reason.h"
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

/// Of the tool, as the scene has it.
double SlidingFriction(const env::Scene& scene) {
  return scene.tool_geoms.empty() ? 1.0 : scene.model->geom_friction[3 * scene.tool_geoms.front()];
}

/// How far the target is turned against its estimate, rad.
double YawOfFault(const Task& task, const EpisodeDraw& draw) {
  return InsertionAngle(task, draw.world_T_estimate.linear().transpose() * draw.world_T_true.linear());
}

}  // namespace

double ForceBudget(const Task& task, const EpisodeFaults& faults, const std::optional<double>& wanted_n) {
  constexpr double kAboveThreshold = 1.2;
  const double least_n = kAboveThreshold * faults.robot.contact_threshold_n;
  if (!wanted_n) return std::max(task.force_budget_n, least_n);
  if (!std::isfinite(*wanted_n) || *wanted_n < least_n) {
    throw InputError("force budget",
                     fmt::format("{} N, and with noise '{}' a contact is told from {:g} N on", *wanted_n, faults.name,
                                 faults.robot.contact_threshold_n),
                     fmt::format("give {:g} N or more", least_n));
  }
  return *wanted_n;
}

std::shared_ptr<const env::Scene> BuildEpisodeScene(const PlanningSetup& setup, const env::SceneOptions& options) {
  return std::make_shared<const env::Scene>(env::BuildScene(setup.model, options));
}

EpisodeRunner::EpisodeRunner(std::shared_ptr<const PlanningSetup> setup, std::shared_ptr<const env::Scene> scene,
                             PolicyFactory policy_factory, EpisodeOptions options)
    : setup_(std::move(setup)),
      policy_factory_(std::move(policy_factory)),
      options_(std::move(options)),
      noise_(ParseFaults(options_.noise)),
      force_budget_n_(ForceBudget(setup_->task(), noise_, options_.force_budget_n)) {
  noise_.robot.force_offset_n.z() += options_.force_offset_n;
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

EpisodeDraw EpisodeRunner::Draw(std::uint64_t episode, const planner::ProblemFamily& family) {
  if (camera_cell_) {
    return DrawPerceived(setup_->task(), *options_.perception, family, options_.seed, episode, *camera_cell_);
  }
  Task task = setup_->task();
  PlacementDraw placement{task.world_T_target, 0};
  if (placements_) {
    RandomStream random(options_.seed, episode, "placement");
    placement = placements_->Draw(random);
  }
  task.world_T_target = placement.world_T_target;
  EpisodeDraw draw = DrawEpisode(task, family, options_.seed, episode, noise_);
  draw.rejected_placements = placement.rejected;
  return draw;
}

EpisodeRecord EpisodeRunner::Describe(std::uint64_t episode, const EpisodeDraw& draw) const {
  EpisodeRecord record;
  record.task = setup_->task().name;
  record.noise = noise_.name;
  record.seed = options_.seed;
  record.episode = episode;
  record.placement = ToString(options_.placement);
  record.rejected_placements = draw.rejected_placements;
  record.extents = draw.extents;
  record.world_T_true = draw.world_T_true;
  record.world_T_estimate0 = draw.world_T_estimate;
  record.perception = draw.perception;
  record.reason = draw.failure;
  return record;
}

void EpisodeRunner::DrawTruthThatFallsIn(std::uint64_t episode, const planner::Problem& problem,
                                         policies::Policy& policy, EpisodeDraw& draw) const {
  RandomStream random(options_.seed, episode, "truth that falls in");
  const auto truth = DrawFallIn(setup_->task(), problem, policy, draw.world_T_estimate, random);
  if (truth) draw.world_T_true = TurnedByFault(setup_->task(), noise_, options_.seed, episode, *truth);
}

void EpisodeRunner::Place(std::uint64_t episode, const EpisodeDraw& draw, EpisodeRecord& record) {
  const Task& task = setup_->task();
  record.world_T_true = draw.world_T_true;
  record.truth_outside = TruthOutside(task, draw);
  env::ResetOptions reset;
  reset.episode = episode;
  reset.world_T_estimate = draw.world_T_estimate;
  reset.world_T_target = draw.world_T_true;
  reset.extents = AxisExtents(task, draw.extents);
  const env::Scene& world = environment_->robot().world().scene();
  WorldDraw world_draw = DrawWorld(task, noise_, SlidingFriction(world), options_.seed, episode);
  reset.noise = world_draw.robot;
  reset.physics = world_draw.physics;
  record.fault_values = world_draw.values;
  if (noise_.yaw_error_rad > 0.0) record.fault_values["yaw"] = YawOfFault(task, draw) * 180.0 / std::numbers::pi;
  reset.start = env::StartPlace::kHome;
  reset.withhold_true_pose = options_.withhold_true_pose;
  environment_->Reset(options_.seed, reset);
}

EpisodeRecord EpisodeRunner::Begin(std::uint64_t episode, const std::optional<planner::Extents>& extents) {
  EpisodeDraw draw = Draw(episode, extents ? planner::ProblemFamily{{*extents}, ""} : options_.family);
  EpisodeRecord record = Describe(episode, draw);
  if (!draw.failure.empty()) return record;
  if (noise_.fall_in) {
    if (!policy_factory_) {
      throw InputError("noise", "'fall-in' asks where the policy probes, and there is none",
                       "give a database with --db");
    }
    const planner::Problem problem = setup_->ProblemOf(draw.extents);
    const auto policy = policy_factory_({problem, draw.extents, *setup_, options_.seed, episode});
    DrawTruthThatFallsIn(episode, problem, *policy, draw);
  }
  Place(episode, draw, record);
  return record;
}

void EpisodeRunner::Score(EpisodeRecord& record) {
  const Task& task = setup_->task();
  const env::InsertionVerdict verdict = environment_->Judge();
  if (record.execution.world_T_estimate) {
    record.error = PoseErrorOf(task, record.world_T_true, *record.execution.world_T_estimate);
    record.localized = WithinTolerance(task.tolerance, *record.error);
  }
  const env::World& world = environment_->robot().world();
  const env::Scene& scene = world.scene();
  record.contact_parameters =
      env::ContactParameters(world.model(), scene.tool_geoms, scene.target_geoms, scene.tool_body, scene.target_body);
  if (scene.wrist.stiffness_n_m > 0.0) {
    record.contact_parameters["wrist_stiffness_n_m"] = scene.wrist.stiffness_n_m;
    record.contact_parameters["wrist_damping_n_s_m"] = scene.wrist.damping_n_s_m;
  }
  record.inserted = verdict.inserted;
  record.verdict = env::ToString(verdict.reason);
  record.depth_m = verdict.depth_m;
  record.lateral_m = verdict.lateral_m;
  const env::RobotStatistics& statistics = environment_->robot().statistics();
  record.peak_force_n = statistics.peak_force_n;
  record.execution.force_budget_n = force_budget_n_;
  record.impulse_ns = statistics.impulse_ns;
  record.forbidden_contacts = statistics.forbidden_contacts;
  record.reason = execution::ScoredReason(record.inserted, record.verdict, record.execution);
  if (!record.inserted && record.perception && record.truth_outside) {
    record.reason = "truth outside the hypotheses: " + record.reason;
  }
}

EpisodeRecord EpisodeRunner::Run(std::uint64_t episode) {
  const Task& task = setup_->task();
  const double cpu_start_s = ThreadCpuSeconds();
  EpisodeDraw draw = Draw(episode, options_.family);
  EpisodeRecord record = Describe(episode, draw);
  if (!draw.failure.empty()) {
    record.timing.cpu_s = ThreadCpuSeconds() - cpu_start_s;
    return record;
  }
  const planner::Problem problem = setup_->ProblemOf(draw.extents);
  const double plan_start_s = ThreadCpuSeconds();
  const std::unique_ptr<policies::Policy> policy =
      policy_factory_({problem, draw.extents, *setup_, options_.seed, episode});
  const double lookup_cpu_s = ThreadCpuSeconds() - plan_start_s;
  if (noise_.fall_in) DrawTruthThatFallsIn(episode, problem, *policy, draw);
  Place(episode, draw, record);
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
    execution::ExecutorOptions options = execution::OptionsForThreshold(noise_.robot.contact_threshold_n);
    options.force_budget_n = force_budget_n_;
    options.ladder = options_.ladder;
    options.online_planner = online_planner_;
    if (setup_->map->orientations() > 1) {
      options.travel_model = env::MakeExactTravel(setup_->model, env::Opening::kOpen);
    }
    if (options_.confirm_limit_m) options.confirm_limit_m = *options_.confirm_limit_m;
    record.execution = execution::Execute(task, problem, draw.world_T_estimate, *policy, driven, options);
  } else {
    record.execution.reason = execution::TransferFailure(transfer);
  }
  if (options_.replay) record.replay = recorder.Take(robot.world());

  Score(record);  // from here on the truth may be looked at
  record.timing.plan_cpu_s = lookup_cpu_s + record.execution.policy_cpu_s;
  record.timing.cpu_s = ThreadCpuSeconds() - cpu_start_s;
  return record;
}

}  // namespace feeler::workflow
