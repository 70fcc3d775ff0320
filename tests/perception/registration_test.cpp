// Laws: registration recovers a known pose from noisy points, wherever the target stands (oracle: the pose that made
// the scene); a rigid motion of camera, scene and nominal orientation moves the result along; the order of points does
// not matter, bit for bit; points that are not finite do not either; other things beside the target and before it do
// not draw it away; nothing, too little, and something else than the target are "not found", with a reason. Nothing is
// found turned farther than is looked for. A match must explain what is seen: plates of any size, from anywhere,
// tilted, are refused, and the reason says what speaks against them; true matches show next to nothing of it. Thinning
// keeps both faces of a plate that is thinner than its cubes.
#include "feeler/perception/registration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "tests/perception/synthetic_target.h"

namespace feeler::perception {
namespace {

const Eigen::Vector3d kEye(1.4, -0.5, 1.2);
const Eigen::Matrix3d kUpright = Eigen::Matrix3d::Identity();

const TargetModel& Model() {
  static const TargetModel kModel(SyntheticSurface(0.003));
  return kModel;
}

Pose DrawPose(RandomStream& random) {
  const Eigen::Vector3d position(random.Uniform(0.3, 0.9), random.Uniform(-0.4, 0.4), random.Uniform(0.1, 0.5));
  return MakePose(position, random.Uniform(-15.0, 15.0) * std::numbers::pi / 180.0);
}

double Turn(const Pose& a, const Pose& b) { return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle(); }

TEST(Registration, RecoversAKnownPose) {
  RandomStream random(1, 0, "poses");
  for (std::uint64_t k = 0; k < 20; ++k) {
    const Pose truth = DrawPose(random);
    const Registration found = Register(SyntheticScene(truth, kEye, 0.002, k), Model(), kUpright, kEye);
    ASSERT_TRUE(found.found) << found.reason;
    EXPECT_LT((found.world_T_target.translation() - truth.translation()).norm(), 0.0015) << k;
    EXPECT_LT(Turn(found.world_T_target, truth), 0.007) << k;
    EXPECT_GT(found.fitness, 0.9);
    ASSERT_EQ(found.covariance.rows(), 4);
    for (int i = 0; i < 4; ++i) EXPECT_GT(found.covariance(i, i), 0.0);
  }
}

TEST(Registration, TwoAnglesAreRecoveredWhereTwoAreUncertain) {
  RegistrationOptions options;
  options.rotation_axes = {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY()};
  Pose truth = MakePose(Eigen::Vector3d(0.6, 0.1, 0.3), 0.12);
  truth.linear() = truth.linear() * Eigen::AngleAxisd(-0.08, Eigen::Vector3d::UnitY());
  const Registration found = Register(SyntheticScene(truth, kEye, 0.001, 3), Model(), kUpright, kEye, options);
  ASSERT_TRUE(found.found) << found.reason;
  EXPECT_LT((found.world_T_target.translation() - truth.translation()).norm(), 0.0015);
  EXPECT_LT(Turn(found.world_T_target, truth), 0.006);
  EXPECT_EQ(found.covariance.rows(), 5);
}

TEST(Registration, MovesAlongWithCameraAndScene) {
  RandomStream random(2, 0, "poses");
  for (std::uint64_t k = 0; k < 5; ++k) {
    const Pose truth = DrawPose(random);
    const Points scene = SyntheticScene(truth, kEye, 0.002, k);
    const Registration here = Register(scene, Model(), kUpright, kEye);
    Pose motion = MakePose(Eigen::Vector3d(-0.7, 0.4, 0.9), 1.0 + static_cast<double>(k));
    motion.linear() = motion.linear() * Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX());
    Points moved;
    for (const Eigen::Vector3d& p : scene) moved.push_back(motion * p);
    const Registration there = Register(moved, Model(), motion.linear() * kUpright, motion * kEye);
    ASSERT_TRUE(here.found && there.found);
    const Pose expected = motion * here.world_T_target;
    // The scene is thinned on another grid, so the noise averages differently.
    EXPECT_LT((there.world_T_target.translation() - expected.translation()).norm(), 0.001);
    EXPECT_LT(Turn(there.world_T_target, expected), 0.004);
  }
}

TEST(Registration, OrderAndBrokenPointsDoNotMatter) {
  const Pose truth = MakePose(Eigen::Vector3d(0.5, 0.2, 0.25), -0.2);
  const Points scene = SyntheticScene(truth, kEye, 0.002, 5);
  Points shuffled = scene;
  RandomStream random(5, 0, "shuffle");
  for (std::size_t i = shuffled.size(); i > 1; --i) std::swap(shuffled[i - 1], shuffled[random.Index(i)]);
  for (int i = 0; i < 50; ++i) {
    shuffled.insert(shuffled.begin() + 7 * i, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    shuffled.emplace_back(0.0, std::numeric_limits<double>::infinity(), 1e300);
  }
  EXPECT_EQ(Register(scene, Model(), kUpright, kEye).world_T_target.matrix(),
            Register(shuffled, Model(), kUpright, kEye).world_T_target.matrix());
}

TEST(Registration, ABarThatCutsItInTwoDoesNotDrawItAway) {
  RandomStream random(7, 0, "bars");
  for (std::uint64_t k = 0; k < 8; ++k) {
    const Pose truth = DrawPose(random);
    const double angle = random.Uniform(0.0, std::numbers::pi);
    const Eigen::Vector2d across(std::cos(angle), std::sin(angle));
    const double middle = random.Uniform(-0.04, 0.04);
    constexpr double kHalfWidth_m = 0.03;
    Points scene = SyntheticScene(truth, kEye, 0.002, k);
    std::erase_if(scene, [&](const Eigen::Vector3d& p) {
      const Eigen::Vector3d q = truth.inverse() * p;
      return std::abs(q.head<2>().dot(across) - middle) < kHalfWidth_m;
    });
    const Registration found = Register(scene, Model(), kUpright, kEye);
    ASSERT_TRUE(found.found) << k << ": " << found.reason;
    EXPECT_LT((found.world_T_target.translation() - truth.translation()).norm(), 0.004) << k;
    EXPECT_LT(Turn(found.world_T_target, truth), 0.02) << k;
  }
}

TEST(Registration, OtherThingsDoNotDrawItAway) {
  const Pose truth = MakePose(Eigen::Vector3d(0.5, 0.2, 0.25), 0.1);
  Points scene = SyntheticScene(truth, kEye, 0.002, 6);
  RandomStream random(6, 0, "clutter");
  for (int i = 0; i < 6000; ++i) {  // a denser thing: a post
    const double angle = random.Uniform(0.0, 2.0 * std::numbers::pi);
    scene.emplace_back(0.2 + 0.06 * std::cos(angle), -0.3 + 0.06 * std::sin(angle), random.Uniform(0.0, 0.8));
  }
  for (int i = 0; i < 300; ++i) {  // flying pixels
    scene.emplace_back(random.Uniform(0.2, 1.0), random.Uniform(-0.5, 0.5), random.Uniform(0.0, 0.8));
  }
  const Registration found = Register(scene, Model(), kUpright, kEye);
  ASSERT_TRUE(found.found) << found.reason;
  EXPECT_LT((found.world_T_target.translation() - truth.translation()).norm(), 0.003);
}

TEST(Registration, WhatIsNotThereIsNotFound) {
  const auto reason = [](const Points& scene) {
    const Registration result = Register(scene, Model(), kUpright, kEye);
    EXPECT_FALSE(result.found);
    return result.reason;
  };
  EXPECT_NE(reason({}), "");
  EXPECT_NE(reason({Eigen::Vector3d(0.5, 0, 0.2)}), "");
  EXPECT_NE(reason(Points(5000, Eigen::Vector3d(0.5, 0, 0.2))), "");
  Points post;
  RandomStream random(7, 0, "post");
  for (int i = 0; i < 4000; ++i) {
    const double angle = random.Uniform(0.0, 2.0 * std::numbers::pi);
    post.emplace_back(0.5 + 0.03 * std::cos(angle), 0.03 * std::sin(angle), random.Uniform(0.0, 0.3));
  }
  EXPECT_NE(reason(post), "");
}

/// What a camera sees of a rectangle with noise, level or tilted about y.
Points Plate(const Eigen::Vector3d& centre_m, double width_m, double depth_m, double sigma_m, std::uint64_t seed,
             double tilt_rad = 0.0) {
  Points points;
  RandomStream random(seed, 0, "plate");
  const auto noise = [&] { return sigma_m * random.Normal(); };
  const Eigen::AngleAxisd tilt(tilt_rad, Eigen::Vector3d::UnitY());
  constexpr double kSpacing_m = 0.004;
  for (double x = -width_m / 2; x <= width_m / 2; x += kSpacing_m) {
    for (double y = -depth_m / 2; y <= depth_m / 2; y += kSpacing_m) {
      points.emplace_back(centre_m + tilt * Eigen::Vector3d(x + noise(), y + noise(), noise()));
    }
  }
  return points;
}

TEST(Registration, APlateIsNotTheTarget) {
  // Larger than the target's own plate, as large, and much larger: in none of them is there a housing.
  const std::pair<double, double> sizes_m[] = {{0.8, 0.8}, {0.3, 0.24}, {0.32, 0.25}, {0.5, 0.4}, {1.5, 1.0}};
  const Eigen::Vector3d eyes_m[] = {kEye, {0.2, 0.9, 1.4}};
  for (const auto& [width_m, depth_m] : sizes_m) {
    for (const Eigen::Vector3d& eye_m : eyes_m) {
      for (const double tilt_rad : {0.0, 0.06}) {
        const Points plate = Plate({0.6, 0.0, 0.2}, width_m, depth_m, 0.001, 1, tilt_rad);
        const Registration result = Register(plate, Model(), kUpright, eye_m);
        EXPECT_FALSE(result.found) << width_m << " tilted " << tilt_rad << " from " << eye_m.transpose() << ": fitness "
                                   << result.fitness << " explained " << result.explained;
        EXPECT_NE(result.reason, "");
      }
    }
  }
}

TEST(Registration, WhatSpeaksAgainstIsNamed) {
  const Points own_size = Plate({0.6, 0.0, 0.2}, 0.3, 0.24, 0.001, 1);
  const Registration bare = Register(own_size, Model(), kUpright, kEye);
  EXPECT_GT(bare.fitness, 0.8) << "nearly all of the target is a plate";
  EXPECT_GT(bare.missing_m2, 0.5 * 0.08 * 0.05) << "the housing";
  EXPECT_NE(bare.reason.find("sees through"), std::string::npos) << bare.reason;
  const Pose truth = MakePose(Eigen::Vector3d(0.6, 0.1, 0.25), 0.1);
  const Registration match = Register(SyntheticScene(truth, kEye, 0.001, 6), Model(), kUpright, kEye);
  EXPECT_LT(match.beyond, 0.02);
  EXPECT_LT(match.seen_through, 0.005);
  EXPECT_LT(match.missing_m2, kMet_m * kMet_m);
}

TEST(Registration, TheBackgroundTellsWhereTheCameraSeesThrough) {
  // A quarter of the target's plate is not there; only what was measured behind says so.
  const Pose truth = MakePose(Eigen::Vector3d(0.6, 0.1, 0.25));
  Points scene;
  for (const Eigen::Vector3d& p : SyntheticScene(truth, kEye, 0.001, 6)) {
    if ((truth.inverse() * p).x() < 0.1) scene.push_back(p);
  }
  Points measured = scene;
  const Points floor = Plate({0.3, 0.3, -0.02}, 1.6, 1.6, 0.001, 3);
  measured.insert(measured.end(), floor.begin(), floor.end());
  const Registration cut_off = Register(scene, Model(), kUpright, kEye, {}, measured);
  EXPECT_FALSE(cut_off.found);
  EXPECT_GT(cut_off.seen_through, 0.1);
  const Registration hidden = Register(scene, Model(), kUpright, kEye);
  EXPECT_LT(hidden.seen_through, 0.02) << "what was not measured speaks against nothing";
  EXPECT_TRUE(hidden.found) << hidden.reason;
}

TEST(MatchLimits, LieBetweenMatchesAndNegatives) {
  MatchEvidence match{0.9, 1.0, 0.08, 0.001, 1e-5};
  const MatchEvidence plate{0.9, 0.4, 0.32, 0.09, 4e-4};
  const MatchEvidence alike{0.95, 1.0, 0.05, 0.0, 0.0};  // no camera tells it
  const MatchLimits limits = LimitsFrom({match, match}, {plate, alike});
  EXPECT_NEAR(limits.most_beyond, 0.16, 1e-9) << "the middle of 0.08 and 0.32";
  EXPECT_NEAR(limits.most_seen_through, 0.03, 1e-9) << "the middle of 0.01, which is noise, and 0.09";
  EXPECT_NEAR(limits.most_missing_m2, std::sqrt(kMet_m * kMet_m * 4e-4), 1e-9);
  EXPECT_TRUE(limits.Allow(match));
  EXPECT_FALSE(limits.Allow(plate));
  EXPECT_TRUE(limits.Allow(alike));
  // Nothing is known: the defaults; a match that shows more than they allow is still one.
  EXPECT_NEAR(LimitsFrom({}, {}).most_beyond, MatchLimits().most_beyond, 1e-12);
  match.beyond = 0.4;
  EXPECT_TRUE(LimitsFrom({match}, {plate}).Allow(match));
}

TEST(Registration, ThePlateBesideDoesNotHideTheTarget) {
  const Pose truth = MakePose(Eigen::Vector3d(0.5, 0.2, 0.25), 0.1);
  Points scene = SyntheticScene(truth, kEye, 0.001, 6);
  const Points plate = Plate({0.5, -0.6, 0.2}, 0.8, 0.6, 0.001, 2);
  scene.insert(scene.end(), plate.begin(), plate.end());
  const Registration found = Register(scene, Model(), kUpright, kEye);
  ASSERT_TRUE(found.found) << found.reason;
  EXPECT_LT((found.world_T_target.translation() - truth.translation()).norm(), 0.003);
}

TEST(Registration, NothingIsFoundTurnedTooFar) {
  RandomStream random(8, 0, "turned");
  constexpr double kMost_rad = 0.45;
  for (std::uint64_t k = 0; k < 6; ++k) {
    Pose truth = DrawPose(random);
    truth.linear() = Eigen::AngleAxisd(random.Uniform(0.6, 2.5), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Registration found = Register(SyntheticScene(truth, kEye, 0.002, k), Model(), kUpright, kEye);
    if (found.found) {
      EXPECT_LT(Eigen::AngleAxisd(found.world_T_target.linear()).angle(), kMost_rad) << k;
    }
  }
}

TEST(PointCloud, ThinningKeepsBothFacesOfAThinPlate) {
  constexpr double kThickness_m = 0.006;
  constexpr double kCube_m = 0.02;
  constexpr int kSide = 100;
  SurfacePoints plate;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      for (const double side : {-1.0, 1.0}) {
        plate.points.emplace_back(0.001 + 0.002 * i, 0.001 + 0.002 * j, 0.01 + side * kThickness_m / 2.0);
        plate.normals.emplace_back(0.0, 0.0, side);
      }
    }
  }
  const SurfacePoints thinned = Thinned(plate, kCube_m);
  const auto up = std::count_if(thinned.normals.begin(), thinned.normals.end(),
                                [](const Eigen::Vector3d& n) { return n.isApprox(Eigen::Vector3d::UnitZ()); });
  constexpr int kCubes = 100;  // 0.2 m square
  EXPECT_EQ(up, kCubes);
  ASSERT_EQ(thinned.points.size(), 2 * kCubes);
  for (std::size_t i = 0; i < thinned.points.size(); ++i) {
    EXPECT_NEAR(thinned.points[i].z(), 0.01 + thinned.normals[i].z() * kThickness_m / 2.0, 1e-12);
  }
}

TEST(Registration, NonsenseIsRefused) {
  RegistrationOptions options;
  options.rotation_axes = {Eigen::Vector3d(1, 1, 0)};
  EXPECT_THROW(Register({}, Model(), kUpright, kEye, options), InputError);
  EXPECT_THROW(TargetModel(SurfacePoints{}), InputError);
}

}  // namespace
}  // namespace feeler::perception
