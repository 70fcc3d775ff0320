#include "feeler/env/gym/insertion_env.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/orientation_lattice.h"

namespace feeler::env {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

void RequireWithin(double value, double limit, const char* where, const char* what) {
  if (!(value > 0 && value <= limit)) {
    throw InputError(where, fmt::format("{} is {}", what, value), fmt::format("give more than 0, at most {}", limit));
  }
}

/// Each component within the limit, as in the box of ActionSpace.
void RequireWithin(const Eigen::Vector3d& v, double limit, const char* where, const char* what) {
  for (const double value : v) {
    if (!(std::abs(value) <= limit)) {
      throw InputError(where, fmt::format("{} has a component of {}", what, value),
                       fmt::format("give at most {}", limit));
    }
  }
}

/// The place in the box of hypotheses at these fractions of its size, -0.5 to 0.5 along each axis of the task.
Pose PlaceInBox(const Task& task, const Pose& world_T_estimate, const std::vector<int>& extents,
                const std::vector<double>& fractions) {
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double pitch_rad = 0.0;
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const UncertainAxis& axis = task.axes[i];
    const double cells = axis.angular() ? extents[i] - 1 : extents[i];
    const double value = axis.resolution * cells * fractions[i];
    switch (axis.kind) {
      case AxisKind::kX: offset_m.x() = value; break;
      case AxisKind::kY: offset_m.y() = value; break;
      case AxisKind::kZ: offset_m.z() = value; break;
      case AxisKind::kYaw: yaw_rad = value; break;
      case AxisKind::kPitch: pitch_rad = value; break;
    }
  }
  // Around the centre of the angles, which may lie half a step beside the lattice frame.
  const Eigen::Quaterniond frame_R_estimate = FrameREstimate(task, extents);
  const Eigen::Matrix3d world_R_frame = world_T_estimate.linear() * frame_R_estimate.inverse().toRotationMatrix();
  const Eigen::Matrix3d center = frame_R_estimate.toRotationMatrix();
  const double center_yaw_rad = std::atan2(center(1, 0), center(0, 0));
  const double center_pitch_rad = std::atan2(-center(2, 0), center(2, 2));
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(center_yaw_rad + yaw_rad, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(center_pitch_rad + pitch_rad, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  Pose place = world_T_estimate;
  place.translation() += world_R_frame * offset_m;
  place.linear() = world_R_frame * turn;
  return place;
}

bool Touches(const mjData& data) {
  return std::any_of(data.contact, data.contact + data.ncon, [](const mjContact& c) { return c.efc_address >= 0; });
}

}  // namespace

Pose DrawTruePose(const Task& task, const Pose& world_T_estimate, const std::vector<int>& extents,
                  RandomStream& random) {
  if (extents.size() != task.axes.size()) {
    throw InputError("extents",
                     fmt::format("{} given, the task has {} uncertain axes", extents.size(), task.axes.size()),
                     "give one per axis");
  }
  std::vector<double> fractions;
  for (const int extent : extents) {
    if (extent < 1) throw InputError("extents", fmt::format("{} is not an extent", extent), "give 1 or more");
    fractions.push_back(random.Uniform(-0.5, 0.5));
  }
  return PlaceInBox(task, world_T_estimate, extents, fractions);
}

std::vector<Pose> TargetCandidates(const Task& task, const Pose& world_T_estimate, const std::vector<int>& extents) {
  std::vector<Pose> candidates{world_T_estimate};
  for (unsigned corner = 0; corner < 1U << extents.size(); ++corner) {
    std::vector<double> fractions;
    bool twin = false;  // of a corner on the other side of an axis that has but one place
    for (std::size_t i = 0; i < extents.size(); ++i) {
      const bool upper = (corner >> i & 1U) != 0;
      twin = twin || (upper && task.axes[i].angular() && extents[i] == 1);
      fractions.push_back(upper ? 0.5 : -0.5);
    }
    if (!twin) candidates.push_back(PlaceInBox(task, world_T_estimate, extents, fractions));
  }
  return candidates;
}

Pose NominalStartPose(const Task& task, const Pose& world_T_estimate) {
  Pose start = world_T_estimate;
  start.translation() += world_T_estimate.linear() * task.start_offset_m;
  return start;
}

InsertionEnv::InsertionEnv(std::shared_ptr<const Scene> scene, const EnvOptions& options)
    : options_(options),
      robot_(std::move(scene), options.robot),
      limits_(options.limits.value_or(LimitsOf(robot_.world().scene()))) {}

void InsertionEnv::PlaceRobot(const Pose& world_T_target, const ResetOptions& options, const NoiseOptions& noise,
                              const RandomStream& random) {
  const Scene& scene = robot_.world().scene();
  std::vector<JointVector> places = {scene.home_q_rad};
  if (options.start == StartPlace::kStartPose) {
    places = ToolInverseKinematics(scene, NominalStartPose(task(), estimate_));
    std::stable_sort(places.begin(), places.end(), [&](const JointVector& a, const JointVector& b) {
      return (a - scene.home_q_rad).norm() < (b - scene.home_q_rad).norm();
    });
  }
  if (places.empty()) {
    throw InputError("reset", fmt::format("the start pose of task '{}' is out of the robot's reach", task().name),
                     "move the target or change how the robot holds the tool");
  }
  for (const JointVector& q : places) {
    try {
      robot_.Reset(q, world_T_target, noise, random, variation_.physics);
    } catch (const WorldError&) {
      continue;  // so deep in collision that the contacts do not fit their buffer
    }
    if (!Touches(robot_.world().data())) return;
  }
  throw InputError("reset", fmt::format("at the start of task '{}' the robot or its tool is in collision", task().name),
                   "raise the start offset or move the obstacles");
}

StepResult InsertionEnv::Reset(std::uint64_t seed, const ResetOptions& options) {
  running_ = false;
  options.noise.Validate();
  estimate_ = options.world_T_estimate.value_or(task().world_T_target);
  withhold_true_pose_ = options.withhold_true_pose;
  std::vector<int> extents = options.extents;
  if (extents.empty()) {
    for (const UncertainAxis& axis : task().axes) extents.push_back(axis.max_cells);
  }
  variation_ = options.randomize ? DrawVariation(robot_.world().scene().randomization, seed, options.episode)
                                 : EpisodeVariation{};
  if (options.physics) {
    variation_.physics.contact_friction *= options.physics->contact_friction;
    variation_.physics.tool_slip_m += options.physics->tool_slip_m;
    variation_.physics.tool_turn_rad += options.physics->tool_turn_rad;
    variation_.physics.tool_mass *= options.physics->tool_mass;
    variation_.physics.clearance_m += options.physics->clearance_m;
    variation_.physics.joint_friction_nm += options.physics->joint_friction_nm;
    variation_.physics.port_stiffness_n_m = options.physics->port_stiffness_n_m;
    variation_.physics.worn_m = options.physics->worn_m;
  }
  // Drawn even where a pose is given, for the check of the extents.
  RandomStream random(seed, options.episode, "true-pose");
  Pose drawn = DrawTruePose(task(), estimate_, extents, random);
  if (!options.hypotheses.empty()) {
    for (const Pose& pose : options.hypotheses) {
      if (!pose.matrix().allFinite()) throw InputError("reset", "a hypothesis is not finite", "give finite numbers");
    }
    drawn = options.hypotheses[random.Index(options.hypotheses.size())];
  }
  drawn.linear() = drawn.linear() * Eigen::AngleAxisd(variation_.yaw_rad, -UnitVector(task().insertion));
  const Pose truth = options.world_T_target.value_or(drawn);
  if (!truth.matrix().allFinite() || !estimate_.matrix().allFinite()) {
    throw InputError("reset", "the pose of the target is not finite", "give finite numbers");
  }
  NoiseOptions noise = options.noise;
  noise.force_offset_n += variation_.force_bias_n;
  PlaceRobot(truth, options, noise, RandomStream(seed, options.episode, "sensor"));
  robot_.SetTargetCandidates(options.hypotheses.empty() ? TargetCandidates(task(), estimate_, extents)
                                                        : options.hypotheses);
  robot_.SetDeadline(limits_.time_s);
  running_ = true;
  MotionResult nothing;
  nothing.world_T_tool = robot_.ToolPose();
  return Result(nothing);
}

void InsertionEnv::RequireWelcome(const Action& action) const {
  if (!running_) throw InputError("step", "no episode is running", "call reset first");
  const ActionBounds& bounds = options_.bounds;
  std::visit(
      Overloaded{
          [&](const GuardedMoveAction& a) {
            if (!(std::abs(a.motion.direction.norm() - 1.0) <= 1e-6)) {
              throw InputError("guarded move", "the direction is not a unit vector", "give one of length 1");
            }
            if (a.motion.distance_m != 0) {
              RequireWithin(a.motion.distance_m, bounds.distance_m, "guarded move", "the distance (m)");
            }
            RequireWithin(a.motion.speed_m_s, bounds.speed_m_s, "guarded move", "the speed (m/s)");
            RequireWithin(a.motion.contact_force_n, bounds.force_n, "guarded move", "the contact force (N)");
          },
          [&](const TransferAction& a) {
            const Eigen::Matrix3d r = a.world_T_tool.linear();
            if (!a.world_T_tool.matrix().allFinite() || !(r.transpose() * r).isIdentity(1e-6) || r.determinant() < 0) {
              throw InputError("transfer", "the pose is not a finite rigid transform",
                               "give a finite position and a rotation");
            }
            RequireWithin(a.speed_m_s, bounds.speed_m_s, "transfer", "the speed (m/s)");
            RequireWithin(a.contact_force_n, bounds.force_n, "transfer", "the contact force (N)");
          },
          [&](const InsertAction& a) {
            RequireWithin(a.distance_m, bounds.distance_m, "insert", "the distance (m)");
            RequireWithin(a.speed_m_s, bounds.speed_m_s, "insert", "the speed (m/s)");
            RequireWithin(a.force_limit_n, bounds.force_n, "insert", "the force limit (N)");
            RequireWithin(a.time_limit_s, limits_.time_s, "insert", "the time limit (s)");
          },
          [&](const LowLevelAction& a) {
            RequireWithin(a.delta.head<3>(), bounds.delta_m, "low-level step", "the displacement (m)");
            RequireWithin(a.delta.tail<3>(), bounds.delta_rad, "low-level step", "the turn (rad)");
            RequireWithin(a.steps, bounds.steps, "low-level step", "the number of steps");
          },
      },
      action);
}

StepResult InsertionEnv::Step(const Action& action) {
  RequireWelcome(action);
  const double before_s = robot_.Time();
  const MotionResult motion =
      std::visit(Overloaded{
                     [&](const GuardedMoveAction& a) { return robot_.Guarded(a.motion); },
                     [&](const TransferAction& a) {
                       return a.straight ? robot_.LinearMove(a.world_T_tool, a.speed_m_s, a.contact_force_n)
                                         : robot_.Transfer(a.world_T_tool);
                     },
                     [&](const InsertAction& a) {
                       CompliantMotion insertion;
                       insertion.world_T_tool = {robot_.ToolPose()};
                       insertion.world_T_tool.front().translation() +=
                           a.distance_m * (estimate_.linear() * UnitVector(task().insertion));
                       insertion.speed_m_s = a.speed_m_s;
                       insertion.force_limit_n = a.force_limit_n;
                       insertion.time_limit_s = a.time_limit_s;
                       return robot_.Compliant(insertion);
                     },
                     [&](const LowLevelAction& a) { return robot_.Servo(a.delta, a.steps); },
                 },
                 action);
  StepResult result = Result(motion);
  result.reward += options_.reward_per_second * (robot_.Time() - before_s);
  running_ = !result.terminated && !result.truncated;
  return result;
}

EnvState InsertionEnv::Save() const { return {robot_.Save(), estimate_, variation_, withhold_true_pose_, running_}; }

void InsertionEnv::Restore(const EnvState& state) {
  robot_.Restore(state.robot);
  estimate_ = state.world_T_estimate;
  variation_ = state.variation;
  withhold_true_pose_ = state.withhold_true_pose;
  running_ = state.running;
}

Renderer& InsertionEnv::Drawing() {
  const Scene& scene = robot_.world().scene();
  if (!renderer_) {
    renderer_ = std::make_unique<Renderer>(scene.drawn_model, options_.renderer);
    drawn_ = MakeData(*scene.drawn_model);
  }
  CopyForDrawing(scene, robot_.world().data(), *drawn_);
  return *renderer_;
}

Image InsertionEnv::Render(const Camera& camera) { return Drawing().Color(*drawn_, camera); }

DepthImage InsertionEnv::RenderDepth(const Camera& camera) { return Drawing().Depth(*drawn_, camera); }

InsertionVerdict InsertionEnv::Judge() const {
  const World& world = robot_.world();
  return JudgeInsertion(task(), limits_, world.ToolPose(), world.TargetPose(), robot_.statistics().peak_force_n,
                        world.time_s());
}

StepResult InsertionEnv::Result(const MotionResult& motion) const {
  const ContactSensor& sensor = robot_.sensor();
  StepResult result;
  Observation& seen = result.observation;
  seen.q_rad = robot_.q_rad();
  seen.qd_rad_s = robot_.qd_rad_s();
  seen.world_T_tool = robot_.ToolPose();
  seen.raw_wrench = sensor.raw();
  seen.filtered_wrench = sensor.filtered();
  seen.contact = motion.contact;
  seen.travelled_m = motion.travelled_m;

  Info& info = result.info;
  for (int i = 0; i < kContactPairCount; ++i) {
    info.contact_pairs[static_cast<std::size_t>(i)] = sensor.PairFlag(static_cast<ContactPair>(i));
  }
  info.stop_reason = motion.reason;
  info.detail = motion.detail;
  info.action_peak_force_n = motion.peak_force_n;
  info.peak_force_n = robot_.statistics().peak_force_n;
  info.sim_time_s = robot_.Time();
  info.path_length_m = robot_.statistics().path_length_m;
  info.world_T_estimate = estimate_;
  if (!withhold_true_pose_) info.world_T_target = robot_.world().TargetPose();
  const InsertionVerdict verdict = Judge();
  const bool failed = !robot_.world().failure().empty();
  info.inserted = verdict.inserted && !failed;
  info.insertion_reason = verdict.reason;

  result.terminated = info.inserted || failed || info.peak_force_n > limits_.force_n;
  result.truncated = info.sim_time_s >= limits_.time_s;
  result.reward = info.inserted ? 1.0 : 0.0;
  return result;
}

}  // namespace feeler::env
