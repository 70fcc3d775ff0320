#include "feeler/cli/execute/executing.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <ctime>
#include <filesystem>
#include <utility>

#include "feeler/cli/common/console.h"
#include "feeler/core/clock.h"
#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/execution/records/pose_error.h"
#include "feeler/execution/records/scored_reason.h"
#include "feeler/execution/remote/dry_robot.h"
#include "feeler/execution/remote/token_file.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/policies/database_policy.h"

namespace feeler::cli {
namespace {

using execution::EpisodeReply;
using execution::ExecutorOptions;

/// As feeler run: expansions a step for a problem that the database does not hold.
constexpr std::int64_t kOutsideExpansions = 3000;
constexpr double kRedial_s = 10.0;
/// A sensor that tells contacts late may raise the force budget of the task so many times, unasked.
constexpr double kMostRise = 2.0;

execution::CellFile CellOf(const ExecuteFlags& flags) {
  return flags.cell.empty() ? execution::CellFile{} : execution::ReadCellFile(flags.cell);
}

}  // namespace

std::string Executing::UtcNow() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

Executing::Executing(const ExecuteFlags& flags, const Session& session)
    : flags_(flags),
      session_(session),
      operator_(session.cancellation),
      cell_(CellOf(flags)),
      database_(policies::Database::OpenReadOnly(flags.db)),
      bundle_(policies::ReadBundleOf(database_)) {
  if (!flags.task.empty() && flags.task != bundle_.task.name &&
      !flags.task.ends_with("/" + bundle_.task.name + ".xml") && flags.task != bundle_.task.name + ".xml") {
    throw InputError("--task", "'" + flags.task + "' is not the task of " + flags.db + ", '" + bundle_.task.name + "'",
                     "give the database of the task");
  }
  if (!cell_.tool.empty() && cell_.tool != bundle_.task.name) {
    throw InputError(flags.cell,
                     "was measured with the tool of '" + cell_.tool + "', not of '" + bundle_.task.name + "'",
                     "calibrate with the tool that is held");
  }
  if (!flags.extents.empty()) {
    asked_ = planner::ParseExtents(flags.extents, bundle_.task);
    planner::RequireWithinTask({{*asked_}, flags.extents}, bundle_.task);
  }
  dialler_ = std::make_unique<execution::Dialler>("--robot", flags.robot, WayToRobot(),
                                                  [](const std::string& text) { Note("feeler: {}\n", text); });
  robot_ = dialler_->Dial();
  FindArm();
  if (!cell_.robot.empty() && cell_.robot != welcome().robot) {
    throw InputError(flags.cell, "is of the robot '" + cell_.robot + "', and here is '" + welcome().robot + "'",
                     "calibrate this cell");
  }
  if (welcome().simulated && !flags.estimate.empty()) {
    throw InputError("--estimate", "a simulation says itself where the target is believed to stand",
                     "leave --estimate out");
  }
  if (!welcome().simulated) {
    if (flags.estimate.empty()) {
      throw InputError("--estimate", "missing: a robot does not say where the target is",
                       "give x,y,z,qw,qx,qy,qz, or --depth or --cloud");
    }
    if (flags.extents.empty())
      throw InputError("--extents", "missing", "say how uncertain the estimate is, e.g. 7x7x7");
    if (flags.box.empty() && !cell_.box) Note("feeler: no workspace box is given: the robot's own limits hold\n");
  }
}

void Executing::FindArm() {
  const bool told = !welcome().state.joints_rad.empty();
  if (!flags_.arm.empty()) {
    if (!told) {
      throw InputError("--arm", "'" + welcome().robot + "' does not tell where its joints are",
                       "update the robot's program, or leave --arm away");
    }
    arm_.emplace(planner::SerialArm::FromUrdf(flags_.arm, flags_.arm_base));
    return;
  }
  const std::string& name = welcome().capabilities.arm;
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
  if (told && !name.empty() && plain) {
    const std::filesystem::path file = FindData("models") / "robots" / (name + ".urdf");
    std::error_code ignored;
    if (std::filesystem::exists(file, ignored))
      arm_.emplace(planner::SerialArm::FromUrdf(file.string(), flags_.arm_base));
  }
  if (!arm_) {
    Note("feeler: joint limits and singularities are left to the robot: {}\n",
         told ? "give --arm URDF to have them checked" : "it does not tell where its joints are");
  }
}

execution::RemoteOptions Executing::WayToRobot() const {
  execution::RemoteOptions options;
  options.token = execution::ReadTokenFile(flags_.token_file);
  options.form = flags_.wire == "numbers" ? execution::WireForm::kNumbers : execution::WireForm::kJson;
  options.heartbeat_s = flags_.heartbeat_s;
  options.link_timeout_s = flags_.link_timeout_s;
  options.cancellation = session_.cancellation;
  options.measured = {cell_.stiffness_n_m, cell_.reaction_time_s, cell_.force_noise_n};
  return options;
}

bool Executing::Redial() {
  robot_.reset();
  const double end_s = execution::MonotonicSeconds() + kRedial_s;
  while (execution::MonotonicSeconds() < end_s && !session_.cancellation->cancelled()) {
    try {
      robot_ = dialler_->Dial();
      if (started_) robot_->Start();
      return true;
    } catch (const Error& error) {
      Note("feeler: {}\n", error.what());
      usleep(20'000);
    }
  }
  return false;
}

std::int64_t Executing::most() const {
  constexpr std::int64_t kAll = 10'000'000;
  if (flags_.dry_run) return 1;
  if (flags_.episodes > 0) return flags_.episodes;
  return welcome().simulated ? kAll : 1;
}

void Executing::RecoverIfStopped() {
  if (robot_->State().mode != execution::RobotMode::kProtectiveStop) return;
  if (flags_.recover == "never") throw NegativeResult("robot", "is in a protective stop", "look at it, then recover");
  if (!operator_.Agrees("The robot is in a protective stop. Look at it; press Enter to recover: ")) {
    throw NegativeResult("robot", "is in a protective stop, and nobody recovered it", "look at it, then recover");
  }
  robot_->Recover();
}

void Executing::Start() {
  if (flags_.dry_run) return;
  RecoverIfStopped();
  if (!welcome().simulated && !flags_.start) {
    const std::string question = fmt::format(
        "{} is about to move ({}). Is the cell clear, and the stop at hand? Press Enter to start: ", welcome().robot,
        bundle_.task.name);
    if (!operator_.Agrees(question)) {
      throw NegativeResult("operator", "did not start the robot", "answer, or give --start when somebody stands by");
    }
  }
  robot_->Start();
  started_ = true;
}

void Executing::RequireSound() const {
  const std::string lost = robot_->lost();
  if (welcome().simulated || lost.empty()) return;
  if (robot_->spoke_nonsense()) throw InputError("robot", lost, "see its program");
  throw WorldError("robot", "link lost: " + lost, "see that it runs and that the network holds");
}

EpisodeReply Executing::ToldByOperator() const {
  EpisodeReply told;
  told.task = bundle_.task.name;
  told.noise = "real";
  told.placement = "estimate";
  told.extents = planner::ToCounts(*asked_);
  told.world_T_estimate = ParseEstimate(flags_.estimate);
  told.contact_threshold_n = cell_.contact_force_n.value_or(welcome().capabilities.contact_force_n);
  told.episode = static_cast<std::uint64_t>(done_);
  return told;
}

std::optional<EpisodeReply> Executing::Told() {
  if (!welcome().simulated) {
    if (!robot_->lost().empty()) return std::nullopt;
    if (done_ > 0) RecoverIfStopped();
    return ToldByOperator();
  }
  const std::vector<int> wished = asked_ ? planner::ToCounts(*asked_) : std::vector<int>{};
  EpisodeReply told;
  for (;;) {
    try {
      told = robot_->BeginEpisode(static_cast<std::uint64_t>(done_), wished);
      break;
    } catch (const WorldError&) {
      if (robot_->lost().empty() && done_ > 0) return std::nullopt;  // all that are offered are done
      if (robot_->lost().empty() || !Redial()) throw;
    }
  }
  if (told.task != bundle_.task.name) {
    throw InputError("--robot",
                     "simulates the task '" + told.task + "', the database is of '" + bundle_.task.name + "'",
                     "give the database of that task");
  }
  if (asked_ && !(planner::FromCounts(told.extents) == *asked_)) {
    throw InputError("--extents",
                     "are " + flags_.extents + ", and the simulation draws from " +
                         planner::ToString(planner::FromCounts(told.extents)),
                     "start feeler simulate with the same --extents, or with none");
  }
  return told;
}

std::unique_ptr<policies::Policy> Executing::PolicyFor(const planner::Extents& extents) {
  const auto [known, added] = stored_.try_emplace(extents);
  if (added) {
    std::optional<policies::StoredProblem> stored = database_.Get(extents);
    if (stored && stored->policy) {
      known->second = std::make_shared<const planner::PolicyGraph>(*std::move(stored->policy));
    } else {
      Note("feeler: {} holds no policy for {}: planned while the robot waits\n", flags_.db, planner::ToString(extents));
    }
  }
  if (known->second) return std::make_unique<policies::DatabasePolicy>(known->second);
  policies::OnlineOptions online;
  online.expansion_limit = kOutsideExpansions;
  return std::make_unique<policies::OnlinePolicy>(online, tables_);
}

double Executing::BudgetFor(double contact_threshold_n) const {
  constexpr double kAboveThreshold = 1.2;
  const double task_n = bundle_.task.force_budget_n;
  const double needed_n = kAboveThreshold * contact_threshold_n;
  if (needed_n > kMostRise * task_n) {
    throw InputError("--force-budget",
                     fmt::format("the sensor tells contacts from {:g} N on, and the task allows {:g} N",
                                 contact_threshold_n, task_n),
                     "mend the contact force of the robot or the cell file, or give a budget that the parts stand");
  }
  if (needed_n > task_n) Note("feeler: the force budget is {:.1f} N: the sensor tells no contact below\n", needed_n);
  return std::max(task_n, needed_n);
}

ExecutorOptions Executing::OptionsFor(const EpisodeReply& told, bool angles) const {
  ExecutorOptions options = execution::OptionsForThreshold(told.contact_threshold_n);
  // What the operator asks for; what a simulation states; what the task says, above what the sensor needs.
  options.force_budget_n = flags_.force_budget_n > 0.0 ? flags_.force_budget_n
                           : told.force_budget_n > 0.0 ? told.force_budget_n
                                                       : BudgetFor(told.contact_threshold_n);
  options.ladder = !flags_.no_ladder;
  options.online_planner = online_planner_;
  if (angles) options.travel_model = policies::TravelModelOf(bundle_);
  if (flags_.confirm_limit_m > 0.0) options.confirm_limit_m = flags_.confirm_limit_m;
  if (flags_.live || (isatty(STDERR_FILENO) != 0 && !flags_.dry_run)) {
    options.on_motion = [this](const execution::ExecutionRecord& record) { ShowMotion(record); };
  }
  return options;
}

void Executing::ShowMotion(const execution::ExecutionRecord& record) const {
  const execution::MoveRecord& move = record.moves.back();
  const std::size_t left =
      record.decisions.empty() ? static_cast<std::size_t>(record.hypotheses) : record.decisions.back().left.size();
  Note("{:4} {:8} {:2} {:6.1f} of {:6.1f} mm  {:7}  {:5.1f} N  {} of {} hypotheses left\n", record.moves.size(),
       move.kind, move.direction, 1e3 * move.travelled_m, 1e3 * move.commanded_m, move.contact ? "contact" : "free",
       move.peak_force_n, left, record.hypotheses);
}

execution::SafetyLimits Executing::LimitsFor(const ExecutorOptions& options) {
  execution::SafetyLimits limits;
  if (cell_.box) limits.box = *cell_.box;
  if (!flags_.box.empty()) limits.box = ParseBox("--box", flags_.box);
  limits.robot = welcome().capabilities;
  limits.speed_scale = flags_.speed;
  limits.most_compliant_n = options.insertion_force_limit_n;
  limits.force_budget_n = options.force_budget_n;
  if (arm_) {
    // A dry run leaves the arm where it is: the check follows the joints by itself.
    limits.way_fault = [this, asked = false](const execution::PlannedWay& way) mutable {
      const bool told = !flags_.dry_run || !asked;
      asked = true;
      return arm_->FaultOf(told ? robot_->JointPositions() : std::vector<double>{}, way);
    };
  }
  return limits;
}

void Executing::Judge(const EpisodeReply& told, ExecutedEpisode& episode) {
  execution::EpisodeLine& line = episode.line;
  line.reason = (flags_.dry_run ? "dry run, as if: " : "") + episode.execution.reason;
  line.peak_force_n = episode.execution.peak_force_n;
  if (!welcome().simulated || flags_.dry_run) return;
  if (episode.link_lost && !Redial()) return;
  execution::VerdictReply verdict;
  try {
    verdict = robot_->Verdict();
  } catch (const WorldError& error) {
    Note("feeler: no verdict on episode {}: {}\n", told.episode, error.what());
    episode.link_lost = true;
    if (!Redial()) return;
    verdict = robot_->Verdict();
  }
  line.world_T_true = verdict.world_T_true;
  line.truth_outside = verdict.truth_outside;
  line.fault_values = verdict.fault_values;
  line.contact_parameters = verdict.contact_parameters;
  line.localized = false;
  if (episode.execution.world_T_estimate) {
    line.error = execution::PoseErrorOf(bundle_.task, verdict.world_T_true, *episode.execution.world_T_estimate);
    line.localized = execution::WithinTolerance(bundle_.task.tolerance, *line.error);
  }
  line.inserted = verdict.inserted;
  line.reason = execution::ScoredReason(verdict.inserted, verdict.reason, episode.execution);
  line.depth_m = verdict.depth_m;
  line.lateral_m = verdict.lateral_m;
  line.peak_force_n = verdict.peak_force_n;
  line.impulse_ns = verdict.impulse_ns;
  line.forbidden_contacts = verdict.forbidden_contacts;
  if (!verdict.replay.is_null()) line.replay = verdict.replay;
}

std::optional<ExecutedEpisode> Executing::RunNext() {
  const double cpu_start_s = ThreadCpuSeconds();
  const std::optional<EpisodeReply> told = Told();
  if (!told) return std::nullopt;
  ++done_;
  const planner::Extents extents = planner::FromCounts(told->extents);
  ExecutedEpisode episode;
  execution::EpisodeLine& line = episode.line;
  line.task = bundle_.task.name;
  line.noise = told->noise;
  line.dry = flags_.dry_run;
  if (!welcome().simulated) line.started = begun_;
  line.seed = told->seed;
  line.episode = told->episode;
  line.placement = told->placement;
  line.rejected_placements = told->rejected_placements;
  line.extents = told->extents;
  line.world_T_estimate0 = told->world_T_estimate;
  if (!told->failure.empty()) {
    line.reason = told->failure;
    return episode;
  }
  const Task& task = bundle_.task;
  const planner::Problem problem = planner::MakeCuboidProblem(task, bundle_.map, extents);
  const double plan_start_s = ThreadCpuSeconds();
  const std::unique_ptr<policies::Policy> policy = PolicyFor(extents);
  const double lookup_cpu_s = ThreadCpuSeconds() - plan_start_s;
  line.policy = policy->name();
  const ExecutorOptions options = OptionsFor(*told, bundle_.map->orientations() > 1);

  std::unique_ptr<execution::DryRobot> dry;
  if (flags_.dry_run) {
    // A little off the lattice, as a true pose is.
    const Pose truth = told->world_T_estimate * MakePose(task.cell_m * Eigen::Vector3d(0.2, -0.15, 0.1));
    dry = std::make_unique<execution::DryRobot>(policies::TravelModelOf(bundle_), truth, robot_->ToolPose());
  }
  Robot& behind = dry ? static_cast<Robot&>(*dry) : *robot_;
  execution::CheckedRobot robot(behind, LimitsFor(options));
  if (flags_.dry_run || flags_.step) {
    robot.SetAsk([&](const execution::PlannedMotion& motion) -> std::string {
      const std::string text = execution::Describe(motion, behind.ToolPose());
      if (flags_.dry_run && flags_.json) Note("{}\n", text);
      if (flags_.dry_run && !flags_.json) Print("{}\n", text);
      if (!flags_.step) return "";
      return operator_.Agrees(text + "  [Enter: go, anything else: stop] ") ? "" : "the operator said no";
    });
  }
  const double robot_start_s = robot.Time();
  const double wall_start_s = execution::MonotonicSeconds();
  const double transfer_start_s = ThreadCpuSeconds();
  const MotionResult transfer = robot.Transfer(execution::LatticeStartPose(task, problem, told->world_T_estimate));
  line.transfer_cpu_s = ThreadCpuSeconds() - transfer_start_s;
  if (transfer.reason == StopReason::kReached) {
    episode.execution = execution::Execute(task, problem, told->world_T_estimate, *policy, robot, options);
  } else {
    episode.execution.reason = execution::TransferFailure(transfer);
  }
  episode.robot_s = robot.Time() - robot_start_s;
  episode.wall_s = execution::MonotonicSeconds() - wall_start_s;
  episode.execution.force_budget_n = options.force_budget_n;
  episode.link_lost = !robot_->lost().empty();
  Judge(*told, episode);
  line.plan_cpu_s = lookup_cpu_s + episode.execution.policy_cpu_s;
  line.cpu_s = ThreadCpuSeconds() - cpu_start_s;
  return episode;
}

}  // namespace feeler::cli
