// Laws of what differs from episode to episode. Randomization: absent by default; draws fill their ranges and no more,
// keyed by seed and episode alone; a malformed range is an error that names the field; friction, mass and clearance
// arrive in the physics, and the next episode without them is the nominal one, bit for bit. Imperfect sensing: a
// payload error shows as its weight at rest and as inertia when moving, and none is seen without; elastic joints give
// way under contact where the encoders see nothing; a constant force offset is there until zeroed.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/scene/episode_variation.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

std::string RandomizedPlug(const std::string& fields) {
  std::string text = LoadTask("plug").xml;
  text.replace(text.find("</custom>"), 9, fields + "</custom>");
  return text;
}

TEST(Randomization, AbsentMeansNone) {
  const EpisodeVariation variation = DrawVariation(PlugScene()->randomization, 1, 2);
  EXPECT_EQ(variation.physics, PhysicsVariation{});
  EXPECT_EQ(variation.yaw_rad, 0.0);
  EXPECT_TRUE(variation.force_bias_n.isZero(0.0));
}

TEST(Randomization, DrawsFillTheRangesOfTheFile) {
  const TaskModel task = LoadTaskFromText(RandomizedPlug("<numeric name='feeler_random_friction' data='0.5 1.5'/>"
                                                         "<numeric name='feeler_random_yaw' data='-0.02 0.02'/>"
                                                         "<numeric name='feeler_random_force_bias' data='-3 3'/>"),
                                          "random.xml");
  const Scene scene = BuildScene(task);
  Range friction{9, -9}, yaw{9, -9}, bias{9, -9};
  const auto widen = [](Range& range, double value) {
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  };
  for (std::uint64_t episode = 0; episode < 500; ++episode) {
    const EpisodeVariation v = DrawVariation(scene.randomization, 7, episode);
    widen(friction, v.physics.contact_friction);
    widen(yaw, v.yaw_rad);
    widen(bias, v.force_bias_n.y());
    EXPECT_EQ(v.physics.tool_mass, 1.0);
  }
  EXPECT_GE(friction.low, 0.5);
  EXPECT_LE(friction.high, 1.5);
  EXPECT_LT(friction.low, 0.52);
  EXPECT_GT(friction.high, 1.48);
  EXPECT_GE(yaw.low, -0.02);
  EXPECT_GT(yaw.high, 0.019);
  EXPECT_LT(bias.low, -2.9);
  EXPECT_GT(bias.high, 2.9);
  EXPECT_EQ(DrawVariation(scene.randomization, 7, 3).yaw_rad, DrawVariation(scene.randomization, 7, 3).yaw_rad);
}

TEST(Randomization, MalformedRangesNameTheirField) {
  for (const char* field :
       {"<numeric name='feeler_random_friction' data='1.5 0.5'/>", "<numeric name='feeler_random_friction' data='1'/>",
        "<numeric name='feeler_random_tool_mass' data='-1 1'/>", "<numeric name='feeler_random_colour' data='0 1'/>"}) {
    try {
      LoadTaskFromText(RandomizedPlug(field), "random.xml");
      ADD_FAILURE() << field;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("feeler_random_"), std::string::npos) << error.what();
    }
  }
}

TEST(Randomization, ArrivesInThePhysicsAndLeavesAgain) {
  const Scene& scene = *PlugScene();
  PhysicsVariation variation;
  variation.contact_friction = 0.5;
  variation.tool_mass = 2.0;
  variation.clearance_m = 0.0002;
  const auto varied = VariedModel(scene, variation);
  const mjModel& a = *scene.model;
  const mjModel& b = *varied;
  EXPECT_DOUBLE_EQ(b.body_mass[scene.tool_body], 2.0 * a.body_mass[scene.tool_body]);
  EXPECT_DOUBLE_EQ(b.geom_friction[3 * scene.target_geoms[0]], 0.5 * a.geom_friction[3 * scene.target_geoms[0]]);
  // The widest section loses the clearance on every side: the lowest and highest points of the collision geometry.
  const auto half_width = [&](const mjModel& m, int axis) {
    double half = 0.0;
    for (const int geom : scene.tool_geoms) {
      if (m.geom_type[geom] == mjGEOM_BOX) {
        half = std::max(half, std::abs(m.geom_pos[3 * geom + axis]) + m.geom_size[3 * geom + axis]);
      }
    }
    return half;
  };
  EXPECT_NEAR(half_width(a, 0) - half_width(b, 0), 0.0002, 1e-9);
  EXPECT_NEAR(half_width(a, 1) - half_width(b, 1), 0.0002, 1e-9);
  variation.clearance_m = 0.02;
  EXPECT_THROW(VariedModel(scene, variation), InputError);
  variation = {};
  variation.tool_mass = std::nan("");
  EXPECT_THROW(VariedModel(scene, variation), InputError);

  World used(PlugScene());
  const JointVector start = At(scene, ToolAt(scene, {0.02, 0.02, 0.002}));
  used.Reset(start, scene.task.world_T_target, {.contact_friction = 0.3, .tool_mass = 3.0});
  for (int i = 0; i < 50; ++i) used.Step(used.BiasTorque());
  used.Reset(start, scene.task.world_T_target);
  World fresh(PlugScene());
  fresh.Reset(start, scene.task.world_T_target);
  for (int i = 0; i < 50; ++i) {
    used.Step(JointVector::Zero());
    fresh.Step(JointVector::Zero());
    ASSERT_EQ(used.q_rad(), fresh.q_rad());
  }
}

TEST(ImperfectSensing, APayloadErrorShowsAsWeightAndInertia) {
  const Scene& scene = *PlugScene();
  SimulatedRobot robot(PlugScene());
  NoiseOptions noise;
  noise.payload_error_kg = 0.5;
  const JointVector start = At(scene, ToolAt(scene, {0, 0, 0.05}));
  const auto swing = [&](const NoiseOptions& with) {
    robot.Reset(start, scene.task.world_T_target, with, RandomStream(1, 0, "sensor"));
    robot.Servo(Vector6::Zero(), 20);
    const double weight_n = robot.sensor().raw().force_n.z();
    Vector6 sideways = Vector6::Zero();
    sideways.x() = 5e-4;
    double peak_n = 0.0;  // as read, while the tool speeds up
    for (int i = 0; i < 60; ++i) {
      robot.Servo(sideways, 1);
      peak_n = std::max(peak_n, robot.sensor().raw().force_n.norm());
    }
    return std::pair(weight_n, peak_n);
  };
  const auto [no_weight, no_peak] = swing({});
  EXPECT_NEAR(no_weight, 0.0, 1e-9);
  EXPECT_NEAR(no_peak, 0.0, 1e-9);
  const auto [weight, peak] = swing(noise);
  EXPECT_NEAR(weight, -0.5 * 9.81, 0.2);
  EXPECT_GT(peak, 0.5 * 9.81 + 0.005);
}

TEST(ImperfectSensing, ElasticJointsGiveWayUnseen) {
  const Scene& scene = *PlugScene();
  const auto gap = [&](double stiffness) {
    SimulatedRobot robot(PlugScene());
    NoiseOptions noise;
    noise.joint_stiffness_nm_rad = stiffness;
    robot.Reset(At(scene, ToolAt(scene, {0.02, 0.02, 0.005})), scene.task.world_T_target, noise,
                RandomStream(1, 0, "sensor"));
    CompliantMotion press;  // onto the housing, with some 40 N
    press.world_T_tool = {ToolAt(scene, {0.02, 0.02, -0.01})};
    press.force_limit_n = 100.0;
    const MotionResult result = robot.Compliant(press);
    EXPECT_TRUE(result.contact) << ToString(result.reason);
    return (robot.ToolPose().translation() - robot.world().ToolPose().translation()).norm();
  };
  EXPECT_LT(gap(0.0), 1e-9);
  const double stiff = gap(1e5);
  const double soft = gap(2.5e4);
  EXPECT_GT(stiff, 5e-5);
  EXPECT_GT(soft, 2.5 * stiff);
  EXPECT_LT(soft, 5e-3);
}

TEST(ImperfectSensing, OptionsThatMakeNoSenseAreRefused) {
  NoiseOptions noise;
  noise.joint_stiffness_nm_rad = 10.0;
  EXPECT_THROW(noise.Validate(), InputError);
  noise = {};
  noise.payload_error_kg = std::nan("");
  EXPECT_THROW(noise.Validate(), InputError);
  noise = {};
  noise.encoder_jitter_rad = -1.0;
  EXPECT_THROW(noise.Validate(), InputError);
  noise = {};
  noise.force_offset_n.x() = std::nan("");
  EXPECT_THROW(noise.Validate(), InputError);
}

TEST(ResetOptions, TheTruthIsOneOfTheHypothesesGiven) {
  InsertionEnv env(PlugScene());
  ResetOptions options;
  for (int i = 0; i < 4; ++i) {
    Pose pose = PlugScene()->task.world_T_target;
    pose.translation().x() += 0.002 * i;
    options.hypotheses.push_back(pose);
  }
  std::set<long> seen;
  for (options.episode = 0; options.episode < 40; ++options.episode) {
    const StepResult first = env.Reset(1, options);
    const double x = first.info.world_T_target->translation().x() - PlugScene()->task.world_T_target.translation().x();
    EXPECT_NEAR(std::remainder(x, 0.002), 0.0, 1e-12);
    seen.insert(std::lround(x / 0.002));
  }
  EXPECT_EQ(seen, (std::set<long>{0, 1, 2, 3}));
}

TEST(ResetOptions, PicturesShowTheWorldAsItIs) {
  EnvOptions options;
  options.renderer.width = 160;
  options.renderer.height = 120;
  options.renderer.samples = 0;
  options.renderer.shadows = false;
  InsertionEnv env(PlugScene(), options);
  env.Reset(1);
  const Image before = env.Render();
  EXPECT_EQ(before.width, 160);
  EXPECT_EQ(env.Render().rgb, before.rgb);
  GuardedMoveAction up;
  up.motion.direction = Eigen::Vector3d::UnitZ();
  up.motion.distance_m = 0.1;
  env.Step(up);
  EXPECT_NE(env.Render().rgb, before.rgb);
  EXPECT_EQ(env.RenderDepth(CloseUpCamera(*PlugScene())).depth_m.size(), 160u * 120u);
}

}  // namespace
}  // namespace feeler::env
