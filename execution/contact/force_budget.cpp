#include "feeler/execution/contact/force_budget.h"

#include <algorithm>
#include <cmath>

namespace feeler::execution {

double ForcePerSpeed(const ContactResponse& contact) {
  const double impact =
      std::max(1.0, 2.0 * contact.damping_ratio) * std::sqrt(contact.mass_kg() * contact.stiffness_n_m);
  return impact + contact.stiffness_n_m * contact.reaction_time_s;
}

double SpeedWithinBudget(const ContactResponse& contact, double budget_n) {
  return kShareOfBudget * budget_n / ForcePerSpeed(contact);
}

}  // namespace feeler::execution
