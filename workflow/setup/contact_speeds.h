#pragma once

#include <array>
#include <optional>

#include "feeler/env/model/task_file.h"
#include "feeler/env/scene/scene.h"

namespace feeler::workflow {

/// How a contact at the nominal place of a task is met, along the axes of its target.
struct ContactSpeeds {
  std::array<double, 3> speed_m_s{};              ///< fastest within the budget (execution/contact/force_budget.h)
  std::array<double, 3> force_per_speed_n_s_m{};  ///< N per m/s
  std::array<double, 3> stiffness_n_m{};          ///< of tool and target in contact
  double budget_n = 0.0;
};

/// Of the simulated arm at the start pose of the task, rounded to 0.1 mm/s, so that plans do not hang on the last bit.
/// Empty if the arm does not reach that pose.
std::optional<ContactSpeeds> NominalContactSpeeds(const env::TaskModel& model, double budget_n,
                                                  const env::SceneOptions& options = {});

/// The weights in seconds that the times of the task come to, where probes go no faster than the speeds: one cost of a
/// cell per axis. One for all where none of them is slower than the task's own probes.
CostWeights TimeCost(const Task& task, const ContactSpeeds& speeds);

/// The greatest force that probes at these speeds are predicted to end with, N: what a policy that probes along all
/// axes comes to. `probe_speed_m_s`: no probe is faster.
double WorstPredictedForce(const ContactSpeeds& speeds, double probe_speed_m_s);

}  // namespace feeler::workflow
