// Cuts of lines through configuration-space obstacles. Oracles:
//   sphere against sphere, capsule, box: closed forms;  any pair of shapes: the support function itself: the end points
//   of a cut satisfy n . p <= h(n) for every direction n (they are in the obstacle) and points beyond them violate it
//   for some n (found by descent), which MuJoCo's collision detection confirms.

#include "feeler/planner/contact/convex_obstacle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/core/random.h"
#include "feeler/env/model/geom_shapes.h"
#include "feeler/env/model/mujoco_handles.h"

namespace feeler::env {
namespace {

using planner::ConvexObstacle;
using planner::ConvexShape;

ConvexShape Shape(const mjModel& model, int geom, const Pose& pose) { return ConvexShape(PieceOf(model, geom, pose)); }

Eigen::Vector3d RandomVector(RandomStream& random, double size) {
  return {random.Uniform(-size, size), random.Uniform(-size, size), random.Uniform(-size, size)};
}
Eigen::Quaterniond RandomRotation(RandomStream& random) {
  return Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal()).normalized();
}

/// One geom of each convex type, in the order of kTypes, and a wedge as mesh.
const char* kGeoms = R"(
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  0.03 0 0  0 0.02 0  0 0 0.025  0.03 0 0.025"/></asset>
  <worldbody>
    <geom type="sphere" size="0.01"/>
    <geom type="capsule" size="0.006 0.012"/>
    <geom type="cylinder" size="0.011 0.007"/>
    <geom type="ellipsoid" size="0.008 0.013 0.005"/>
    <geom type="box" size="0.009 0.004 0.012"/>
    <geom type="mesh" mesh="wedge"/>
  </worldbody>
</mujoco>)";

TEST(ConvexObstacle, SphereAgainstSphereIsASphere) {
  const ModelHandle model = CompileMjcf(kGeoms, "geoms");
  RandomStream random(1, 0, "spheres");
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d tool = RandomVector(random, 0.05);
    const Eigen::Vector3d target = RandomVector(random, 0.05);
    const ConvexObstacle obstacle(Shape(*model, 0, MakePose(tool)), Shape(*model, 0, MakePose(target)));
    const Eigen::Vector3d center = target - tool;
    const int axis = i % 3;
    Eigen::Vector3d point = center + RandomVector(random, 0.024);
    Eigen::Vector3d off = point - center;
    off[axis] = 0;
    const auto cut = obstacle.CutBy(axis, point);
    const double half_squared = 0.02 * 0.02 - off.squaredNorm();
    if (std::abs(half_squared) < 1e-8) continue;
    ASSERT_EQ(cut.has_value(), half_squared > 0) << i;
    if (!cut) continue;
    EXPECT_NEAR(cut->low_m, center[axis] - std::sqrt(half_squared), 1e-7);
    EXPECT_NEAR(cut->high_m, center[axis] + std::sqrt(half_squared), 1e-7);
  }
}

TEST(ConvexObstacle, BoxAgainstSphereAlongAFaceNormalIsAnalytic) {
  const ModelHandle model = CompileMjcf(kGeoms, "geoms");
  const ConvexObstacle obstacle(Shape(*model, 0, Pose::Identity()), Shape(*model, 4, Pose::Identity()));
  // Over the face, over an edge, over a corner of the rounded box.
  const auto top = [&](double x, double y) { return obstacle.CutBy(2, {x, y, 0})->high_m; };
  EXPECT_NEAR(top(0.003, 0.001), 0.022, 1e-8);
  EXPECT_NEAR(top(0.012, 0.001), 0.012 + std::sqrt(1e-4 - 9e-6), 1e-7);
  EXPECT_NEAR(top(0.012, 0.010), 0.012 + std::sqrt(1e-4 - 9e-6 - 3.6e-5), 1e-7);
  EXPECT_FALSE(obstacle.CutBy(2, {0.0185, 0.0135, 0}).has_value());
}

TEST(ConvexObstacle, EndsOfCutsAreOnTheSurface) {
  const ModelHandle model = CompileMjcf(kGeoms, "geoms");
  const DataHandle data = MakeData(*model);
  RandomStream random(2, 0, "pairs");
  int cuts = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    int first = static_cast<int>(random.Index(6));
    int second = static_cast<int>(random.Index(6));
    if (model->geom_type[first] > model->geom_type[second]) std::swap(first, second);
    if (first == second) continue;
    const Pose tool = MakePose(RandomVector(random, 0.02), RandomRotation(random));
    const Pose target = MakePose(RandomVector(random, 0.02), RandomRotation(random));
    const ConvexShape tool_shape = Shape(*model, first, tool);
    const ConvexShape target_shape = Shape(*model, second, target);
    const ConvexObstacle obstacle(tool_shape, target_shape);
    const int axis = trial % 3;
    const Eigen::Vector3d point = target.translation() - tool.translation() + RandomVector(random, 0.025);

    // Is the displaced tool inside? By MuJoCo, with its distance; touching within 2 um counts neither way.
    const auto distance = [&](double t) {
      Eigen::Vector3d p = point;
      p[axis] = t;
      const auto place = [&](int geom, const Pose& pose, const Eigen::Vector3d& shift) {
        Eigen::Map<Eigen::Vector3d>(data->geom_xpos + 3 * geom) = pose.translation() + shift;
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->geom_xmat + 9 * geom) = pose.linear();
      };
      place(first, tool, p);
      place(second, target, Eigen::Vector3d::Zero());
      std::array<mjContact, mjMAXCONPAIR> contacts;
      const int count = mjCOLLISIONFUNC[model->geom_type[first]][model->geom_type[second]](
          model.get(), data.get(), contacts.data(), first, second, 0);
      double deepest = 0;
      for (int i = 0; i < count; ++i) deepest = std::min(deepest, contacts[static_cast<std::size_t>(i)].dist);
      return deepest;
    };
    const auto cut = obstacle.CutBy(axis, point);
    if (!cut) {
      for (int k = -20; k <= 20; ++k) EXPECT_GT(distance(point[axis] + k * 0.004), -3e-6) << trial;
      continue;
    }
    ++cuts;
    EXPECT_GT(distance(cut->low_m - 1e-5), -2e-6) << trial;
    EXPECT_GT(distance(cut->high_m + 1e-5), -2e-6) << trial;
    if (cut->high_m - cut->low_m < 1e-3) continue;
    if (cut->low_slope > 0.3) {
      EXPECT_LT(distance(cut->low_m + 1e-5), 0) << trial;
    }
    if (cut->high_slope > 0.3) {
      EXPECT_LT(distance(cut->high_m - 1e-5), 0) << trial;
    }
  }
  EXPECT_GT(cuts, 800);
}

}  // namespace
}  // namespace feeler::env
