// Laws of the force law: force is proportional to speed; the speed of a budget uses the stated share of it; an elastic
// contact gives v sqrt(m k), a damped one 2 z times that, a slow reaction k v t on top; what meets is lighter than a
// tool that cannot turn, and heavier than one that turns freely; without a budget there is no limit;
// what the drive pushes against its own friction comes off the budget first.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "feeler/core/random.h"
#include "feeler/execution/contact/force_budget.h"

namespace feeler::execution {
namespace {

TEST(ForceLaw, SpeedAndForceAreInverse) {
  RandomStream random(3, 0, "contacts");
  for (int i = 0; i < 200; ++i) {
    ContactResponse contact;
    contact.free_mass_kg = random.Uniform(1.0, 30.0);
    contact.held_mass_kg = contact.free_mass_kg * random.Uniform(1.0, 2.0);
    contact.stiffness_n_m = std::pow(10.0, random.Uniform(3.0, 6.0));
    contact.damping_ratio = random.Uniform(0.0, 2.0);
    contact.reaction_time_s = random.Uniform(0.0, 0.01);
    EXPECT_GE(contact.mass_kg(), contact.free_mass_kg);
    EXPECT_LE(contact.mass_kg(), contact.held_mass_kg);
    const double budget_n = random.Uniform(5.0, 100.0);
    EXPECT_NEAR(ForcePerSpeed(contact) * SpeedWithinBudget(contact, budget_n), kShareOfBudget * budget_n, 1e-9);
    ContactResponse later = contact;
    later.reaction_time_s += 0.002;
    EXPECT_NEAR(ForcePerSpeed(later) - ForcePerSpeed(contact), 0.002 * contact.stiffness_n_m,
                1e-9 * ForcePerSpeed(later));
  }
}

TEST(ForceLaw, APushTakesItsPartOfTheBudget) {
  RandomStream random(4, 0, "pushes");
  for (int i = 0; i < 200; ++i) {
    ContactResponse contact;
    const double budget_n = random.Uniform(10.0, 60.0);
    const double free_m_s = SpeedWithinBudget(contact, budget_n);
    contact.push_n = random.Uniform(0.0, 1.5) * budget_n;
    const double speed_m_s = SpeedWithinBudget(contact, budget_n);
    EXPECT_LT(speed_m_s, free_m_s);
    EXPECT_GE(speed_m_s * ForcePerSpeed(contact), (1.0 - 1e-9) * kLeastShare * budget_n) << "it gets on";
    if (contact.push_n < (kShareWithPush - kLeastShare) * budget_n) {
      EXPECT_NEAR(contact.push_n + speed_m_s * ForcePerSpeed(contact), kShareWithPush * budget_n, 1e-9);
    }
    const ContactResponse beyond = contact;
    EXPECT_LT(SpeedOverEdge({}, beyond, budget_n), SpeedOverEdge({}, {}, budget_n));
  }
}

TEST(ForceLaw, ImpactOfAMassOnASpring) {
  ContactResponse contact{4.0, 4.0, 2.5e4, 0.0, 0.0, 0.0};
  EXPECT_NEAR(ForcePerSpeed(contact), std::sqrt(4.0 * 2.5e4), 1e-9);
  contact.damping_ratio = 0.4;
  EXPECT_NEAR(ForcePerSpeed(contact), std::sqrt(4.0 * 2.5e4), 1e-9) << "little damping takes nothing off";
  contact.damping_ratio = 1.5;
  EXPECT_NEAR(ForcePerSpeed(contact), 3.0 * std::sqrt(4.0 * 2.5e4), 1e-9);
  EXPECT_TRUE(std::isinf(SpeedWithinBudget(contact, std::numeric_limits<double>::infinity())));
}

}  // namespace
}  // namespace feeler::execution
