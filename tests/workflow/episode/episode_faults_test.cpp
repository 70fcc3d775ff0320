// Laws of the noises of the world: names combine with commas and contradictions are refused; `outside` puts the truth
// 0.5 to 4 mm outside the box on exactly one axis; yaw errors have the size of their name and either sign; each noise
// makes a deterministic episode in physics that the executor with its ladder masters, and `fall-in` makes the tool
// fall in; a start pose out of reach ends the episode with a reason.
#include "feeler/workflow/episode/episode_faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/env/scene/oversize_target.h"
#include "feeler/execution/recovery/fallback_ladder.h"
#include "feeler/execution/recovery/online_planner.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "tests/workflow/episode/three_axis_task.h"

namespace feeler::workflow {
namespace {

TEST(ParseFaults, CombinesNamesAndRefusesContradictions) {
  EXPECT_EQ(ParseFaults("ideal").yaw_error_rad, 0.0);
  const EpisodeFaults both = ParseFaults("friction,yaw-2");
  EXPECT_GT(both.robot.force_noise_n, 0.0);
  EXPECT_NEAR(both.yaw_error_rad, 2.0 * std::numbers::pi / 180.0, 1e-12);
  EXPECT_EQ(both.name, "friction,yaw-2");
  for (const FaultName& noise : FaultNames()) {
    std::string name = noise.name;
    if (const std::size_t number = name.find("NUMBER"); number != std::string::npos) {
      EXPECT_THROW(ParseFaults(name), InputError) << name;
      name.replace(number, std::string::npos,
                   name.starts_with("stiffness")    ? "20000"
                   : name.starts_with("false-stop") ? "0.3"
                   : name.starts_with("missed-con") ? "0.3"
                   : name.starts_with("spent-step") ? "0.3"
                                                    : "3");
    }
    if (const std::size_t range = name.find("FROM..TO"); range != std::string::npos) {
      EXPECT_THROW(ParseFaults(name), InputError) << name;
      name.replace(range, std::string::npos, "0.5..2.5");
    }
    EXPECT_NO_THROW(ParseFaults(name)) << name;
  }
  for (const char* bad : {"", "loud", "yaw-1,yaw-2", "outside,fall-in", "friction,friction", "ideal,"}) {
    EXPECT_THROW(ParseFaults(bad), InputError) << bad;
  }
}

TEST(DrawEpisode, OutsideIsBeyondOneSideOfTheBox) {
  const Task task = ThreeAxisTask();
  const planner::ProblemFamily family = planner::ParseProblemFamily("3x4x7");
  const Eigen::Vector3d half_m = 0.5 * task.cell_m * Eigen::Vector3d(3, 4, 7);
  int sides[3][2] = {};
  for (std::uint64_t k = 0; k < 300; ++k) {
    const EpisodeDraw draw = DrawEpisode(task, family, 3, k, ParseFaults("outside"));
    const Eigen::Vector3d offset = (draw.world_T_estimate.inverse() * draw.world_T_true).translation();
    int outside = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double beyond = std::abs(offset[axis]) - half_m[axis];
      if (beyond <= 0.0) continue;
      ++outside;
      ++sides[axis][offset[axis] > 0.0];
      EXPECT_GE(beyond, 0.0005 - 1e-12);
      EXPECT_LE(beyond, 0.004 + 1e-12);
    }
    EXPECT_EQ(outside, 1);
  }
  for (const auto& axis : sides) {
    EXPECT_GT(axis[0], 20);
    EXPECT_GT(axis[1], 20);
  }
}

TEST(DrawEpisode, YawErrorHasItsSizeAndEitherSign) {
  const Task task = ThreeAxisTask();
  const planner::ProblemFamily family = planner::ParseProblemFamily("3x3x3");
  const EpisodeFaults noise = ParseFaults("yaw-3");
  int positive = 0;
  for (std::uint64_t k = 0; k < 200; ++k) {
    const EpisodeDraw draw = DrawEpisode(task, family, 3, k, noise);
    const Eigen::Matrix3d turn = draw.world_T_estimate.linear().transpose() * draw.world_T_true.linear();
    const double yaw = std::atan2(turn(1, 0), turn(0, 0));
    EXPECT_NEAR(std::abs(yaw), noise.yaw_error_rad, 1e-12);
    positive += yaw > 0.0;
    // The same place as without.
    const EpisodeDraw plain = DrawEpisode(task, family, 3, k);
    EXPECT_EQ(draw.world_T_true.translation(), plain.world_T_true.translation());
  }
  EXPECT_GT(positive, 60);
  EXPECT_LT(positive, 140);
}

TEST(DrawEpisode, RangesAreFilledAndKept) {
  const Task task = ThreeAxisTask();
  const planner::ProblemFamily family = planner::ParseProblemFamily("3x3x3");
  const EpisodeFaults faults = ParseFaults("yaw=1..5,outside=2..7");
  const double degree = std::numbers::pi / 180.0;
  int small_turns = 0;
  int near_places = 0;
  for (std::uint64_t k = 0; k < 200; ++k) {
    const EpisodeDraw draw = DrawEpisode(task, family, 3, k, faults);
    const Pose offset = draw.world_T_estimate.inverse() * draw.world_T_true;
    const double turn_rad = std::abs(std::atan2(offset.linear()(1, 0), offset.linear()(0, 0)));
    EXPECT_GE(turn_rad, 1.0 * degree - 1e-12);
    EXPECT_LE(turn_rad, 5.0 * degree + 1e-12);
    small_turns += turn_rad < 3.0 * degree;
    double beyond_m = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      beyond_m = std::max(beyond_m, std::abs(offset.translation()[axis]) - 1.5 * task.cell_m);
    }
    EXPECT_GE(beyond_m, 0.002 - 1e-12);
    EXPECT_LE(beyond_m, 0.007 + 1e-12);
    near_places += beyond_m < 0.0045;
  }
  EXPECT_GT(small_turns, 60);
  EXPECT_LT(small_turns, 140);
  EXPECT_GT(near_places, 60);
  EXPECT_LT(near_places, 140);
  for (const char* bad : {"yaw=5..1", "yaw=0..x", "yaw=..3", "outside=-1..3", "stiffness=1..2", "yaw=0..99",
                          "tilt=1..2", "outside,outside=1..2", "yaw-1,yaw=1..2"}) {
    EXPECT_THROW((void)ParseFaults(bad), InputError) << bad;
  }
}

TEST(DrawWorld, FalseStopsAreCountedPerMetre) {
  const Task task = ThreeAxisTask();
  const WorldDraw draw = DrawWorld(task, ParseFaults("false-stop=0.02"), 0.3, 5, 1);
  // Without a false stop over a cell: 1 - 0.02.
  EXPECT_NEAR(std::exp(-draw.robot.false_stops_per_m * task.cell_m), 0.98, 1e-12);
  EXPECT_EQ(DrawWorld(task, ParseFaults("ideal"), 0.3, 5, 1).robot.false_stops_per_m, 0.0);
  EXPECT_THROW((void)ParseFaults("false-stop=0.6"), InputError);
}

TEST(DrawWorld, StepsFailWithTheProbabilitiesOfTheModel) {
  const Task task = ThreeAxisTask();
  const env::NoiseOptions robot =
      DrawWorld(task, ParseFaults("false-stop=0.2,missed-contact=0.1,spent-step=0.3"), 0.3, 5, 1).robot;
  EXPECT_EQ(robot.step_m, task.cell_m);
  EXPECT_EQ(robot.missed_contact, 0.1);
  const double no_false_stop = std::exp(-robot.false_stops_per_m * task.cell_m);
  EXPECT_NEAR(no_false_stop, 0.8, 1e-12);
  EXPECT_NEAR(no_false_stop * robot.spent_step, 0.3, 1e-12) << "of all cells, those that end falsely included";
  EXPECT_EQ(DrawWorld(task, ParseFaults("ideal"), 0.3, 5, 1).robot.step_m, 0.0);
  for (const char* bad : {"missed-contact=0.6", "spent-step=-0.1", "false-stop=0.5,spent-step=0.5"}) {
    EXPECT_THROW((void)ParseFaults(bad), InputError) << bad;
  }
}

TEST(DrawWorld, RangesOfPhysicsAreDrawnPerEpisode) {
  const Task task = ThreeAxisTask();
  const EpisodeFaults faults = ParseFaults(
      "latency=2..8,contact-friction=0.1..0.6,slip=0..1,force-noise=1..6,port-stiffness=5..50,worn=-0.3..0.3");
  EXPECT_GE(faults.robot.contact_threshold_n, 40.0) << "a contact is told from the worst noise of the range";
  std::map<std::string, std::pair<double, double>> met;
  for (std::uint64_t k = 0; k < 200; ++k) {
    const WorldDraw draw = DrawWorld(task, faults, 0.3, 5, k);
    EXPECT_EQ(draw.values, DrawWorld(task, faults, 0.3, 5, k).values);
    EXPECT_DOUBLE_EQ(draw.robot.force_delay_s, 1e-3 * draw.values.at("latency"));
    EXPECT_EQ(draw.robot.force_noise_n, draw.values.at("force-noise"));
    EXPECT_NEAR(0.3 * draw.physics.contact_friction, draw.values.at("contact-friction"), 1e-12);
    EXPECT_NEAR(1e-3 * draw.physics.port_stiffness_n_m, draw.values.at("port-stiffness"), 1e-9);
    EXPECT_NEAR(1e3 * draw.physics.worn_m, draw.values.at("worn"), 1e-12);
    EXPECT_NEAR(1e3 * draw.physics.tool_slip_m.norm(), draw.values.at("slip"), 1e-12);
    EXPECT_EQ(draw.physics.tool_slip_m[AxisOf(task.insertion)], 0.0);
    EXPECT_NEAR(std::abs(draw.physics.tool_turn_rad) * 180.0 / std::numbers::pi, 2.0 * draw.values.at("slip"), 1e-9);
    for (const auto& [name, value] : draw.values) {
      auto [it, first] = met.try_emplace(name, value, value);
      it->second = {std::min(it->second.first, value), std::max(it->second.second, value)};
    }
    // Every fault has a stream of its own.
    EXPECT_EQ(DrawWorld(task, ParseFaults("slip=0..1"), 0.3, 5, k).values.at("slip"), draw.values.at("slip"));
  }
  const std::map<std::string, std::pair<double, double>> ranges = {
      {"latency", {2.0, 8.0}},     {"contact-friction", {0.1, 0.6}}, {"slip", {0.0, 1.0}},
      {"force-noise", {1.0, 6.0}}, {"port-stiffness", {5.0, 50.0}},  {"worn", {-0.3, 0.3}}};
  ASSERT_EQ(met.size(), ranges.size());
  for (const auto& [name, range] : ranges) {
    const double width = range.second - range.first;
    EXPECT_GE(met[name].first, range.first) << name;
    EXPECT_LE(met[name].second, range.second) << name;
    EXPECT_LT(met[name].first, range.first + 0.1 * width) << name;
    EXPECT_GT(met[name].second, range.second - 0.1 * width) << name;
  }
}

TEST(ForceBudget, IsAboveWhatTellsAContactFromNoise) {
  Task task = ThreeAxisTask();
  EXPECT_EQ(ForceBudget(task, ParseFaults("ideal"), {}), 25.0);
  task.force_budget_n = 12.0;
  EXPECT_EQ(ForceBudget(task, ParseFaults("ideal"), {}), 12.0);
  EXPECT_EQ(ForceBudget(task, ParseFaults("ideal"), 60.0), 60.0);
  EXPECT_NEAR(ForceBudget(task, ParseFaults("force-noise=6"), {}), 48.0, 1e-12) << "the default rises";
  for (const double wanted_n : {47.0, 0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW((void)ForceBudget(task, ParseFaults("force-noise=6"), wanted_n), InputError) << wanted_n;
  }
}

std::shared_ptr<const PlanningSetup> PlugSetup() {
  static const auto kSetup = std::make_shared<const PlanningSetup>(LoadPlanningSetup("plug"));
  return kSetup;
}

EpisodeRunner Runner(std::shared_ptr<const PlanningSetup> setup, const std::string& noise) {
  static const auto kPlanner = std::make_shared<execution::OnlinePlanner>();
  const auto factory = [](const PolicyRequest& request) { return kPlanner->PolicyFor(request.problem); };
  EpisodeOptions options;
  options.seed = 17;
  options.family = planner::ParseProblemFamily("3x3x3");
  options.noise = noise;
  return EpisodeRunner(setup, BuildEpisodeScene(*setup), factory, options);
}

class NoisyEpisode : public testing::TestWithParam<const char*> {};

TEST_P(NoisyEpisode, IsMasteredAndDeterministic) {
  const EpisodeRecord first = Runner(PlugSetup(), GetParam()).Run(2);
  EXPECT_TRUE(first.inserted) << first.reason;
  EXPECT_EQ(first.noise, GetParam());
  EpisodeRunner again = Runner(PlugSetup(), GetParam());
  again.Run(1);  // what ran before does not matter
  const EpisodeRecord second = again.Run(2);
  EXPECT_EQ(first.reason, second.reason);
  EXPECT_EQ(first.execution.sim_time_s, second.execution.sim_time_s);
  EXPECT_EQ(first.execution.path_length_m, second.execution.path_length_m);
  EXPECT_EQ(first.execution.ladder.size(), second.execution.ladder.size());
  const std::string fault = GetParam();
  const auto felt = [](const EpisodeRecord& record) {
    std::vector<double> travelled_m;
    for (const auto& move : record.execution.moves) travelled_m.push_back(move.travelled_m);
    return travelled_m;
  };
  // The fault has reached the world: another truth, or the same one that feels different.
  const EpisodeRecord ideal = Runner(PlugSetup(), "ideal").Run(2);
  const bool moved = first.world_T_true.matrix() != ideal.world_T_true.matrix();
  EXPECT_EQ(moved, fault != "ideal" && fault != "friction" && fault != "oversize");
  EXPECT_EQ(felt(first) == felt(ideal), fault == "ideal");
  EXPECT_EQ(first.truth_outside, fault == "outside");
  if (fault == "fall-in") {
    EXPECT_TRUE(first.execution.fell_in);
  }
  if (fault.starts_with("yaw-")) {
    const Eigen::AngleAxisd turn(ideal.world_T_true.linear().transpose() * first.world_T_true.linear());
    EXPECT_NEAR(turn.angle(), (fault == "yaw-3" ? 3.0 : 2.0) * std::numbers::pi / 180.0, 1e-9);
  }
  if (fault == "yaw-3") {
    EXPECT_LT(first.error->angle_rad, 0.0175);
  }
}

// The tool slips into an opening that its belief knows closed: ways across begin so slowly that its walls are met
// within the budget.
TEST(NoisyEpisodes, FallingInMeetsTheWallsWithinTheBudget) {
  EpisodeRunner runner = Runner(PlugSetup(), "fall-in");
  for (std::uint64_t episode = 0; episode < 10; ++episode) {
    const EpisodeRecord record = runner.Run(episode);
    EXPECT_TRUE(record.execution.fell_in && record.inserted) << episode << ": " << record.reason;
    EXPECT_LE(record.execution.peak_force_n, record.execution.force_budget_n) << episode;
  }
}

// A turn is felt once, and then known: no sweep, no second fit, and ways are fast again.
TEST(NoisyEpisodes, ATurnIsFeltAtOnce) {
  EpisodeRunner runner = Runner(PlugSetup(), "yaw=3.5..5");
  for (std::uint64_t episode = 0; episode < 6; ++episode) {
    const EpisodeRecord record = runner.Run(episode);
    EXPECT_TRUE(record.inserted) << episode << ": " << record.reason;
    EXPECT_LE(record.execution.sim_time_s, 20.0) << episode;
    for (const auto& rung : record.execution.ladder) EXPECT_NE(rung.rung, execution::rung::kYawSweep) << episode;
  }
}

INSTANTIATE_TEST_SUITE_P(Names, NoisyEpisode,
                         testing::Values("ideal", "friction", "outside", "fall-in", "oversize", "yaw-2", "yaw-3"),
                         [](const auto& name) {
                           std::string text = name.param;
                           for (char& c : text) c = c == '-' ? '_' : c;
                           return text;
                         });

TEST(ParseFaults, NumbersGrowOnTopOfPresets) {
  const EpisodeFaults noise = ParseFaults("force-noise=2,joint-friction=5,stiffness=20000,yaw=1.5");
  EXPECT_EQ(noise.robot.force_noise_n, 2.0);
  EXPECT_GE(noise.robot.contact_threshold_n, 12.0) << "contacts are told from noise";
  EXPECT_EQ(noise.robot.joint_friction_nm[0], 5.0);
  EXPECT_EQ(noise.robot.joint_friction_nm[5], 2.0);
  EXPECT_EQ(noise.robot.joint_stiffness_nm_rad, 20000.0);
  EXPECT_NEAR(noise.yaw_error_rad, 0.0261799, 1e-6);
  const EpisodeFaults none = ParseFaults("force-noise=0,joint-friction=0");
  EXPECT_EQ(none.robot.contact_threshold_n, ParseFaults("ideal").robot.contact_threshold_n);
  EXPECT_EQ(ParseFaults("force-noise=0.5,friction").robot.force_noise_n, 0.5) << "in any order";
  for (const char* bad : {"force-noise=", "force-noise=-1", "force-noise=x", "yaw=nan", "loudness=3", "yaw=1,yaw-2",
                          "yaw=1,yaw=1", "stiffness=0"}) {
    EXPECT_THROW(ParseFaults(bad), InputError) << bad;
  }
}

TEST(OversizeTarget, StandsFartherOutOnTheSidesOnly) {
  const auto scene = BuildEpisodeScene(*PlugSetup());
  const env::Scene grown = env::WithOversizeTarget(*scene, 0.0005);
  const auto reach = [](const env::Scene& s, const char* name, int axis) {
    const int geom = mj_name2id(s.model.get(), mjOBJ_GEOM, name);
    return s.model->geom_pos[3 * geom + axis] + s.model->geom_size[3 * geom + axis];
  };
  EXPECT_NEAR(reach(grown, "c14_wall_north", 1), reach(*scene, "c14_wall_north", 1) + 0.0005, 1e-12);
  EXPECT_NEAR(reach(grown, "c14_wall_east", 0), reach(*scene, "c14_wall_east", 0) + 0.0005, 1e-12);
  EXPECT_NEAR(reach(grown, "c14_wall_north", 2), reach(*scene, "c14_wall_north", 2), 1e-12);
  // The side towards the opening stays.
  EXPECT_NEAR(reach(grown, "c14_wall_south", 1), reach(*scene, "c14_wall_south", 1), 1e-12);
  EXPECT_THROW(env::WithOversizeTarget(*scene, -1.0), InputError);
}

TEST(Episode, StartOutOfReachEndsItWithAReason) {
  PlanningSetup far = *PlugSetup();
  far.model.task.world_T_target.translation() += Eigen::Vector3d(2.0, 0.0, 0.0);
  const EpisodeRecord record = Runner(std::make_shared<const PlanningSetup>(far), "ideal").Run(0);
  EXPECT_FALSE(record.inserted);
  EXPECT_NE(record.reason.find("transfer to the start pose"), std::string::npos) << record.reason;
}

}  // namespace
}  // namespace feeler::workflow
