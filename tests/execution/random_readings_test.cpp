// A property of the executor, with a robot that answers at random (it stops anywhere on its way, with or without a
// contact, sometimes a little beside it): every execution ends, with a reason, within its limits of motions and time;
// no motion is commanded farther from the start than workspace and insertion allow; the same answers give the same
// record.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "feeler/core/random.h"
#include "feeler/execution/executor.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

class RandomRobot : public Robot {
 public:
  RandomRobot(const Pose& start, double contacts, RandomStream random)
      : start_(start), pose_(start), contacts_(contacts), random_(random) {}
  Pose ToolPose() const override { return pose_; }
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return time_s_; }
  MotionResult Transfer(const Pose& to) override { return Go(to.translation()); }
  MotionResult LinearMove(const Pose& to, double, double contact_force_n) override {
    return contact_force_n < 1e3 ? Go(to.translation()) : Arrive(to.translation());
  }
  MotionResult Guarded(const GuardedMotion& m) override {
    EXPECT_GE(m.speed_m_s, 0.0);
    return Go(pose_.translation() + m.distance_m * m.direction);
  }
  MotionResult Compliant(const CompliantMotion& m) override { return Go(m.world_T_tool.back().translation()); }
  double farthest_m = 0.0;

 private:
  MotionResult Arrive(const Eigen::Vector3d& to_m) {
    farthest_m = std::max(farthest_m, (to_m - start_.translation()).cwiseAbs().maxCoeff());
    MotionResult result;
    result.travelled_m = (to_m - pose_.translation()).norm();
    pose_.translation() = to_m;
    time_s_ += 0.05 + result.travelled_m / 0.1;
    result.world_T_tool = pose_;
    return result;
  }
  MotionResult Go(const Eigen::Vector3d& to_m) {
    if (random_.Uniform() >= contacts_) return Arrive(to_m);
    const Eigen::Vector3d way = to_m - pose_.translation();
    farthest_m = std::max(farthest_m, (to_m - start_.translation()).cwiseAbs().maxCoeff());
    MotionResult result = Arrive(pose_.translation() + random_.Uniform(0.0, 1.0) * way +
                                 1e-4 * Eigen::Vector3d(random_.Normal(), random_.Normal(), random_.Normal()));
    result.contact = random_.Uniform() < 0.8;  // else it has only fallen short
    result.reason = result.contact ? StopReason::kContact : StopReason::kReached;
    return result;
  }

  Pose start_;
  Pose pose_;
  double contacts_;
  RandomStream random_;
  double time_s_ = 0.0;
};

TEST(RandomReadings, EveryExecutionEndsWithinItsLimits) {
  const Task task = HousingTask();
  const planner::Problem problem = planner::MakeCuboidProblem(task, HousingMap(), {3, 3, 3});
  const planner::SolverResult solved =
      planner::Solve(problem, planner::FastSetting(planner::SolverKind::kRtdpBel, 1.5));
  ASSERT_TRUE(solved.policy);
  const auto graph = std::make_shared<const planner::PolicyGraph>(*solved.policy);
  const double reach_m = 2.0 * task.workspace_m.maxCoeff() + task.insertion_depth_m + 0.05;
  for (std::uint64_t k = 0; k < 200; ++k) {
    ExecutorOptions options;
    options.ladder = k % 10 == 0;
    std::string reasons[2];
    for (std::string& reason : reasons) {
      RandomRobot robot(LatticeStartPose(task, problem, Pose::Identity()), 0.1 + 0.2 * static_cast<double>(k % 4),
                        RandomStream(9, k, "readings"));
      policies::DatabasePolicy policy(graph);
      const ExecutionRecord record = Execute(task, problem, Pose::Identity(), policy, robot, options);
      EXPECT_FALSE(record.reason.empty()) << k;
      EXPECT_LE(static_cast<int>(record.moves.size()), options.motion_limit) << k;
      EXPECT_LE(record.sim_time_s, options.time_limit_s + 5.0) << k;
      EXPECT_LE(robot.farthest_m, reach_m) << k << " " << record.reason;
      reason = record.reason + std::to_string(record.moves.size());
    }
    EXPECT_EQ(reasons[0], reasons[1]) << k;
  }
}

}  // namespace
}  // namespace feeler::execution
