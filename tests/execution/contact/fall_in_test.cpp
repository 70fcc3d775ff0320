// Laws of a tool that may have fallen into the opening, or passed an edge that it was to meet:
// - in the opening it goes aside no faster than the budget allows for walls that hold it along its length;
// - a long probe that falls into an opening deeper than the insertion stops where the fall can be told, at every
// height;
// - a motion that is not watched comes off a contact, or goes back where the tool came from, or straight out.
#include "feeler/execution/contact/fall_in.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "feeler/execution/contact/force_budget.h"
#include "feeler/execution/executor.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

constexpr double kBudget_n = 25.0;

/// Knows where the target is, and looks at every motion.
class WitnessRobot : public KinematicRobot {
 public:
  WitnessRobot(const Task& task, const Pose& truth, const Pose& start, RandomStream random)
      : KinematicRobot(HousingOverPanel(), task, truth, start, {}, std::move(random)), truth_(truth) {}

  ContactResponse Contact(const Eigen::Vector3d&) const override {
    ContactResponse contact;
    contact.held_mass_kg = 12.0;
    contact.free_mass_kg = 2.0;
    return contact;
  }
  MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) override {
    const Eigen::Vector3d way = world_T_tool.translation() - ToolPose().translation();
    const bool watched = contact_force_n < 1e3;
    if (watched) Look(way, speed_m_s);
    if (!watched && !came_to_contact_ && !GoesBack(world_T_tool.translation())) ++blind;
    if (watched) Begin();
    const MotionResult result = KinematicRobot::LinearMove(world_T_tool, speed_m_s, contact_force_n);
    came_to_contact_ = result.contact;
    return result;
  }
  MotionResult Guarded(const GuardedMotion& motion) override {
    Begin();
    const MotionResult result = KinematicRobot::Guarded(motion);
    const double travelled_m = (ToolPose().translation() - from_m_).dot(motion.direction);
    came_to_contact_ = result.contact || motion.distance_m - travelled_m > ExecutorOptions().shortfall_m;
    return result;
  }

  int inside = 0;                       ///< motions aside in the opening
  double fastest_m_s = 0.0;             ///< of those below the lead-in
  double fastest_in_lead_in_m_s = 0.0;  ///< of those in it, where the tool can turn away
  int blind = 0;                        ///< motions that were not watched although nobody knows what stands there

 private:
  void Look(const Eigen::Vector3d& way, double speed_m_s) {
    constexpr double kLeadIn_m = 0.001;
    constexpr double kInside_m = 0.001;
    const Eigen::Vector3d at = ToolPose().translation() - truth_.translation();
    const bool in = at.z() < 0.0 && at.head<2>().cwiseAbs().maxCoeff() < kInside_m;
    if (!in || way.head<2>().norm() < std::abs(way.z()) || way.norm() < 1e-4) return;
    ++inside;
    double& fastest = at.z() < -kLeadIn_m ? fastest_m_s : fastest_in_lead_in_m_s;
    fastest = std::max(fastest, speed_m_s);
  }

  void Begin() {
    before_m_ = from_m_;
    from_m_ = ToolPose().translation();
  }
  /// To a place on the way to where the last watched motion began or the one before it, or straight out.
  bool GoesBack(const Eigen::Vector3d& to_m) const {
    constexpr double kBeside_m = 2e-4;
    const Eigen::Vector3d at_m = ToolPose().translation();
    const Eigen::Vector3d out_m = to_m - at_m;
    if (out_m.z() > 0.0 && out_m.head<2>().norm() < kBeside_m) return true;
    const auto on_way_to = [&](const Eigen::Vector3d& begun_m) {
      const Eigen::Vector3d back_m = begun_m - at_m;
      const double share = back_m.norm() > 0.0 ? std::clamp(out_m.dot(back_m) / back_m.squaredNorm(), 0.0, 1.0) : 0.0;
      return (out_m - share * back_m).norm() < kBeside_m;
    };
    return on_way_to(from_m_) || on_way_to(before_m_);
  }

  Pose truth_;
  Eigen::Vector3d from_m_ = Eigen::Vector3d::Zero();    ///< where the last watched motion began
  Eigen::Vector3d before_m_ = Eigen::Vector3d::Zero();  ///< the one before it
  bool came_to_contact_ = false;
};

struct Seen {
  int grazes = 0;
  int blind = 0;
};

/// Episodes with truths along x and y at the rims of cells, where edges are met or missed by a hair.
Seen RunEpisodesAtRims(const planner::Extents& extents, int episodes) {
  const Task task = HousingTask();
  const planner::Problem problem = planner::MakeCuboidProblem(task, HousingMap(), extents);
  const planner::SolverOptions solver = planner::FastSetting(planner::SolverKind::kRtdpBel, 1.2);
  const auto graph = std::make_shared<planner::PolicyGraph>(*planner::Solve(problem, solver).policy);
  const Pose start = LatticeStartPose(task, problem, Pose::Identity());
  ExecutorOptions options;
  options.force_budget_n = kBudget_n;
  Seen seen;
  for (int i = 0; i < episodes; ++i) {
    RandomStream draw(8, static_cast<std::uint64_t>(i), "true pose");
    Pose truth = Pose::Identity();
    for (int axis = 0; axis < 3; ++axis) {
      double cells = draw.Uniform(-0.5, extents[axis] - 0.5);
      if (axis < 2) cells = std::floor(cells) + 0.5 + draw.Uniform(-0.02, 0.02);
      truth.translation()[axis] = (cells - 0.5 * (extents[axis] - 1)) * task.cell_m;
    }
    WitnessRobot robot(task, truth, start, RandomStream(8, static_cast<std::uint64_t>(i), "robot"));
    policies::DatabasePolicy policy(graph);
    const ExecutionRecord record = Execute(task, problem, Pose::Identity(), policy, robot, options);
    seen.grazes += record.grazes;
    seen.blind += robot.blind;
  }
  return seen;
}

/// Moves one after the other, whatever is felt; then it gives up.
class ScriptedPolicy : public policies::Policy {
 public:
  explicit ScriptedPolicy(std::vector<GuardedMove> moves) : moves_(std::move(moves)) {}
  std::string_view name() const override { return "scripted"; }
  void Begin(const planner::Problem&) override { next_ = 0; }
  policies::Decision Next(const policies::Belief&) override {
    if (next_ >= moves_.size()) return policies::GiveUp{"the script is over"};
    return moves_[next_];
  }
  bool Observe(const Outcome&) override {
    ++next_;
    return true;
  }

 private:
  std::vector<GuardedMove> moves_;
  std::size_t next_ = 0;
};

// The tool comes down on the opening of a target that stands higher than the one that its free way speaks for, and so
// ends in the opening. The ways aside that follow are shorter and longer than the opening is wide.
TEST(FallIn, AToolInTheOpeningGoesAsideAsSlowlyAsWallsThatHoldItAsk) {
  const Task task = HousingTask();
  const planner::Problem problem = planner::MakeCuboidProblem(task, HousingMap(), {3, 3, 2});
  const planner::Hypothesis low = problem.hypotheses.front();
  ASSERT_EQ(low.offset.z(), 0);
  const auto down =
      static_cast<int>(problem.map->Travel(problem.start - low.offset, Direction::kMinusZ, low.orientation));
  const Pose start = LatticeStartPose(task, problem, Pose::Identity());
  ExecutorOptions options;
  options.force_budget_n = kBudget_n;
  int inside = 0;
  for (const Direction aside : {Direction::kMinusX, Direction::kPlusX, Direction::kMinusY, Direction::kPlusY}) {
    for (const int cells : {1, 2, 20}) {
      Pose truth = MakePose({start.translation().x() + 2e-4, start.translation().y() - 1e-4, 0.5 * task.cell_m});
      WitnessRobot robot(task, truth, start, RandomStream(8, 1, "robot"));
      ScriptedPolicy policy({{Direction::kMinusZ, down}, {aside, cells}, {Direction::kPlusZ, 1}, {aside, 1}});
      Execute(task, problem, Pose::Identity(), policy, robot, options);
      const ContactResponse wall = robot.Contact(UnitVector(aside));
      EXPECT_LE(robot.fastest_m_s, SpeedWithinBudget(wall.Held(), kBudget_n) * (1.0 + 1e-9)) << cells;
      EXPECT_LE(robot.fastest_in_lead_in_m_s, SpeedWithinBudget(wall, kBudget_n) * (1.0 + 1e-9)) << cells;
      inside += robot.inside;
    }
  }
  EXPECT_GE(inside, 12) << "the tool was not in the opening";
}

TEST(FallIn, AnOpeningThatGoesThroughIsNoTrap) {
  Task task = HousingTask();
  task.insertion_depth_m = 0.010;
  Task through = task;
  through.insertion_depth_m = 0.028;
  const planner::Extents extents = {3, 3, 5};
  const planner::Problem problem = planner::MakeCuboidProblem(task, HousingMap(), extents);
  const Pose start = LatticeStartPose(task, problem, Pose::Identity());
  constexpr int kLong = 32;
  for (int height = -2; height <= 2; ++height) {
    const Pose truth = MakePose({start.translation().x() + 2e-4, start.translation().y() - 1e-4, height * task.cell_m});
    WitnessRobot robot(through, truth, start, RandomStream(8, 1, "robot"));
    ScriptedPolicy policy({{Direction::kMinusZ, kLong}});
    const ExecutionRecord record = Execute(task, problem, Pose::Identity(), policy, robot, ExecutorOptions());
    EXPECT_TRUE(record.fell_in) << height;
    EXPECT_TRUE(record.believed_inserted) << height << ": " << record.reason;
    EXPECT_LT((record.world_T_estimate->translation() - truth.translation()).norm(), 5e-4) << height;
  }
}

TEST(FallIn, AMotionThatIsNotWatchedGoesWhereTheToolCameFrom) {
  const Seen seen = RunEpisodesAtRims({2, 9, 4}, 150);
  EXPECT_EQ(seen.blind, 0);
  EXPECT_GT(seen.grazes, 5) << "no edge was shifted off";
}

}  // namespace
}  // namespace feeler::execution
