#include "feeler/workflow/episode/served_episodes.h"

#include <fmt/format.h>

#include <utility>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::workflow {
namespace {

/// What the simulated UR10e states about itself: its data sheet, its options, and its world.
execution::Capabilities CapabilitiesOf(const env::SimulatedRobot& robot, const EpisodeFaults& faults) {
  constexpr double kReach_m = 1.5;      // of flange and tool
  constexpr double kPayload_kg = 12.5;  // data sheet of the UR10e
  execution::Capabilities c;
  c.arm = "ur10e";
  c.motions = {"transfer", "linear", "guarded", "compliant", "twist", "look"};
  c.payload_kg = kPayload_kg;
  c.force_noise_n = faults.robot.force_noise_n;
  c.contact_force_n = faults.robot.contact_threshold_n;
  constexpr double kReaction_s = 0.002;  // two steps of physics
  c.reaction_time_s = kReaction_s + faults.robot.force_delay_s;
  c.stopping_time_s = robot.options().settle_time_limit_s;
  c.max_speed_m_s = env::ActionBounds{}.speed_m_s;
  c.max_force_n = env::ActionBounds{}.force_n;
  c.workspace_min_m = Eigen::Vector3d(-kReach_m, -kReach_m, -0.5);
  c.workspace_max_m = Eigen::Vector3d(kReach_m, kReach_m, 2.0);
  return c;
}

}  // namespace

ServedEpisodes::ServedEpisodes(EpisodeRunner runner, std::int64_t episodes, bool any_extents,
                               std::function<nlohmann::json(const Replay&)> replay_json)
    : runner_(std::move(runner)), episodes_(episodes), any_extents_(any_extents), replay_json_(std::move(replay_json)) {
  // The robot waits at home as it is, its sensor no better than in an episode.
  env::SimulatedRobot& robot = runner_.environment().robot();
  const env::Scene& scene = robot.world().scene();
  robot.Reset(scene.home_q_rad, scene.task.world_T_target, runner_.faults().robot,
              RandomStream(runner_.options().seed, 0, "before the first episode"));
}

execution::ServedRobot ServedEpisodes::Robot() {
  env::SimulatedRobot& robot = runner_.environment().robot();
  execution::ServedRobot served{robot, "UR10e, simulated", CapabilitiesOf(robot, runner_.faults()), {}, {}, {}, {}, {}};
  served.ask_while_moving = [&robot](std::function<std::string()> question) {
    robot.SetInterruption(std::move(question));
  };
  served.slow_transfers = [&robot](double factor) { robot.SlowTransfers(factor); };
  served.begin_episode = [this](const execution::EpisodeRequest& asked) { return Begin(asked); };
  served.judge = [this] { return Judge(); };
  served.after_transfer = [this](const MotionResult& /*result*/) {
    if (!arrived_ && recorder_) recorder_->MarkStart(runner_.environment().robot().Time());
    arrived_ = true;
  };
  return served;
}

execution::EpisodeReply ServedEpisodes::Begin(const execution::EpisodeRequest& asked) {
  const std::int64_t number = asked.episode ? static_cast<std::int64_t>(*asked.episode) : current_ + 1;
  if (number < 0 || number >= episodes_) {
    throw NegativeResult("episodes", fmt::format("number {} of {} (from 0) is not offered", number, episodes_),
                         "start the simulation with more --episodes");
  }
  std::optional<planner::Extents> extents;
  if (any_extents_ && !asked.extents.empty()) {
    extents = planner::FromCounts(asked.extents);
    planner::RequireWithinTask({{*extents}, ""}, runner_.task());
  }
  env::SimulatedRobot& robot = runner_.environment().robot();
  robot.SetObserver({}, 0.0);
  record_ = runner_.Begin(static_cast<std::uint64_t>(number), extents);
  current_ = number;
  arrived_ = judged_ = false;
  begun_ = true;
  if (replay_json_) {
    recorder_ = std::make_unique<ReplayRecorder>(robot.world().scene());
    robot.SetObserver([recorder = recorder_.get()](const env::World& world) { recorder->See(world); }, 0.0);
    recorder_->See(robot.world());
  }
  execution::EpisodeReply reply;
  reply.seed = record_.seed;
  reply.episode = record_.episode;
  reply.task = record_.task;
  reply.noise = record_.noise;
  reply.placement = record_.placement;
  reply.rejected_placements = record_.rejected_placements;
  reply.extents = planner::ToCounts(record_.extents);
  reply.world_T_estimate = record_.world_T_estimate0;
  reply.contact_threshold_n = runner_.faults().robot.contact_threshold_n;
  reply.force_budget_n = runner_.force_budget_n();
  reply.failure = record_.reason;
  return reply;
}

execution::VerdictReply ServedEpisodes::Judge() {
  if (!begun_) throw NegativeResult("verdict", "no episode has begun", "ask for an episode first");
  if (judged_) return verdict_;
  env::SimulatedRobot& robot = runner_.environment().robot();
  robot.SetObserver({}, 0.0);
  verdict_ = {};
  if (recorder_) verdict_.replay = replay_json_(recorder_->Take(robot.world()));
  runner_.Score(record_);
  verdict_.world_T_true = record_.world_T_true;
  verdict_.truth_outside = record_.truth_outside;
  verdict_.fault_values = record_.fault_values;
  verdict_.contact_parameters = record_.contact_parameters;
  verdict_.inserted = record_.inserted;
  verdict_.reason = record_.verdict;
  verdict_.depth_m = record_.depth_m;
  verdict_.lateral_m = record_.lateral_m;
  verdict_.peak_force_n = record_.peak_force_n;
  verdict_.impulse_ns = record_.impulse_ns;
  verdict_.forbidden_contacts = record_.forbidden_contacts;
  judged_ = true;
  return verdict_;
}

}  // namespace feeler::workflow
