#include "feeler/env/arm/ur10e.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace feeler::env {
namespace {

using Geometry = Ur10eGeometry;

constexpr double kReachTolerance = 1e-12;     // relative excess over the reach that is taken for rounding
constexpr double kSingularTolerance = 1e-10;  // sine of wrist 2 below which wrist 3 is free
constexpr double kSameBranch_rad = 1e-9;

// One row of the Denavit-Hartenberg table; the twist is a multiple of pi/2 given by its exact sine and cosine.
struct Row {
  double d_m;
  double a_m;
  double sin_alpha;
  double cos_alpha;
};
constexpr std::array<Row, kJointCount> kRows = {{{Geometry::kD1_m, 0.0, 1.0, 0.0},
                                                 {0.0, Geometry::kA2_m, 0.0, 1.0},
                                                 {0.0, Geometry::kA3_m, 0.0, 1.0},
                                                 {Geometry::kD4_m, 0.0, 1.0, 0.0},
                                                 {Geometry::kD5_m, 0.0, -1.0, 0.0},
                                                 {Geometry::kD6_m, 0.0, 0.0, 1.0}}};

// Rz(theta) Tz(d) Tx(a) Rx(alpha).
Pose Link(const Row& row, double theta_rad) {
  const double c = std::cos(theta_rad);
  const double s = std::sin(theta_rad);
  Pose pose = Pose::Identity();
  pose.linear() << c, -s * row.cos_alpha, s * row.sin_alpha,  //
      s, c * row.cos_alpha, -c * row.sin_alpha,               //
      0.0, row.sin_alpha, row.cos_alpha;
  pose.translation() << row.a_m * c, row.a_m * s, row.d_m;
  return pose;
}

// Half a turn about z, exactly; its own inverse.
Pose TurnBase(const Pose& pose) {
  Pose turned = pose;
  turned.matrix().topRows<2>() = -pose.matrix().topRows<2>();
  return turned;
}

bool SameBranch(const JointVector& a, const JointVector& b) {
  for (int i = 0; i < kJointCount; ++i) {
    if (std::abs(WrapAngle(a[i] - b[i])) > kSameBranch_rad) return false;
  }
  return true;
}

}  // namespace

double WrapAngle(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2.0 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

KinematicChain Chain(const JointVector& q_rad) {
  // The product of Link(row, q) written out: a turn about z, a shift along z and x, a quarter turn about x. Six of
  // these run in every control step.
  KinematicChain chain;
  Eigen::Vector3d x(-1, 0, 0), y(0, -1, 0), z(0, 0, 1), p = Eigen::Vector3d::Zero();  // the base, turned
  for (std::size_t i = 0; i < kJointCount; ++i) {
    chain.axis[i] = z;
    chain.origin_m[i] = p;
    const Row& row = kRows[i];
    const double c = std::cos(q_rad[static_cast<int>(i)]);
    const double s = std::sin(q_rad[static_cast<int>(i)]);
    const Eigen::Vector3d turned_x = c * x + s * y;
    const Eigen::Vector3d turned_y = c * y - s * x;
    p += row.d_m * z + row.a_m * turned_x;
    x = turned_x;
    y = row.cos_alpha * turned_y + row.sin_alpha * z;
    z = row.cos_alpha * z - row.sin_alpha * turned_y;
  }
  chain.base_T_flange = Pose::Identity();
  chain.base_T_flange.linear() << x, y, z;
  chain.base_T_flange.translation() = p;
  return chain;
}

Eigen::Matrix<double, 6, 6> JacobianAt(const KinematicChain& chain, const Eigen::Vector3d& point_m) {
  Eigen::Matrix<double, 6, 6> jacobian;
  for (std::size_t i = 0; i < kJointCount; ++i) {
    jacobian.col(static_cast<int>(i)) << chain.axis[i].cross(point_m - chain.origin_m[i]), chain.axis[i];
  }
  return jacobian;
}

Pose ForwardKinematics(const JointVector& q_rad) { return Chain(q_rad).base_T_flange; }

Eigen::Matrix<double, 6, 6> Jacobian(const JointVector& q_rad) {
  const KinematicChain chain = Chain(q_rad);
  return JacobianAt(chain, chain.base_T_flange.translation());
}

std::vector<JointVector> InverseKinematics(const Pose& base_T_flange, double wrist_3_if_singular_rad) {
  std::vector<JointVector> solutions;
  const Pose flange = TurnBase(base_T_flange);
  const Eigen::Matrix3d rotation = flange.linear();
  const Eigen::Vector3d wrist = flange.translation() - Geometry::kD6_m * rotation.col(2);

  // Shoulder pan: the wrist lies at distance d4 from the plane of the arm. s1 x - c1 y = d4.
  const double radius = std::hypot(wrist.x(), wrist.y());
  if (radius < Geometry::kD4_m * (1.0 - kReachTolerance)) return solutions;
  const double along = std::sqrt(std::max(0.0, (radius - Geometry::kD4_m) * (radius + Geometry::kD4_m)));
  for (const double shoulder : {1.0, -1.0}) {
    const double q1 = std::atan2(wrist.y(), wrist.x()) + std::atan2(Geometry::kD4_m, shoulder * along);
    const double s1 = std::sin(q1);
    const double c1 = std::cos(q1);

    // The axis of the shoulder lift seen from the flange is (s5 c6, -s5 s6, c5): both wrist angles, without an
    // arccosine.
    const Eigen::Vector3d lift_axis = rotation.transpose() * Eigen::Vector3d(s1, -c1, 0.0);
    const double sin_q5 = std::hypot(lift_axis.x(), lift_axis.y());
    const bool singular = sin_q5 < kSingularTolerance;
    for (const double flip : {1.0, -1.0}) {
      const double q5 = flip * std::atan2(sin_q5, lift_axis.z());
      const double q6 = singular ? wrist_3_if_singular_rad : std::atan2(-flip * lift_axis.y(), flip * lift_axis.x());

      // What is left is a planar arm of two links in the x-y plane of Denavit-Hartenberg frame 1.
      const Pose wrist_1 = flange * (Link(kRows[4], q5) * Link(kRows[5], q6)).inverse();
      const Pose planar = Link(kRows[0], q1).inverse() * wrist_1;
      const double sum_of_lifts = std::atan2(planar.linear()(1, 0), planar.linear()(0, 0));
      const double x = planar.translation().x();
      const double y = planar.translation().y();
      constexpr double kTwoLinks = 2.0 * Geometry::kA2_m * Geometry::kA3_m;
      const double cos_q3 =
          (x * x + y * y - Geometry::kA2_m * Geometry::kA2_m - Geometry::kA3_m * Geometry::kA3_m) / kTwoLinks;
      if (std::abs(cos_q3) > 1.0 + kReachTolerance) continue;
      const double sin_q3 = std::sqrt(std::max(0.0, (1.0 - cos_q3) * (1.0 + cos_q3)));
      for (const double elbow : {1.0, -1.0}) {
        const double q3 = std::atan2(elbow * sin_q3, cos_q3);
        const double q2 =
            std::atan2(y, x) - std::atan2(Geometry::kA3_m * elbow * sin_q3, Geometry::kA2_m + Geometry::kA3_m * cos_q3);
        JointVector q;
        q << q1, q2, q3, sum_of_lifts - q2 - q3, q5, q6;
        for (double& angle : q) angle = WrapAngle(angle);
        bool seen = false;
        for (const JointVector& other : solutions) seen = seen || SameBranch(other, q);
        if (!seen) solutions.push_back(q);
      }
    }
  }
  return solutions;
}

}  // namespace feeler::env
