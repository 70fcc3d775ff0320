// Laws of what a contact costs in force with a wrist that gives way. The force told in proportion to speed leaves room
// for budgets from 6/5 of the threshold of contact on, so a share of it is the rise beyond that threshold: the
// threshold and this rise bound the greatest force of a probe, and by no more than half as much again. The speed of a
// budget keeps it, at walls and at edges that are barely met, and is higher than without a wrist. An episode inserts as
// ever, says in its record what held the tool, and pushes with less than a third of what the budget allows.
#include <gtest/gtest.h>

#include "feeler/core/random.h"
#include "feeler/execution/contact/force_budget.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/setup/policy_registry.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

struct Obstacle {
  Eigen::Vector3d start_m;
  Eigen::Vector3d direction;
};

const std::vector<Obstacle>& Obstacles() {
  static const std::vector<Obstacle> walls = {
      {{0.02, 0.02, 0.0087}, -Eigen::Vector3d::UnitZ()},    {{-0.03, 0.003, 0.0061}, -Eigen::Vector3d::UnitZ()},
      {{-0.0573, -0.017, -0.02}, Eigen::Vector3d::UnitX()}, {{0.0541, 0, -0.008}, -Eigen::Vector3d::UnitX()},
      {{0.01, 0.0457, -0.01}, -Eigen::Vector3d::UnitY()},
  };
  return walls;
}

/// The plug, its tool on springs.
struct Softly {
  explicit Softly(double stiffness_n_m) {
    SceneOptions options;
    options.wrist_stiffness_n_m = stiffness_n_m;
    scene = std::make_shared<const Scene>(BuildScene(LoadTask("plug"), options));
    robot = std::make_unique<SimulatedRobot>(scene);
  }
  void Place(const Eigen::Vector3d& displacement_m) {
    robot->Reset(At(*scene, ToolAt(*scene, displacement_m)), scene->task.world_T_target, NoisePreset("ideal"),
                 RandomStream(1, 0, "sensor"));
  }
  Eigen::Vector3d InWorld(const Eigen::Vector3d& direction) const {
    return scene->task.world_T_target.linear() * direction;
  }
  double PeakForce(const Obstacle& wall, double speed_m_s) {
    Place(wall.start_m);
    GuardedMotion motion;
    motion.direction = InWorld(wall.direction);
    motion.distance_m = 0.02;
    motion.speed_m_s = speed_m_s;
    return robot->Guarded(motion).peak_force_n;
  }

  std::shared_ptr<const Scene> scene;
  std::unique_ptr<SimulatedRobot> robot;
};

TEST(WristForce, TheThresholdAndTheRiseBoundIt) {
  RandomStream random(7, 0, "wrists");
  const double threshold_n = NoiseOptions{}.contact_threshold_n;
  for (int i = 0; i < 12; ++i) {
    Softly plug(random.Uniform(Wrist::kSoftest_n_m, 1.9e4));
    for (const Obstacle& wall : Obstacles()) {
      const double speed_m_s = random.Uniform(0.004, 0.05);  // of probes
      plug.Place(wall.start_m);
      const ContactResponse contact = plug.robot->Contact(plug.InWorld(wall.direction));
      const double rise_n = speed_m_s * execution::ForcePerSpeed(contact) / (6.0 * execution::kShareOfBudget);
      const double peak_n = plug.PeakForce(wall, speed_m_s);
      EXPECT_GT(peak_n, threshold_n);
      EXPECT_LE(peak_n, threshold_n + rise_n) << contact.stiffness_n_m << " N/m at " << speed_m_s;
      EXPECT_GE(1.5 * peak_n, threshold_n + rise_n) << contact.stiffness_n_m << " N/m at " << speed_m_s;
    }
  }
}

TEST(WristForce, TheSpeedOfABudgetKeepsIt) {
  SimulatedRobot rigid(PlugScene());
  for (const double stiffness_n_m : {2.3e3, 7.9e3, 1.87e4}) {
    Softly plug(stiffness_n_m);
    for (const double budget_n : {6.0, 10.0, 25.0}) {
      for (const Obstacle& wall : Obstacles()) {
        plug.Place(wall.start_m);
        const Eigen::Vector3d direction = plug.InWorld(wall.direction);
        const double speed_m_s = execution::SpeedWithinBudget(plug.robot->Contact(direction), budget_n);
        EXPECT_GT(speed_m_s, execution::SpeedWithinBudget(rigid.Contact(direction), budget_n));
        EXPECT_LE(plug.PeakForce(wall, speed_m_s), budget_n) << stiffness_n_m << " N/m at " << speed_m_s;
      }
    }
  }
}

TEST(WristForce, AnEdgeThatIsBarelyMetKeepsTheBudget) {
  for (const double stiffness_n_m : {2.3e3, 1.87e4}) {
    Softly plug(stiffness_n_m);
    for (const double budget_n : {10.0, 25.0}) {
      for (const double overlap_m : {0.03e-3, 0.1e-3, 0.2e-3, 0.3e-3, 0.5e-3, 1e-3}) {
        const Obstacle rim{{0.0, -0.0345, -overlap_m}, Eigen::Vector3d::UnitY()};
        plug.Place(rim.start_m);
        const ContactResponse face = plug.robot->Contact(plug.InWorld(rim.direction));
        const ContactResponse beyond = plug.robot->Contact(plug.InWorld(Eigen::Vector3d::UnitZ()));
        const double speed_m_s =
            std::min(execution::SpeedOverEdge(face, beyond, budget_n), execution::SpeedWithinBudget(face, budget_n));
        EXPECT_LE(plug.PeakForce(rim, speed_m_s), budget_n) << overlap_m << " at " << speed_m_s;
      }
    }
  }
}

TEST(WristForce, WhereItReachesItsStopsFirstTheArmIsWhatComes) {
  Softly plug(2e3);  // 10 N at the stops
  NoiseOptions noise = NoisePreset("friction");
  plug.robot->Reset(plug.scene->home_q_rad, plug.scene->task.world_T_target, noise, RandomStream(1, 0, "sensor"));
  EXPECT_GT(plug.robot->Contact(Eigen::Vector3d::UnitZ()).held_mass_kg, 5.0);
}

TEST(WristEpisode, Inserts) {
  const auto setup = std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup("plug"));
  SceneOptions scene;
  scene.wrist_stiffness_n_m = 8e3;
  workflow::EpisodeOptions options;
  options.family = planner::ParseProblemFamily("5x5x5");
  workflow::EpisodeRunner runner(setup, workflow::BuildEpisodeScene(*setup, scene),
                                 workflow::MakePolicyFactory("online", nullptr), options);
  const workflow::EpisodeRecord record = runner.Run(3);
  EXPECT_TRUE(record.inserted) << record.reason;
  EXPECT_TRUE(record.localized);
  EXPECT_EQ(record.contact_parameters.at("wrist_stiffness_n_m"), 8e3);
  EXPECT_LT(record.peak_force_n, 8.0);
}

}  // namespace
}  // namespace feeler::env
