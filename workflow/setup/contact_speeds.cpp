#include "feeler/workflow/setup/contact_speeds.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/scene/scene.h"
#include "feeler/execution/contact/force_budget.h"

namespace feeler::workflow {
namespace {

constexpr double kRounded_m_s = 1e-4;
/// Costs are multiples of this, so that a sum of two is exact and a database gives back what it was given.
constexpr double kCostUnit_s = 1.0 / (1 << 30);
/// What a longer probe gains against the speed that is commanded, as MotionTimes counts (0.047 of 0.05 m/s).
constexpr double kOfCommanded = 0.94;

}  // namespace

std::optional<ContactSpeeds> NominalContactSpeeds(const env::TaskModel& model, double budget_n,
                                                  const env::SceneOptions& options) {
  env::InsertionEnv environment(std::make_shared<const env::Scene>(env::BuildScene(model, options)));
  env::ResetOptions reset;
  reset.world_T_target = model.task.world_T_target;
  reset.randomize = false;
  try {
    environment.Reset(0, reset);
  } catch (const InputError&) {
    return std::nullopt;
  }
  ContactSpeeds speeds;
  speeds.budget_n = budget_n;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    ContactResponse contact = environment.robot().Contact(model.task.world_T_target.linear().col(axis));
    if (axis == AxisOf(model.task.insertion)) contact = contact.Held();  // faces lie across it, as execution/ counts
    const double speed_m_s = execution::SpeedWithinBudget(contact, budget_n);
    speeds.speed_m_s[i] = std::max(1.0, std::floor(speed_m_s / kRounded_m_s)) * kRounded_m_s;
    speeds.stiffness_n_m[i] = contact.stiffness_n_m;
    speeds.force_per_speed_n_s_m[i] = execution::ForcePerSpeed(contact);
  }
  return speeds;
}

CostWeights TimeCost(const Task& task, const ContactSpeeds& speeds) {
  std::array<double, 3> per_cell{};
  CostWeights cost;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Task along = task;
    along.times.probe_speed_m_s = std::min(task.times.probe_speed_m_s, kOfCommanded * speeds.speed_m_s[axis]);
    cost = feeler::TimeCost(along);
    per_cell[axis] = cost.per_cell;
  }
  if (std::ranges::all_of(per_cell, [&](double value) { return value == per_cell[0]; })) return cost;
  for (double& value : per_cell) value = std::round(value / kCostUnit_s) * kCostUnit_s;
  return CostPerAxis(per_cell, cost.per_contact, cost.per_action);
}

double WorstPredictedForce(const ContactSpeeds& speeds, double probe_speed_m_s) {
  double worst_n = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    worst_n = std::max(worst_n, speeds.force_per_speed_n_s_m[axis] * std::min(speeds.speed_m_s[axis], probe_speed_m_s));
  }
  return worst_n;
}

}  // namespace feeler::workflow
