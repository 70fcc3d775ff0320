#include "feeler/workflow/episode/episode_draw.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/env/gym/insertion_env.h"

namespace feeler::workflow {
namespace {

/// Moves the truth beyond one side of the box, chosen among those of the uncertain positions.
void MoveOutside(const Task& task, const planner::Extents& cuboid, const EpisodeFaults& faults, RandomStream& random,
                 EpisodeDraw& draw) {
  std::vector<const UncertainAxis*> axes;
  for (const UncertainAxis& axis : task.axes) {
    if (!axis.angular()) axes.push_back(&axis);
  }
  if (axes.empty())
    throw InputError("noise outside", "the task has no uncertain position",
                     "leave out the fault or choose a task with uncertain axes x, y or z");
  const UncertainAxis& axis = *axes[random.Index(axes.size())];
  const int i = static_cast<int>(axis.kind);
  const double side = random.Index(2) == 0 ? -1.0 : 1.0;
  const double beyond = random.Uniform(faults.outside_least_m, faults.outside_most_m);
  Eigen::Vector3d offset = (draw.world_T_estimate.inverse() * draw.world_T_true).translation();
  offset[i] = side * (0.5 * cuboid[i] * axis.resolution + beyond);
  draw.world_T_true.translation() = draw.world_T_estimate * offset;
}

}  // namespace

std::vector<int> AxisExtents(const Task& task, const planner::Extents& cuboid) {
  return planner::ExtentsPerAxis(planner::AxesOf(task), cuboid);
}

planner::ProblemFamily FamilyToDrawFrom(const std::string& extents, policies::Database* database, const Task& task) {
  if (!extents.empty()) {
    planner::ProblemFamily family{{planner::ParseExtents(extents, task)}, extents};
    planner::RequireWithinTask(family, task);
    return family;
  }
  if (database == nullptr) return planner::FamilyOf(task);
  planner::ProblemFamily family;
  family.spec = database->path();
  for (const policies::StoredProblem& problem : database->List()) {
    if (std::isfinite(problem.expected_cost)) family.problems.push_back(problem.extents);
  }
  if (family.problems.empty()) throw InputError(database->path(), "holds no policy", "fill it with feeler preprocess");
  return family;
}

planner::Extents DrawProblem(const planner::ProblemFamily& family, std::uint64_t seed, std::uint64_t episode) {
  if (family.problems.empty()) throw InputError("episodes", "no problem to draw from", "give --extents or a database");
  RandomStream problem(seed, episode, "problem");
  return family.problems[problem.Index(family.problems.size())];
}

EpisodeDraw DrawEpisode(const Task& task, const planner::ProblemFamily& family, std::uint64_t seed,
                        std::uint64_t episode, const EpisodeFaults& noise) {
  EpisodeDraw draw;
  draw.extents = DrawProblem(family, seed, episode);
  draw.world_T_estimate = task.world_T_target;

  RandomStream truth(seed, episode, "true pose");
  draw.world_T_true = env::DrawTruePose(task, draw.world_T_estimate, AxisExtents(task, draw.extents), truth);
  if (noise.outside) {
    RandomStream outside(seed, episode, "truth outside");
    MoveOutside(task, draw.extents, noise, outside, draw);
  }
  draw.world_T_true = TurnedByFault(task, noise, seed, episode, draw.world_T_true);
  return draw;
}

WorldDraw DrawWorld(const Task& task, const EpisodeFaults& faults, double friction, std::uint64_t seed,
                    std::uint64_t episode) {
  WorldDraw draw;
  draw.robot = faults.robot;
  const auto value_of = [&](const FaultRange& range, const char* name, double unit) {
    RandomStream random(seed, episode, std::string("fault ") + name);
    const double value = random.Uniform(range.least, range.most);
    draw.values[name] = value / unit;
    return value;
  };
  if (faults.force_noise_n) draw.robot.force_noise_n = value_of(*faults.force_noise_n, "force-noise", 1.0);
  if (faults.latency_s) draw.robot.force_delay_s = value_of(*faults.latency_s, "latency", 1e-3);
  if (faults.contact_friction) {
    draw.physics.contact_friction = value_of(*faults.contact_friction, "contact-friction", 1.0) / friction;
  }
  if (faults.false_stop > 0.0) draw.robot.false_stops_per_m = -std::log1p(-faults.false_stop) / task.cell_m;
  draw.robot.missed_contact = faults.missed_contact;
  // Of the cells that end with no false contact: of all cells it is `spent_step` again.
  draw.robot.spent_step = faults.spent_step / (1.0 - faults.false_stop);
  if (faults.missed_contact > 0.0 || faults.spent_step > 0.0) draw.robot.step_m = task.cell_m;
  if (faults.port_stiffness_n_m) {
    draw.physics.port_stiffness_n_m = value_of(*faults.port_stiffness_n_m, "port-stiffness", 1e3);
  }
  if (faults.worn_m) draw.physics.worn_m = value_of(*faults.worn_m, "worn", 1e-3);
  if (faults.slip_m) {
    constexpr double kTurn_rad_m = 2.0 * std::numbers::pi / 180.0 / 1e-3;
    const double slip_m = value_of(*faults.slip_m, "slip", 1e-3);
    RandomStream random(seed, episode, "direction of slip");
    const double angle = random.Uniform(0.0, 2.0 * std::numbers::pi);
    const int along = AxisOf(task.insertion);
    draw.physics.tool_slip_m[(along + 1) % 3] = slip_m * std::cos(angle);
    draw.physics.tool_slip_m[(along + 2) % 3] = slip_m * std::sin(angle);
    draw.physics.tool_turn_rad = (random.Index(2) == 0 ? -1.0 : 1.0) * kTurn_rad_m * slip_m;
  }
  return draw;
}

Pose TurnedByFault(const Task& task, const EpisodeFaults& noise, std::uint64_t seed, std::uint64_t episode,
                   const Pose& world_T_target) {
  if (noise.yaw_error_rad == 0.0) return world_T_target;
  RandomStream random(seed, episode, "yaw error");
  const double side = random.Index(2) == 0 ? -1.0 : 1.0;
  const double angle_rad = noise.yaw_error_least_rad < noise.yaw_error_rad
                               ? random.Uniform(noise.yaw_error_least_rad, noise.yaw_error_rad)
                               : noise.yaw_error_rad;
  Pose turned = world_T_target;
  turned.linear() = turned.linear() * Eigen::AngleAxisd(side * angle_rad, -UnitVector(task.insertion));
  return turned;
}

}  // namespace feeler::workflow
