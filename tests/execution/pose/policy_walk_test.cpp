// Law of a felt motion: it begins beside its end, where it began along its direction, in metres from the estimate, and
// has travelled from there to the end.
#include "feeler/execution/pose/policy_walk.h"

#include <gtest/gtest.h>

#include "feeler/core/random.h"

namespace feeler::execution {
namespace {

TEST(FeltMotion, BeginsBesideItsEndInMetresFromTheEstimate) {
  RandomStream random(5, 0, "motions");
  for (int i = 0; i < 100; ++i) {
    LatticeFrame frame;
    frame.cell_m = random.Uniform(0.0005, 0.004);
    frame.center = {1.0, 2.5, 3.0};
    frame.world_T_estimate.translation() = Eigen::Vector3d(0.4, 0.1, 0.2);
    const Direction direction = kDirections[static_cast<std::size_t>(i) % kDirections.size()];
    Eigen::Vector3d from;
    MotionReport report;
    report.contact = i % 3 == 0;
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = random.Uniform(-10.0, 10.0);
      report.end[axis] = from[axis] + random.Uniform(-0.1, 0.1);
    }
    const double cells = random.Uniform(0.0, 8.0);
    const int axis = AxisOf(direction);
    report.end[axis] = from[axis] + SignOf(direction) * cells;
    const FeltMotion felt = FeltFrom(frame, direction, from, report, 1e-4);
    const Eigen::Vector3d to_m = felt.motion.from_m + felt.travelled_m * UnitVector(direction);
    EXPECT_LT((frame.world_T_estimate * to_m - frame.ToWorld(report.end).translation()).norm(), 1e-12);
    EXPECT_NEAR(felt.motion.from_m[axis], (from[axis] - frame.center[axis]) * frame.cell_m, 1e-12);
    EXPECT_NEAR(felt.travelled_m, cells * frame.cell_m, 1e-12);
    EXPECT_EQ(felt.motion.direction, direction);
    EXPECT_EQ(felt.contact, report.contact);
    EXPECT_EQ(felt.sigma_m, 1e-4);
  }
}

}  // namespace
}  // namespace feeler::execution
