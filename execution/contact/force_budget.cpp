#include "feeler/execution/contact/force_budget.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace feeler::execution {
namespace {

/// What a push leaves of a budget for the motion, N.
double BesidePush(const ContactResponse& contact, double budget_n) {
  if (contact.push_n <= 0.0) return kShareOfBudget * budget_n;
  return std::max(kShareWithPush * budget_n - contact.push_n, kLeastShare * budget_n);
}

}  // namespace

double ForcePerSpeed(const ContactResponse& contact) {
  const double impact =
      std::max(1.0, 2.0 * contact.damping_ratio) * std::sqrt(contact.mass_kg() * contact.stiffness_n_m);
  return impact + contact.stiffness_n_m * contact.reaction_time_s;
}

double SpeedWithinBudget(const ContactResponse& contact, double budget_n) {
  return BesidePush(contact, budget_n) / ForcePerSpeed(contact);
}

double SpeedOverEdge(const ContactResponse& face, const ContactResponse& beyond, double budget_n) {
  const double period_s = std::sqrt(face.mass_kg() / face.stiffness_n_m);
  const double depth_per_speed_s =
      (face.damping_ratio < 1.0 ? period_s : period_s / std::numbers::e) + 2.0 * face.reaction_time_s;
  constexpr double kRobotHolds = 2.0;
  return BesidePush(beyond, budget_n) / (kRobotHolds * beyond.Held().stiffness_n_m * depth_per_speed_s);
}

}  // namespace feeler::execution
