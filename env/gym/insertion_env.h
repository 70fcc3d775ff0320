#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/random.h"
#include "feeler/core/robot.h"
#include "feeler/core/task.h"
#include "feeler/env/gym/insertion_judge.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/env/scene/episode_variation.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/vision/renderer.h"

namespace feeler::env {

/// A straight guarded motion in world axes.
struct GuardedMoveAction {
  GuardedMotion motion;
};
/// Free motion to a pose: around obstacles, or, if `straight`, along a line and watched for contact.
struct TransferAction {
  Pose world_T_tool = Pose::Identity();
  bool straight = false;
  double speed_m_s = 0.25;        ///< if straight
  double contact_force_n = 10.0;  ///< if straight
};
/// Compliant motion along the insertion direction of the estimated target, from where the tool is.
struct InsertAction {
  double distance_m = 0.02;
  double speed_m_s = 0.02;
  double force_limit_n = 60.0;
  double time_limit_s = 10.0;
};
/// For learners: moves the set point of the compliant tool by `delta` and simulates `steps` milliseconds.
struct LowLevelAction {
  Vector6 delta = Vector6::Zero();  ///< m and rad in world axes, linear first
  int steps = 1;
};
using Action = std::variant<GuardedMoveAction, TransferAction, InsertAction, LowLevelAction>;

/// What an action may ask for; more is an InputError.
struct ActionBounds {
  double distance_m = 1.0;
  double speed_m_s = 0.5;
  double force_n = 250.0;
  double delta_m = 0.005;
  double delta_rad = 0.02;
  int steps = 1000;
};

/// What a policy may see. SI units, world axes, as measured (noise included).
struct Observation {
  JointVector q_rad = JointVector::Zero();
  JointVector qd_rad_s = JointVector::Zero();
  Pose world_T_tool = Pose::Identity();
  Wrench raw_wrench;
  Wrench filtered_wrench;
  bool contact = false;      ///< the last action met contact
  double travelled_m = 0.0;  ///< by the last action
};

struct Info {
  std::array<bool, kContactPairCount> contact_pairs{};  ///< by ContactPair, with hysteresis
  StopReason stop_reason = StopReason::kReached;        ///< of the last action
  std::string detail;                                   ///< for people, e.g. why the world failed
  double action_peak_force_n = 0.0;                     ///< measured, in the last action
  double peak_force_n = 0.0;                            ///< exact, in the episode
  double sim_time_s = 0.0;
  double path_length_m = 0.0;
  Pose world_T_estimate = Pose::Identity();  ///< where the target is believed to be
  std::optional<Pose> world_T_target;        ///< the truth, for scoring only; absent if withheld
  bool inserted = false;
  InsertionReason insertion_reason = InsertionReason::kTooShallow;
};

struct StepResult {
  Observation observation;
  double reward = 0.0;
  bool terminated = false;  ///< inserted, or something broke (force, unstable physics)
  bool truncated = false;   ///< the time limit passed; independent of `terminated`
  Info info;
};

enum class StartPlace { kStartPose, kHome };

/// What may differ from episode to episode.
struct ResetOptions {
  std::uint64_t episode = 0;             ///< with the seed, keys every random draw
  std::optional<Pose> world_T_estimate;  ///< default: as the task file places the target
  std::optional<Pose> world_T_target;    ///< default: drawn around the estimate
  std::vector<int> extents;              ///< hypotheses per axis of the task; default: its largest
  /// Where the target may stand, in place of the box that `extents` describe: a truth that is not given is one of
  /// these, and transfers keep clear of all of them.
  std::vector<Pose> hypotheses;
  NoiseOptions noise;
  std::optional<PhysicsVariation> physics;  ///< on top of what the task file randomizes
  StartPlace start = StartPlace::kStartPose;
  bool withhold_true_pose = false;  ///< all else is the same, bit for bit
  bool randomize = true;            ///< within the ranges of the task file, if it has any; a given truth is not turned
};

struct EnvOptions {
  RobotOptions robot;
  ActionBounds bounds;
  std::optional<InsertionLimits> limits;  ///< default: the task's; its time limit truncates the episode
  double reward_per_second = 0.0;         ///< added for every simulated second: negative to favour haste
  RendererOptions renderer;
};

/// Everything that the rest of an episode depends on.
struct EnvState {
  RobotState robot;
  Pose world_T_estimate = Pose::Identity();
  EpisodeVariation variation;
  bool withhold_true_pose = false;
  bool running = false;
};

/// A pose around the estimate, uniform in the box of hypotheses of these extents (one per axis of the task): positions
/// over the lattice span plus half a cell each side, angles over the lattice span; all in axes of the estimated target,
/// angles about its origin (yaw about z, pitch about y).
/// Throws InputError when the extents do not fit the task's axes.
Pose DrawTruePose(const Task& task, const Pose& world_T_estimate, const std::vector<int>& extents,
                  RandomStream& random);

/// The centre and the corners of that box: what transfers keep clear of (TransferChecker::SetTargetPoses).
std::vector<Pose> TargetCandidates(const Task& task, const Pose& world_T_estimate, const std::vector<int>& extents);

/// Where the tool begins: the start offset from the estimate, axes aligned.
Pose NominalStartPose(const Task& task, const Pose& world_T_estimate);

/// Gymnasium's contract: Reset begins an episode, Step carries one action out. Reward: 1 when an action inserts the
/// tool, and reward_per_second * seconds. An action that is not valid throws InputError and changes nothing; so does
/// Step before Reset or after the end of the episode. Same seed and options: the same episode, bit for bit, whatever
/// ran before.
///
/// Laws: a restored state goes on bit for bit, in this environment or another of the same scene; `terminated` and
/// `truncated` are independent; every observation lies in ObservationSpace() (env/gym/spaces.h).
///
/// An executor written for any Robot drives `robot()` instead of Step, and asks `Judge` when it is done.
/// One thread at a time; any number of environments share a scene.
class InsertionEnv {
 public:
  explicit InsertionEnv(std::shared_ptr<const Scene> scene, const EnvOptions& options = {});

  /// Throws InputError when the start pose is out of reach or in collision, or an option makes no sense; the
  /// environment then waits for a better Reset.
  StepResult Reset(std::uint64_t seed, const ResetOptions& options = {});
  StepResult Step(const Action& action);
  /// Throws the InputError that Step would: no episode is running, or the action is not valid.
  void RequireWelcome(const Action& action) const;

  /// The whole state, between steps.
  EnvState Save() const;
  /// Throws InputError for the state of another model; the environment is then as it was.
  void Restore(const EnvState& state);

  /// The truth of the present instant.
  InsertionVerdict Judge() const;

  /// A picture of the world as it is; the first one makes a renderer (EGL), of the size in the options. Throws
  /// InputError when that cannot be.
  Image Render(const Camera& camera);
  Image Render() { return Render(OverviewCamera(robot_.world().scene())); }
  DepthImage RenderDepth(const Camera& camera);

  SimulatedRobot& robot() { return robot_; }
  const SimulatedRobot& robot() const { return robot_; }
  const Task& task() const { return robot_.world().scene().task; }
  const Pose& world_T_estimate() const { return estimate_; }
  const InsertionLimits& limits() const { return limits_; }
  const EnvOptions& options() const { return options_; }
  /// What was drawn for this episode.
  const EpisodeVariation& variation() const { return variation_; }
  /// Whether a Step is welcome.
  bool running() const { return running_; }

 private:
  void PlaceRobot(const Pose& world_T_target, const ResetOptions& options, const NoiseOptions& noise,
                  const RandomStream& random);
  Renderer& Drawing();
  StepResult Result(const MotionResult& motion) const;

  EnvOptions options_;
  SimulatedRobot robot_;
  InsertionLimits limits_;
  Pose estimate_ = Pose::Identity();
  EpisodeVariation variation_;
  bool withhold_true_pose_ = false;
  bool running_ = false;
  std::unique_ptr<Renderer> renderer_;  ///< made when first needed
  DataHandle drawn_;
};

}  // namespace feeler::env
