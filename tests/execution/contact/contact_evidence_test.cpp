// Laws:
// - Continuous travel equals the exact distance to the boxes from any displacement outside them (walls mid-cell).
// - The fit finds a continuous target from touches of all axes to within their error, and one false reading among
//   several right ones does not move it.
// - An axis that nothing pins is reported loose, with the width that the free motions leave.
#include "feeler/execution/contact/contact_evidence.h"

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/core/random.h"
#include "feeler/execution/contact/continuous_travel.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

constexpr double kCell = 0.002;

/// A touch from `start` (lattice coordinates) of at most `cells`, read exactly.
Touch Feel(const Eigen::Vector3d& start, Direction direction, double cells, const Eigen::Vector3d& target) {
  const double travel = DistanceToContact(HousingOverPanel(), (start - target) * kCell, UnitVector(direction)) / kCell;
  return {start, direction, std::min(cells, travel), travel < cells};
}

TEST(ContinuousTravel, EqualsExactDistance) {
  const auto map = HousingMap();
  RandomStream random(3, 0, "continuous travel");
  int checked = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d at(random.Uniform(-30, 30), random.Uniform(-25, 25), random.Uniform(-14.9, 8));
    bool inside = false;
    for (const Box& box : HousingOverPanel()) {
      inside = inside || ((at * kCell - box.min).minCoeff() > 0 && (box.max - at * kCell).minCoeff() > 0);
    }
    if (inside) continue;
    const Direction d = kDirections[random.Index(kDirectionCount)];
    const double exact = DistanceToContact(HousingOverPanel(), at * kCell, UnitVector(d)) / kCell;
    const double travel = ContinuousTravel(*map, at, d);
    if (exact > 1e6) {
      EXPECT_GT(travel, 1e6);
    } else {
      EXPECT_NEAR(travel, exact, 1e-4) << at.transpose() << ToString(d);
    }
    ++checked;
  }
  EXPECT_GT(checked, 5000);
}

TEST(FitTarget, FindsTheTargetDespiteOneFalseReading) {
  const auto map = HousingMap();
  for (std::uint64_t episode = 0; episode < 20; ++episode) {
    RandomStream random(5, episode, "fit");
    Eigen::Vector3d target;
    for (int axis = 0; axis < 3; ++axis) target[axis] = random.Uniform(2.5, 4.5);
    std::vector<Touch> touches = {
        Feel({3, 3, 12.5}, Direction::kMinusZ, 20, target),     Feel({-25, 3, -5}, Direction::kPlusX, 20, target),
        Feel({3, -22, -4}, Direction::kPlusY, 20, target),      Feel({30, 5, -6}, Direction::kMinusX, 20, target),
        Feel({-25, -22, 12.5}, Direction::kMinusZ, 16, target),
    };
    for (Touch& touch : touches) {
      EXPECT_EQ(touch.contact, &touch != &touches.back());
      touch.travelled += random.Uniform(-0.02, 0.02);
    }
    touches.push_back(touches[1]);
    touches.back().travelled -= 1.3;  // a false contact
    const TargetFit fit = FitTarget(*map, touches, Eigen::Vector3d::Constant(2.0), Eigen::Vector3d::Constant(5.0));
    EXPECT_EQ(fit.violations, 1);
    EXPECT_LT((fit.position - target).cwiseAbs().maxCoeff(), 0.03) << fit.position.transpose();
    EXPECT_TRUE(fit.pinned[0] && fit.pinned[1] && fit.pinned[2]);
  }
}

TEST(FitTarget, ReportsALooseAxis) {
  const auto map = HousingMap();
  const Eigen::Vector3d target(3.2, 3.1, 2.8);
  // Down beside the housing on both sides of y: free motions bound y to a cell; nothing touches it.
  const std::vector<Touch> touches = {
      Feel({3, 3, 12.5}, Direction::kMinusZ, 20, target),
      Feel({-25, 3, -5}, Direction::kPlusX, 20, target),
      Feel({3, 20, 12.5}, Direction::kMinusZ, 14, target),
      Feel({3, -14, 12.5}, Direction::kMinusZ, 14, target),
  };
  EXPECT_FALSE(touches[2].contact);
  EXPECT_FALSE(touches[3].contact);
  const TargetFit fit = FitTarget(*map, touches, Eigen::Vector3d::Constant(2.0), Eigen::Vector3d::Constant(4.4));
  EXPECT_EQ(fit.violations, 0);
  EXPECT_TRUE(fit.pinned[0] && fit.pinned[2]);
  EXPECT_FALSE(fit.pinned[1]);
  EXPECT_GT(fit.half_width[1], 0.4);
  EXPECT_LE(std::abs(fit.position[1] - target[1]), fit.half_width[1]);
  EXPECT_NEAR(fit.position[0], target[0], 1e-3);
  EXPECT_NEAR(fit.position[2], target[2], 1e-3);
}

}  // namespace
}  // namespace feeler::execution
