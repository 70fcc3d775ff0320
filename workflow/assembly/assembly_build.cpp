#include "feeler/workflow/assembly/assembly_build.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <utility>

#include "feeler/core/clock.h"
#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/gym/insertion_judge.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/task_pieces.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/execution/executor.h"
#include "feeler/policies/database_policy.h"
#include "feeler/workflow/assembly/assembly_reach.h"
#include "feeler/workflow/assembly/assembly_stage.h"
#include "feeler/workflow/episode/episode_draw.h"

namespace feeler::workflow {
namespace {

constexpr int kAttempts = 2;  ///< of an insertion, each from an estimate of its own
constexpr double kStraightSpeed_m_s = 0.15;
constexpr double kContact_n = 15.0;  ///< on the way to a grasp, off a part and out of the rack nothing should be met
constexpr double kStuck_n = 60.0;    ///< a part that does not come off a port for less stays there

/// Ends a build; what() says why.
class BuildStop : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

void Require(const MotionResult& motion, const std::string& what) {
  if (motion.reason == StopReason::kReached) return;
  throw BuildStop(what + ": " + std::string(ToString(motion.reason)) +
                  (motion.detail.empty() ? "" : ", " + motion.detail));
}

/// Ends a policy before its first move: touches alone tell the pose.
class TouchesAlone final : public policies::Policy {
 public:
  std::string_view name() const override { return "touches alone"; }
  void Begin(const planner::Problem& /*problem*/) override {}
  policies::Decision Next(const policies::Belief& /*belief*/) override { return policies::Insert{}; }
  bool Observe(const Outcome& /*outcome*/) override { return false; }
};

struct FoundPolicy {
  std::unique_ptr<policies::Policy> policy;
  std::string source;
};

FoundPolicy FindPolicy(const AssemblyTask& task, const planner::Problem& problem, const planner::Extents& extents) {
  if (task.database) {
    const auto stored = task.database->Get(extents);
    if (stored && stored->policy) {
      return {std::make_unique<policies::DatabasePolicy>(std::make_shared<const planner::PolicyGraph>(*stored->policy)),
              "database"};
    }
  }
  const std::string where = task.database ? "problem outside the family of the database" : "no database";
  if (task.online) {
    if (auto policy = task.online->PolicyFor(problem)) return {std::move(policy), "online: " + where};
    return {std::make_unique<TouchesAlone>(), "none: " + where + ", and none found online; touches alone"};
  }
  return {std::make_unique<TouchesAlone>(), "none: " + where + "; touches alone"};
}

/// The robot in one stage.
class StageRobot {
 public:
  StageRobot(std::shared_ptr<const env::Scene> scene, std::uint64_t seed, std::uint64_t stage)
      : scene_(std::move(scene)), reach_(scene_), robot_(scene_, OptionsOf()), random_(seed, stage, "assembly stage") {}
  StageRobot(const StageRobot&) = delete;
  StageRobot& operator=(const StageRobot&) = delete;

  void Begin(const env::JointVector& q_rad) {
    robot_.Reset(q_rad, scene_->task.world_T_target, {}, RandomStream(random_.Next(), 0, "robot"));
    seed_ = random_.Next();
  }

  env::SimulatedRobot& robot() { return robot_; }
  StageReach& reach() { return reach_; }
  const env::Scene& scene() const { return *scene_; }

  /// Along the axis of the tool, outwards.
  void Straight(double way_m, const std::string& what) {
    const Eigen::Vector3d outward = -UnitVector(scene_->task.insertion);
    const Pose goal = robot_.ToolPose() * Eigen::Translation3d(way_m * outward);
    Require(robot_.LinearMove(goal, kStraightSpeed_m_s, kContact_n), what);
  }

  /// Off a port that a part may be stuck in. Whatever comes of it, the transfer that follows says whether it is free.
  void ComeOff() {
    const Eigen::Vector3d outward = -UnitVector(scene_->task.insertion);
    robot_.LinearMove(robot_.ToolPose() * Eigen::Translation3d(kApproach_m * outward), kStraightSpeed_m_s, kStuck_n);
    robot_.ZeroWrench();
  }

  /// To a tool pose, in one of these branches of the arm; the target is thought to stand at any of `targets`.
  void Transfer(const Pose& world_T_tool, ServingBranches branches, std::vector<Pose> targets,
                const std::string& what) {
    if (branches.q_rad.empty()) throw BuildStop(what + ": " + branches.obstacle);
    goals_ = std::move(branches.q_rad);
    targets_ = std::move(targets);
    plan_reason_.clear();
    MotionResult motion = robot_.Transfer(world_T_tool);
    if (motion.reason == StopReason::kUnplanned && !plan_reason_.empty()) motion.detail = plan_reason_;
    Require(motion, what);
  }

 private:
  env::RobotOptions OptionsOf() {
    env::RobotOptions options;
    options.transfer_planner = [this](const env::World&, const env::JointVector& start, const Pose&) {
      reach_.transfers().SetTargetPoses(targets_);
      const planner::TransferPlan plan = PlanToBranches(reach_.transfers(), *scene_, start, goals_, seed_);
      plan_reason_ = plan.reason;
      std::vector<env::JointVector> way;
      for (const Eigen::VectorXd& q : plan.way_points) way.emplace_back(q);
      return way;
    };
    return options;
  }

  std::shared_ptr<const env::Scene> scene_;
  StageReach reach_;
  std::vector<env::JointVector> goals_;
  std::vector<Pose> targets_;
  std::string plan_reason_;
  std::uint64_t seed_ = 0;
  env::SimulatedRobot robot_;
  RandomStream random_;
};

class Builder {
 public:
  Builder(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
          const AssemblyOptions& options)
      : assembly_(assembly), plan_(plan), tasks_(tasks), options_(options) {
    for (const AssemblyPart& part : assembly.parts) poses_.push_back(part.world_T_part);
    for (const auto& [name, task] : tasks) {
      travel_.emplace(name, env::MakeExactTravel(task.setup->model, env::Opening::kOpen));
      limits_.emplace(name, env::LimitsOf(task.setup->task(), env::PiecesOf(task.setup->model, env::Opening::kOpen)));
    }
    record_.assembly = assembly.name;
    record_.seed = options.seed;
    record_.insertions = assembly.insertions.size();
  }

  AssemblyRecord Run() {
    const double cpu_start_s = ThreadCpuSeconds();
    for (std::size_t i = 0; i < assembly_.insertions.size() && record_.reason.empty(); ++i) {
      if (options_.cancellation != nullptr && options_.cancellation->cancelled()) {
        record_.interrupted = true;
        record_.reason = "interrupted before " + assembly_.Describe(i);
        break;
      }
      AssemblyStepRecord& step = record_.steps.emplace_back();
      step.insertion = i;
      const double step_start_s = ThreadCpuSeconds();
      try {
        RunStep(i, step);
      } catch (const BuildStop& stop) {
        step.reason = stop.what();
      } catch (const WorldError& error) {
        step.reason = error.what();
      }
      step.cpu_s = ThreadCpuSeconds() - step_start_s;
      record_.sim_time_s += step.sim_time_s;
      record_.path_length_m += step.path_length_m;
      if (!step.inserted) record_.reason = "stopped at " + assembly_.Describe(i) + ": " + step.reason;
      if (options_.progress) {
        options_.progress(static_cast<std::int64_t>(i) + 1, static_cast<std::int64_t>(assembly_.insertions.size()));
      }
    }
    if (record_.reason.empty()) GoHome();
    record_.cpu_s = ThreadCpuSeconds() - cpu_start_s;
    return std::move(record_);
  }

 private:
  std::shared_ptr<const env::Scene> Stage(std::size_t i, StagePhase phase) const {
    return std::make_shared<const env::Scene>(BuildStage(assembly_, {i, phase, plan_.grip_turn_rad[i], poses_}));
  }

  /// Puts the arm of a new stage where that of the last one was.
  std::unique_ptr<StageRobot> Enter(std::shared_ptr<const env::Scene> scene, std::uint64_t stage,
                                    const std::string& caption) {
    auto robot = std::make_unique<StageRobot>(scene, options_.seed, stage);
    robot->Begin(q_rad_.value_or(scene->home_q_rad));
    if (options_.film != nullptr) {
      options_.film->segments.push_back({scene, caption, {}});
      robot->robot().SetObserver(
          [this](const env::World& world) {
            options_.film->segments.back().frames.push_back({clock_s_ + world.time_s(), world.q_rad()});
          },
          options_.film->period_s);
    }
    return robot;
  }

  /// Whatever became of a stage, its time and way count.
  void Leave(StageRobot& stage, AssemblyStepRecord& step) {
    env::SimulatedRobot& robot = stage.robot();
    const env::RobotStatistics& statistics = robot.statistics();
    q_rad_ = robot.world().q_rad();
    clock_s_ += robot.Time();
    step.sim_time_s += robot.Time();
    step.path_length_m += statistics.path_length_m;
    step.peak_force_n = std::max(step.peak_force_n, statistics.peak_force_n);
    step.forbidden_contacts += statistics.forbidden_contacts;
  }

  void RunStep(std::size_t i, AssemblyStepRecord& step) {
    const AssemblyInsertion& insertion = assembly_.insertions[i];
    const Task& task = tasks_.at(insertion.task).setup->task();
    const Pose& world_T_into = poses_[static_cast<std::size_t>(insertion.into)];
    step.world_T_true = TargetPoseOf(assembly_, insertion, world_T_into);
    const Pose drawn = TargetPoseOf(assembly_, insertion, plan_.world_T_part[static_cast<std::size_t>(insertion.into)]);
    step.drawn_error = PoseErrorOf(task, drawn, step.world_T_true);

    const std::string caption = fmt::format("{}/{}  {} into {}", i + 1, assembly_.insertions.size(),
                                            assembly_.Part(insertion.part).name, assembly_.Part(insertion.into).name);
    const Pose grasp = GraspPose(assembly_, i, poses_);
    const Eigen::Vector3d outward = -UnitVector(task.insertion);
    const Pose approach = grasp * Eigen::Translation3d(kApproach_m * outward);
    {
      const auto stage = Enter(Stage(i, StagePhase::kFetch), 2 * i, caption + ": fetch");
      try {
        if (i > 0) stage->Straight(kApproach_m, "letting go of the part before");
        stage->Transfer(approach, stage->reach().AtApproach(grasp), {stage->scene().task.world_T_target},
                        "to the part");
        stage->Straight(-kApproach_m, "down to the part");
      } catch (...) {
        Leave(*stage, step);
        throw;
      }
      Leave(*stage, step);
    }
    const auto stage = Enter(Stage(i, StagePhase::kInsert), 2 * i + 1, caption);
    try {
      stage->Straight(kApproach_m, "lifting the part");
      for (int attempt = 0; attempt < (options_.ladder ? kAttempts : 1) && !step.inserted; ++attempt) {
        if (attempt > 0) stage->ComeOff();
        Attempt(i, attempt, *stage, step);
      }
    } catch (...) {
      Leave(*stage, step);
      throw;
    }
    if (step.inserted) {
      // It is let go where it is, and stays there, error and all.
      step.world_T_part = stage->robot().world().ToolPose() * PartTTool(assembly_, insertion).inverse();
      if (options_.disturb_part) step.world_T_part = options_.disturb_part(i, step.world_T_part);
      poses_[static_cast<std::size_t>(insertion.part)] = step.world_T_part;
    }
    Leave(*stage, step);
  }

  void Attempt(std::size_t i, int number, StageRobot& stage, AssemblyStepRecord& step) {
    const AssemblyInsertion& insertion = assembly_.insertions[i];
    const AssemblyTask& of = tasks_.at(insertion.task);
    const Task& task = of.setup->task();
    InsertionAttempt& attempt = step.attempts.emplace_back();
    const auto stream = [&](const char* purpose) {
      return RandomStream(options_.seed, i, fmt::format("assembly {} {}", purpose, number));
    };
    RandomStream problems = stream("problem");
    const planner::ProblemFamily family = planner::FamilyOf(task);
    attempt.extents = family.problems[problems.Index(family.problems.size())];
    // The estimate is such that the truth is a draw from the box around it.
    RandomStream offset = stream("estimate");
    const Pose estimate_T_true = env::DrawTruePose(task, Pose::Identity(), AxisExtents(task, attempt.extents), offset);
    attempt.world_T_estimate = step.world_T_true * estimate_T_true.inverse();
    if (options_.disturb_estimate) attempt.world_T_estimate = options_.disturb_estimate(i, attempt.world_T_estimate);

    const planner::Problem problem = planner::MakeCuboidProblem(task, of.setup->map, attempt.extents);
    FoundPolicy found = FindPolicy(of, problem, attempt.extents);
    attempt.policy_source = found.source;

    step.reason = attempt.reason = "not begun";
    const Pose start = execution::LatticeStartPose(task, problem, attempt.world_T_estimate);
    stage.Transfer(start, stage.reach().AtStart(attempt.world_T_estimate, start),
                   env::TargetCandidates(task, attempt.world_T_estimate, AxisExtents(task, attempt.extents)),
                   "carrying the part");

    execution::ExecutorOptions options;
    options.ladder = options_.ladder;
    options.online_planner = of.online;
    options.travel_model = travel_.at(insertion.task);
    const double started_s = stage.robot().Time();
    attempt.execution =
        execution::Execute(task, problem, attempt.world_T_estimate, *found.policy, stage.robot(), options);

    // The score: from here on the truth may be looked at.
    const env::InsertionVerdict verdict =
        env::JudgeInsertion(task, limits_.at(insertion.task), stage.robot().world().ToolPose(), step.world_T_true,
                            stage.robot().statistics().peak_force_n, stage.robot().Time() - started_s);
    if (attempt.execution.world_T_estimate) {
      attempt.error = PoseErrorOf(task, step.world_T_true, *attempt.execution.world_T_estimate);
      attempt.localized = WithinTolerance(task.tolerance, *attempt.error);
    }
    attempt.depth_m = verdict.depth_m;
    attempt.lateral_m = verdict.lateral_m;
    attempt.angle_rad = verdict.angle_rad;
    step.inserted = verdict.inserted;
    attempt.reason = verdict.inserted ? "inserted"
                     : attempt.execution.believed_inserted
                         ? "believed inserted, but " + std::string(env::ToString(verdict.reason))
                         : attempt.execution.reason;
    step.reason = attempt.reason;
  }

  void GoHome() {
    AssemblyStepRecord last;
    const std::size_t i = assembly_.insertions.size() - 1;
    try {
      const auto stage = Enter(Stage(i, StagePhase::kFetch), 2 * i + 2, "built");
      const env::JointVector& home = stage->scene().home_q_rad;
      stage->Straight(kApproach_m, "letting go of the last part");
      stage->Transfer(env::ToolForwardKinematics(stage->scene(), home), {{home}, ""},
                      {stage->scene().task.world_T_target}, "home");
      Leave(*stage, last);
      record_.complete = true;
      record_.reason = "complete";
    } catch (const BuildStop& stop) {
      record_.reason = std::string("all parts stand, but ") + stop.what();
    } catch (const WorldError& error) {
      record_.reason = std::string("all parts stand, but ") + error.what();
    }
    record_.sim_time_s += last.sim_time_s;
    record_.path_length_m += last.path_length_m;
  }

  const Assembly& assembly_;
  const AssemblyPlan& plan_;
  const AssemblyTasks& tasks_;
  const AssemblyOptions& options_;
  std::map<std::string, std::shared_ptr<planner::TravelModel>> travel_;
  std::map<std::string, env::InsertionLimits> limits_;
  std::vector<Pose> poses_;  ///< where every part truly is
  std::optional<env::JointVector> q_rad_;
  double clock_s_ = 0.0;
  AssemblyRecord record_;
};

}  // namespace

AssemblyTasks LoadAssemblyTasks(const Assembly& assembly, const std::vector<std::string>& databases, Parallelism jobs,
                                const ProgressCallback& progress) {
  std::string wanted;
  std::map<std::string, std::shared_ptr<policies::Database>> by_task;
  std::vector<std::string> used;
  for (const AssemblyInsertion& insertion : assembly.insertions) {
    if (by_task.emplace(insertion.task, nullptr).second) {
      used.push_back(insertion.task);
      wanted += (wanted.empty() ? "" : ", ") + insertion.task;
    }
  }
  for (const std::string& path : databases) {
    auto database = std::make_shared<policies::Database>(policies::Database::OpenReadOnly(path));
    const PlanningSetupOptions options = SetupOptionsOf(database->identity());
    bool matched = false;
    for (const std::string& name : used) {
      env::TaskModel model = *assembly.tasks.at(name);
      model.task.goal = options.goal.value_or(model.task.goal);
      model.task.cost = options.cost.value_or(model.task.cost);
      if (env::Fingerprint(model, options.opening) != database->identity().fingerprint) continue;
      matched = true;
      if (by_task[name]) {
        throw InputError(path, fmt::format("a second database of task {}, beside {}", name, by_task[name]->path()),
                         "give one per task");
      }
      by_task[name] = database;
    }
    if (!matched) {
      throw InputError(path,
                       fmt::format("made for task {} or another version of it, which {} does not use",
                                   database->identity().task, assembly.name),
                       "the assembly uses " + wanted);
    }
  }
  for (const std::string& name : used) {
    if (!by_task[name]) {
      throw InputError("--db", fmt::format("none of the databases is of task {}", name),
                       fmt::format("make one: feeler preprocess --task {} --out FILE.db", name));
    }
  }
  AssemblyTasks tasks;
  for (const std::string& name : used) {
    PlanningSetupOptions options = SetupOptionsOf(by_task[name]->identity());
    options.jobs = jobs;
    options.progress = progress;
    tasks[name] = {std::make_shared<const PlanningSetup>(LoadPlanningSetup(name, options)), by_task[name],
                   std::make_shared<execution::OnlinePlanner>()};
  }
  return tasks;
}

AssemblyRecord BuildAssembly(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                             const AssemblyOptions& options) {
  return Builder(assembly, plan, tasks, options).Run();
}

}  // namespace feeler::workflow
