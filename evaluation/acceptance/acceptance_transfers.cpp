#include "feeler/evaluation/acceptance/acceptance_transfers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "feeler/core/clock.h"
#include "feeler/core/random.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/env/robot/transfer_checker.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/planner/motion/time_parametrization.h"

namespace feeler::evaluation {
namespace {

constexpr std::array kScenes = {"table", "fixtures", "pillar", "wall"};
constexpr int kDrawsPerGoal = 1000;

Pose DrawPose(RandomStream& random) {
  const Eigen::Vector3d position(random.Uniform(0.35, 0.90), random.Uniform(-0.48, 0.48), random.Uniform(0.03, 0.55));
  const double yaw = random.Uniform(-std::numbers::pi, std::numbers::pi);
  const double tilt = random.Uniform(0.0, 20.0 * std::numbers::pi / 180.0);
  const double towards = random.Uniform(-std::numbers::pi, std::numbers::pi);
  Pose pose = MakePose(position, yaw);
  pose.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(towards), std::sin(towards), 0.0)) * pose.linear();
  return pose;
}

bool CanStand(env::TransferChecker& checker, const env::Scene& scene, const Pose& world_T_tool) {
  const std::vector<env::JointVector> branches = env::ToolInverseKinematics(scene, world_T_tool);
  return std::any_of(branches.begin(), branches.end(), [&](const env::JointVector& q) { return checker.Free(q); });
}

/// The motion that the robot will make along the way points, with its own limits and timing.
planner::JointTrajectory Motion(const env::Scene& scene, const env::RobotOptions& options,
                                const std::vector<Eigen::VectorXd>& way_points) {
  planner::MotionLimits limits;
  limits.velocity_rad_s = options.joint_speed_fraction * scene.velocity_limit_rad_s;
  limits.acceleration_rad_s2 = env::JointVector::Constant(options.joint_acceleration_rad_s2);
  planner::TimeParametrizationOptions timing;
  timing.reach_m = env::JointVector::Constant(1.5);
  return planner::Parametrize(way_points, limits, timing);
}

}  // namespace

TransferTrials TryTransfers(const env::Scene& scene, const std::string& name, int count, std::uint64_t seed) {
  TransferTrials trials;
  trials.scene = name;
  const auto shared = std::make_shared<const env::Scene>(scene);
  env::TransferChecker checker(scene);
  RandomStream random(seed, 0, "transfers " + name);

  env::TransferSettings settings;
  std::optional<planner::TransferPlan> plan;
  env::RobotOptions options;
  options.transfer_planner = [&](const env::World&, const env::JointVector& start, const Pose& goal) {
    const double begun_s = ThreadCpuSeconds();
    plan = env::PlanTransfer(checker, scene, start, goal, settings);
    trials.planning_cpu_s.push_back(ThreadCpuSeconds() - begun_s);
    trials.checks.push_back(plan->checks);
    return std::vector<env::JointVector>(plan->way_points.begin(), plan->way_points.end());
  };
  env::SimulatedRobot robot(shared, options);
  robot.Reset(scene.home_q_rad, scene.task.world_T_target, {}, RandomStream(seed, 0, "sensor"));

  std::optional<planner::JointTrajectory> motion;
  double begun_s = 0.0;
  bool touched = false;
  const env::JointVector speed_limit = options.joint_speed_fraction * scene.velocity_limit_rad_s;
  robot.SetObserver(
      [&](const env::World& world) {
        if (!motion) {
          motion = Motion(scene, options, plan->way_points);
          trials.duration_s.push_back(motion->duration_s());
        }
        touched = touched || world.data().ncon > 0;
        const planner::JointState wanted = motion->Sample(world.time_s() - begun_s);
        const Pose wanted_tool = env::ToolForwardKinematics(scene, wanted.q_rad);
        trials.tracking_error_m =
            std::max(trials.tracking_error_m, (world.ToolPose().translation() - wanted_tool.translation()).norm());
        trials.joint_speed_fraction =
            std::max(trials.joint_speed_fraction, world.qd_rad_s().cwiseAbs().cwiseQuotient(speed_limit).maxCoeff());
        trials.joint_acceleration_fraction =
            std::max(trials.joint_acceleration_fraction,
                     wanted.qdd_rad_s2.cwiseAbs().maxCoeff() / options.joint_acceleration_rad_s2);
      },
      scene.model->opt.timestep);

  for (int trial = 0; trial < count; ++trial) {
    Pose goal = DrawPose(random);
    int draws = 1;
    while (!CanStand(checker, scene, goal) && draws < kDrawsPerGoal) {
      goal = DrawPose(random);
      ++draws;
    }
    trials.drawn += draws;
    if (draws == kDrawsPerGoal) break;
    ++trials.tried;
    settings.seed = random.Next();
    motion.reset();
    touched = false;
    begun_s = robot.Time();
    const MotionResult result = robot.Transfer(goal);
    if (result.reason == StopReason::kUnplanned) {
      ++trials.unsolved[plan->reason];
      continue;
    }
    ++trials.solved;
    trials.way_points.push_back(static_cast<double>(plan->way_points.size()));
    const bool there =
        result.reason == StopReason::kReached && (result.world_T_tool.translation() - goal.translation()).norm() < 1e-3;
    trials.reached += there ? 1 : 0;
    trials.touched += touched || result.contact ? 1 : 0;
  }
  return trials;
}

ExperimentResult RunAcceptanceTransfers(const ExperimentRequest& request) {
  const int count = request.quick ? 15 : 250;
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"transfers_per_scene", count}, {"clearance_m", env::TransferSettings().clearance_m}};
  result.table.columns = {"scene",
                          "tried",
                          "solved",
                          "planning_median_ms",
                          "planning_p95_ms",
                          "planning_max_ms",
                          "checks_median",
                          "way_points_mean",
                          "reached",
                          "touched",
                          "tracking_error_max_mm",
                          "joint_speed_max_fraction",
                          "joint_acceleration_max_fraction",
                          "duration_median_s"};
  result.text = fmt::format("{:<10} {:>6} {:>7} {:>22} {:>8} {:>8} {:>11} {:>9}\n", "scene", "tried", "solved",
                            "planning ms (med/p95)", "reached", "touched", "tracking mm", "duration s");
  result.details = nlohmann::json::object();
  std::int64_t done = 0;
  for (const char* name : kScenes) {
    if (request.cancellation != nullptr && request.cancellation->cancelled()) return result;
    const std::string file = (env::ModelsFolder() / "scenes" / (std::string(name) + ".xml")).string();
    const env::Scene scene = env::BuildScene(env::LoadTask(file));
    const TransferTrials t = TryTransfers(scene, name, count, request.seed);
    const double median_ms = 1e3 * Median(t.planning_cpu_s);
    const double p95_ms = 1e3 * Quantile(t.planning_cpu_s, 0.95);
    result.table.rows.push_back({name, t.tried, t.solved, median_ms, p95_ms, 1e3 * Quantile(t.planning_cpu_s, 1.0),
                                 Median(t.checks), Mean(t.way_points), t.reached, t.touched, 1e3 * t.tracking_error_m,
                                 t.joint_speed_fraction, t.joint_acceleration_fraction, Median(t.duration_s)});
    result.text += fmt::format("{:<10} {:>6} {:>7} {:>22} {:>8} {:>8} {:>11.3f} {:>9.2f}\n", name, t.tried, t.solved,
                               fmt::format("{:.1f} / {:.1f}", median_ms, p95_ms), t.reached, t.touched,
                               1e3 * t.tracking_error_m, Median(t.duration_s));
    result.details[name] = {{"drawn", t.drawn}, {"unsolved", t.unsolved}};
    if (request.progress) request.progress(++done, static_cast<std::int64_t>(kScenes.size()));
  }
  result.complete = true;
  return result;
}

}  // namespace feeler::evaluation
