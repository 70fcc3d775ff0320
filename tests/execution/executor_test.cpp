// Laws of the executor with policies of the solver, a truth anywhere between the lattice points, and a robot that
// misses weak contacts, reads late and slides over edges:
// - every truth in the box is localized within the tolerance and inserted; what the executor believes is true;
// - axes across the insertion are pinned by a contact or known within the confirm limit;
// - the record is a function of what the robot answers: again the same, and the same in a world moved as a whole;
// - a failure carries a reason; robots that never move, always feel contact or answer nonsense end with one.
#include "feeler/execution/executor.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <memory>

#include "feeler/core/error.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

std::shared_ptr<const planner::PolicyGraph> PolicyFor(const planner::Problem& problem) {
  const planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kRtdpBel, 1.2);
  static const auto tables = planner::BuildPlanningTables(problem, options);  // shared: one map, one set of costs
  const planner::SolverResult result = planner::Solve(problem, options, tables);
  if (!result.policy) return nullptr;
  return std::make_shared<planner::PolicyGraph>(*result.policy);
}

struct Episode {
  ExecutionRecord record;
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero();  ///< estimate minus truth, in target axes
  bool inserted = false;                              ///< in truth
  Eigen::Vector3d truth = Eigen::Vector3d::Zero();    ///< from the estimate, in cells
};

Pose TruePose(const planner::Problem& problem, const Task& task, const Pose& world_T_estimate, RandomStream& random) {
  Cell most = Cell::Zero();
  for (const auto& h : problem.hypotheses) most = most.cwiseMax(h.offset);
  Eigen::Vector3d offset;
  for (int axis = 0; axis < 3; ++axis) {
    offset[axis] = random.Uniform(-0.5, most[axis] + 0.5) - 0.5 * most[axis];
  }
  Pose pose = world_T_estimate;
  pose.translation() = world_T_estimate * Eigen::Vector3d(offset * task.cell_m);
  return pose;
}

Episode RunEpisode(const planner::Problem& problem, std::shared_ptr<const planner::PolicyGraph> graph,
                   std::uint64_t seed, std::uint64_t number, const Pose& world_T_estimate = Pose::Identity(),
                   const RobotFaults& faults = {}, const ExecutorOptions& options = {}) {
  const Task task = HousingTask();
  RandomStream draw(seed, number, "true pose");
  const Pose truth = TruePose(problem, task, world_T_estimate, draw);
  KinematicRobot robot(HousingOverPanel(), task, truth, LatticeStartPose(task, problem, world_T_estimate), faults,
                       RandomStream(seed, number, "robot"));
  policies::DatabasePolicy policy(std::move(graph));
  Episode episode;
  episode.record = Execute(task, problem, world_T_estimate, policy, robot, options);
  episode.inserted = robot.Inserted();
  episode.truth = world_T_estimate.inverse() * truth.translation() / task.cell_m;
  if (episode.record.world_T_estimate) {
    episode.error_m =
        truth.linear().transpose() * (episode.record.world_T_estimate->translation() - truth.translation());
  }
  return episode;
}

std::string Trace(const ExecutionRecord& record) {
  std::string text = record.reason + "\n";
  for (const MoveRecord& m : record.moves) {
    text += fmt::format("  {:9} {:2} commanded {:7.3f} travelled {:7.3f} mm{}", m.kind, m.direction,
                        1e3 * m.commanded_m, 1e3 * m.travelled_m, m.contact ? " contact" : "");
    if (m.predicted_m)
      text += fmt::format(" predicted {:.3f}..{:.3f}", 1e3 * (*m.predicted_m)[0], 1e3 * (*m.predicted_m)[1]);
    text += "\n";
  }
  return text;
}

bool Same(const ExecutionRecord& a, const ExecutionRecord& b) {
  return Trace(a) == Trace(b) && a.sim_time_s == b.sim_time_s && a.path_length_m == b.path_length_m;
}

struct Row {
  planner::Extents extents;
  int episodes;
};

class OffLattice : public testing::TestWithParam<Row> {};

TEST_P(OffLattice, EveryTruthIsLocalizedAndInserted) {
  const Task task = HousingTask();
  const planner::Problem problem = planner::MakeCuboidProblem(task, HousingMap(), GetParam().extents);
  const auto graph = PolicyFor(problem);
  ASSERT_TRUE(graph);
  const char* scale_text = std::getenv("FEELER_EXECUTOR_EPISODES");  // to run more of them by hand
  const int episodes = scale_text ? std::atoi(scale_text) : GetParam().episodes;
  int failed = 0;
  double moves = 0, probes = 0, contacts = 0, seconds = 0, grazes = 0, fell_in = 0, length = 0, policy_moves = 0;
  std::vector<double> lateral;
  std::map<std::string, int> reasons;
  for (int i = 0; i < episodes; ++i) {
    const Episode episode = RunEpisode(problem, graph, 1, static_cast<std::uint64_t>(i));
    const ExecutionRecord& record = episode.record;
    EXPECT_FALSE(record.reason.empty());
    EXPECT_EQ(record.believed_inserted, episode.inserted) << "episode " << i << " " << Trace(record);
    const double worst = episode.error_m.head<2>().cwiseAbs().maxCoeff();
    const bool good = record.believed_localized && record.believed_inserted && worst <= task.tolerance.lateral_m &&
                      std::abs(episode.error_m.z()) <= task.tolerance.vertical_m;
    if (!good) {
      if (++failed <= 3) {
        ADD_FAILURE() << "episode " << i << " truth " << episode.truth.transpose() << " error mm "
                      << 1e3 * episode.error_m.transpose() << " " << Trace(record);
      }
      continue;
    }
    for (std::size_t m = 1; m < record.moves.size(); ++m) {
      const MoveRecord& met = record.moves[m - 1];
      const std::string& back = record.moves[m].direction;  // empty: not along an axis
      if (record.moves[m].kind != "retreat" || met.kind == "retreat" || met.direction.empty() || back.empty()) continue;
      const std::string off = (met.direction[0] == '+' ? "-" : "+") + met.direction.substr(1);
      EXPECT_EQ(back, off) << met.kind << ": a retreat goes off what was met";
    }
    for (const MoveRecord& m : record.moves) {
      if (!m.predicted_m) continue;
      EXPECT_GE((*m.predicted_m)[0], -1e-9) << m.kind << " " << m.direction;
      EXPECT_LE((*m.predicted_m)[0], (*m.predicted_m)[1]) << m.kind << " " << m.direction;
      EXPECT_LE((*m.predicted_m)[1], m.commanded_m + 1e-9) << m.kind << " " << m.direction;
    }
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_LE(record.half_width_m[static_cast<std::size_t>(axis)], 0.0005);
    }
    lateral.push_back(worst);
    moves += static_cast<double>(record.moves.size());
    policy_moves += record.policy_moves;
    probes += static_cast<double>(std::count_if(record.moves.begin(), record.moves.end(), [](const MoveRecord& m) {
      return m.kind == "probe" || m.kind == "confirm";
    }));
    contacts += record.contacts;
    seconds += record.sim_time_s;
    grazes += record.grazes;
    fell_in += record.fell_in;
    length += record.path_length_m;
  }
  EXPECT_EQ(failed, 0) << "of " << episodes;
  std::sort(lateral.begin(), lateral.end());
  if (lateral.empty()) return;
  const double n = static_cast<double>(lateral.size());
  fmt::print(
      "{}: {} of {} good; motions {:.1f} policy moves {:.1f} probes {:.1f} contacts {:.1f} grazes {:.3f} fell in "
      "{:.3f} "
      "path {:.0f} mm time {:.2f} s; lateral error p50 {:.3f} p95 {:.3f} max {:.3f} mm\n",
      planner::ToString(GetParam().extents), lateral.size(), episodes, moves / n, policy_moves / n, probes / n,
      contacts / n, grazes / n, fell_in / n, 1e3 * length / n, seconds / n, 1e3 * lateral[lateral.size() / 2],
      1e3 * lateral[static_cast<std::size_t>(0.95 * (n - 1))], 1e3 * lateral.back());
}

INSTANTIATE_TEST_SUITE_P(Cuboids, OffLattice,
                         testing::Values(Row{{3, 3, 3}, 300}, Row{{7, 7, 7}, 300}, Row{{11, 11, 11}, 150},
                                         Row{{15, 15, 15}, 60}, Row{{2, 9, 4}, 100}, Row{{15, 2, 2}, 100}),
                         [](const auto& row) { return planner::ToString(row.param.extents); });

TEST(Executor, SameAnswersSameRecord) {
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), HousingMap(), {4, 4, 4});
  const auto graph = PolicyFor(problem);
  ASSERT_TRUE(graph);
  for (std::uint64_t i = 0; i < 10; ++i) {
    EXPECT_TRUE(Same(RunEpisode(problem, graph, 2, i).record, RunEpisode(problem, graph, 2, i).record));
  }
}

// Only relative poses matter: the whole world turned and moved gives the same motions.

TEST(Executor, MovedWorldSameMotions) {
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), HousingMap(), {4, 4, 4});
  const auto graph = PolicyFor(problem);
  ASSERT_TRUE(graph);
  const Pose moved = MakePose({0.4, -0.3, 0.2}, 0.25);
  RobotFaults faultless{0.0, 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0};
  for (std::uint64_t i = 0; i < 10; ++i) {
    const ExecutionRecord a = RunEpisode(problem, graph, 2, i, Pose::Identity(), faultless).record;
    const ExecutionRecord b = RunEpisode(problem, graph, 2, i, moved, faultless).record;
    EXPECT_EQ(Trace(a), Trace(b));
    EXPECT_TRUE(a.believed_inserted);
  }
}

/// Answers every motion in one way; whatever the executor does, it must end.
class StubbornRobot : public Robot {
 public:
  StubbornRobot(const Pose& pose, bool contact, StopReason reason) : pose_(pose), contact_(contact), reason_(reason) {}
  Pose ToolPose() const override { return pose_; }
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return time_s_; }
  MotionResult Transfer(const Pose&) override { return Answer(); }
  MotionResult LinearMove(const Pose& to, double, double) override {
    if (follow_) pose_ = to;
    return Answer();
  }
  MotionResult Guarded(const GuardedMotion& m) override {
    if (follow_) pose_.translation() += m.distance_m * m.direction;
    return Answer();
  }
  MotionResult Compliant(const CompliantMotion& m) override {
    if (follow_) pose_ = m.world_T_tool.back();
    return Answer();
  }
  bool follow_ = false;
  double step_s_ = 0.1;
  bool nan_ = false;

 private:
  MotionResult Answer() {
    time_s_ += step_s_;
    MotionResult result;
    result.reason = reason_;
    result.contact = contact_;
    result.world_T_tool = pose_;
    if (nan_) result.world_T_tool.translation().x() = std::numeric_limits<double>::quiet_NaN();
    result.detail = "stubborn";
    return result;
  }
  Pose pose_;
  bool contact_;
  StopReason reason_;
  double time_s_ = 0.0;
};

ExecutionRecord RunStubborn(StubbornRobot& robot, const ExecutorOptions& options = {}) {
  static const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), HousingMap(), {3, 3, 3});
  static const auto graph = PolicyFor(problem);
  policies::DatabasePolicy policy(graph);
  return Execute(HousingTask(), problem, Pose::Identity(), policy, robot, options);
}

Pose StubbornStart() {
  return LatticeStartPose(HousingTask(), planner::MakeCuboidProblem(HousingTask(), HousingMap(), {3, 3, 3}),
                          Pose::Identity());
}

TEST(Executor, AdversarialRobotsEndWithAReason) {
  for (const bool contact : {false, true}) {
    for (const bool follow : {false, true}) {
      StubbornRobot robot(StubbornStart(), contact, contact ? StopReason::kContact : StopReason::kReached);
      robot.follow_ = follow;
      const ExecutionRecord record = RunStubborn(robot);
      EXPECT_FALSE(record.reason.empty());
      EXPECT_FALSE(record.believed_inserted) << Trace(record);
      if (contact) continue;
      EXPECT_FALSE(record.believed_localized) << "nothing was ever touched";
      EXPECT_EQ(record.reason == "no contact was met: is the target there?", follow) << record.reason;
    }
  }
  StubbornRobot aborted(StubbornStart(), false, StopReason::kAborted);
  EXPECT_NE(RunStubborn(aborted).reason.find("aborted: stubborn"), std::string::npos);
  StubbornRobot nan(StubbornStart(), false, StopReason::kReached);
  nan.nan_ = true;
  EXPECT_NE(RunStubborn(nan).reason.find("not a sensible number"), std::string::npos);
  StubbornRobot slow(StubbornStart(), true, StopReason::kContact);
  slow.step_s_ = 1e3;
  EXPECT_NE(RunStubborn(slow).reason.find("limit"), std::string::npos);
  Pose elsewhere = StubbornStart();
  elsewhere.translation().x() += 0.01;
  StubbornRobot astray(elsewhere, false, StopReason::kReached);
  EXPECT_NE(RunStubborn(astray).reason.find("start"), std::string::npos);
}

/// Moves back and forth for ever.
class EndlessPolicy : public policies::Policy {
 public:
  std::string_view name() const override { return "endless"; }
  void Begin(const planner::Problem&) override {}
  policies::Decision Next(const policies::Belief&) override {
    return GuardedMove{forth_ ? Direction::kPlusX : Direction::kMinusX, 1};
  }
  bool Observe(const Outcome&) override {
    forth_ = !forth_;
    return true;
  }

 private:
  bool forth_ = true;
};

class ThrowingPolicy : public EndlessPolicy {
 public:
  policies::Decision Next(const policies::Belief&) override { throw std::runtime_error("no idea"); }
};

TEST(Executor, AdversarialPoliciesEndWithAReason) {
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), HousingMap(), {3, 3, 3});
  const auto run = [&](policies::Policy& policy) {
    KinematicRobot robot(HousingOverPanel(), HousingTask(), Pose::Identity(),
                         LatticeStartPose(HousingTask(), problem, Pose::Identity()), {}, RandomStream(1, 1, "robot"));
    return Execute(HousingTask(), problem, Pose::Identity(), policy, robot).reason;
  };
  EndlessPolicy endless;
  EXPECT_NE(run(endless).find("limit"), std::string::npos);
  ThrowingPolicy throwing;
  EXPECT_EQ(run(throwing), "policy threw: no idea");
}

/// Counts what it is handed.
class CountingPolicy final : public EndlessPolicy {
 public:
  explicit CountingPolicy(bool reads) : reads_(reads) {}
  bool reads_hypotheses() const override { return reads_; }
  policies::Decision Next(const policies::Belief& belief) override {
    seen.push_back(belief.hypotheses.size());
    return policies::GiveUp{"seen enough"};
  }
  std::vector<std::size_t> seen;

 private:
  bool reads_;
};

TEST(Executor, WhoDoesNotReadABeliefIsHandedNoHypotheses) {
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), HousingMap(), {3, 3, 3});
  for (const bool reads : {false, true}) {
    CountingPolicy policy(reads);
    KinematicRobot robot(HousingOverPanel(), HousingTask(), Pose::Identity(),
                         LatticeStartPose(HousingTask(), problem, Pose::Identity()), {}, RandomStream(1, 1, "robot"));
    ExecutorOptions options;
    options.ladder = false;
    Execute(HousingTask(), problem, Pose::Identity(), policy, robot, options);
    EXPECT_EQ(policy.seen, std::vector<std::size_t>{reads ? 27U : 0U});
  }
}

TEST(Executor, OptionsOutOfRangeAreRefused) {
  StubbornRobot robot(StubbornStart(), false, StopReason::kReached);
  ExecutorOptions options;
  options.probe_speed_m_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(RunStubborn(robot, options), InputError);
  options = {};
  options.motion_limit = 0;
  EXPECT_THROW(RunStubborn(robot, options), InputError);
}

}  // namespace
}  // namespace feeler::execution
