// Laws: along the axes of position that a task knows, the estimate of a camera stands where the target does; along the
// uncertain ones, and in its turn, it stays as the camera made it. A task that is uncertain along x, y and z keeps the
// whole estimate.
#include "feeler/workflow/episode/episode_perception.h"

#include <gtest/gtest.h>

#include "feeler/env/model/task_file.h"

namespace feeler::workflow {
namespace {

TEST(EpisodePerception, KnownPlacesAreNotTheCamerasToSay) {
  const Task pipe = env::LoadTask("pipe-into-elbow").task;
  const Task plug = env::LoadTask("plug").task;
  RandomStream random(3, 0, "known place");
  for (int i = 0; i < 50; ++i) {
    const Pose truth = MakePose(Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(0, 1)),
                                random.Uniform(-0.3, 0.3));
    Pose seen = truth * Eigen::Translation3d(random.Uniform(-0.01, 0.01), random.Uniform(-0.01, 0.01),
                                             random.Uniform(-0.01, 0.01));
    seen.linear() = seen.linear() * Eigen::AngleAxisd(random.Uniform(-0.1, 0.1), Eigen::Vector3d::UnitZ());
    const Pose estimate = WithKnownPlace(pipe, seen, truth);
    EXPECT_EQ(estimate.linear(), seen.linear());
    const Eigen::Vector3d to_truth = (estimate.inverse() * truth).translation();
    const Eigen::Vector3d moved = (seen.inverse() * estimate).translation();
    EXPECT_NEAR(to_truth.z(), 0.0, 1e-12);
    EXPECT_LT(moved.head<2>().norm(), 1e-12);
    EXPECT_LT((WithKnownPlace(plug, seen, truth).matrix() - seen.matrix()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace feeler::workflow
