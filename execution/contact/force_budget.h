#pragma once

#include "feeler/core/robot.h"

namespace feeler::execution {

/// How fast the tool may meet a wall so that no force passes a budget.
///
/// A mass m that meets a contact of stiffness k and damping ratio z at speed v is pushed back with at most
/// max(1, 2 z) v sqrt(m k): an elastic contact gives v sqrt(m k) when it has taken all of the motion, a damped one its
/// greatest force at the first touch, 2 z v sqrt(m k). Until the robot reacts, t later, it drives the tool v t deeper,
/// which adds k v t. The drive's push P against the friction of its joints, which move no longer, comes on top:
///   F = P + v (max(1, 2 z) sqrt(m k) + k t).
/// This is what stands beside v, N per m/s.
double ForcePerSpeed(const ContactResponse& contact);

/// The speed (m/s) that uses kShareOfBudget of `budget_n` by that law; the rest is for what the law leaves out:
/// contacts beside the axis of the tool, what the drive adds until it stands (measured face to face, anywhere in reach:
/// up to 1.06 of the law). A push takes its part of kShareWithPush: joints that stick while the drive turns around add
/// some N (measured: 1 to 1.5 of 25). Whatever the push, at least kLeastShare is for the motion: no speed keeps a
/// budget that the push alone passes.
double SpeedWithinBudget(const ContactResponse& contact, double budget_n);
inline constexpr double kShareOfBudget = 0.93;
inline constexpr double kShareWithPush = 0.79;
inline constexpr double kLeastShare = 0.2;

/// The speed (m/s) at which the tool may meet an edge that it overlaps by little.
///
/// Until a contact has taken the motion at speed v, the tool goes v (1/w + 2 t) deep, w = sqrt(k / m) (1/(e w) where it
/// is damped critically or more), t the reaction time, and as long again until the force counts as a contact. An edge
/// that it overlaps by less it leaves over it: from one moment to the next the edge pushes along the other face,
/// `beyond`, by all of that overlap. The robot, which holds its place, pushes as hard again (measured: 1.8 to 2 times
/// the stiffness of the contact).
double SpeedOverEdge(const ContactResponse& face, const ContactResponse& beyond, double budget_n);

}  // namespace feeler::execution
