// Families of problems as text. Laws: counts for the axes of a task and counts for x, y, z (yaw, pitch) name the same
// problems; what is printed is read back; a union holds every problem of its parts once, in lexicographic order;
// anything else is an InputError that says how to write it.

#include "feeler/planner/family/problem_family.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/core/orientation_lattice.h"

namespace feeler::planner {
namespace {

Task TaskWith(std::vector<AxisKind> kinds) {
  Task task;
  task.name = "some";
  for (const AxisKind kind : kinds) task.axes.push_back({.kind = kind});
  return task;
}

TEST(ProblemFamilyOfATask, CountsOfTheUncertainAxesAreEnough) {
  const Task xy = TaskWith({AxisKind::kX, AxisKind::kY});
  EXPECT_EQ(ParseExtents("7x5", xy), (Extents{7, 5, 1}));
  EXPECT_EQ(ParseExtents("7x5x1", xy), (Extents{7, 5, 1}));
  const Task xz = TaskWith({AxisKind::kX, AxisKind::kZ});
  EXPECT_EQ(ParseExtents("7x5", xz), (Extents{7, 1, 5}));
  const Task pipe = TaskWith({AxisKind::kX, AxisKind::kY, AxisKind::kYaw, AxisKind::kPitch});
  EXPECT_EQ(ParseExtents("10x9x6x5", pipe), (Extents{10, 9, 1, 6, 5}));
  EXPECT_EQ(ParseExtents("10x9x1x6x5", pipe), (Extents{10, 9, 1, 6, 5}));
  EXPECT_EQ(ParseExtents("10x9x1", pipe), (Extents{10, 9, 1, 1, 1}));
  EXPECT_EQ(ToString(Extents{10, 9, 1, 6, 5}, pipe), "10x9x6x5");
  EXPECT_EQ(ToString(Extents{10, 9, 2, 6, 5}, pipe), "10x9x2x6x5");
  const Task pitch_first = TaskWith({AxisKind::kPitch, AxisKind::kY, AxisKind::kYaw});
  EXPECT_EQ(ParseExtents("2x3x4", pitch_first), (Extents{1, 3, 1, 4, 2}));
  EXPECT_EQ(ToString(Extents{1, 3, 1, 4, 2}, pitch_first), "2x3x4");
  const Task z = TaskWith({AxisKind::kZ});
  EXPECT_EQ(ParseExtents("9", z), (Extents{1, 1, 9}));
  EXPECT_EQ(ParseProblemFamily("2..4x3", xy).problems, ParseProblemFamily("2..4x3x1").problems);
  EXPECT_EQ(ParseProblemFamily("2..4x3", xz).problems, ParseProblemFamily("2..4x1x3").problems);
  for (Task task : {xy, xz, z, pipe, pitch_first}) {
    for (UncertainAxis& axis : task.axes) axis.max_cells = 5;
    for (const Extents& extents : FamilyOf(task).problems) {
      EXPECT_EQ(ParseExtents(ToString(extents, task), task), extents);
    }
    EXPECT_EQ(ParseProblemFamily(FamilyOf(task).spec, task).problems, FamilyOf(task).problems);
  }
}

TEST(ProblemFamilyOfATask, RefusesOtherNumbersOfCounts) {
  const Task xy = TaskWith({AxisKind::kX, AxisKind::kY});
  const Task xyz = TaskWith({AxisKind::kX, AxisKind::kY, AxisKind::kZ});
  for (const char* bad : {"7", "7x7x7x7", "7x", "7x0", "7x99", "", "7x7x7x7x7x7"}) {
    EXPECT_THROW(ParseExtents(bad, xy), InputError) << bad;
    EXPECT_THROW(ParseProblemFamily(bad, xy), InputError) << bad;
  }
  EXPECT_THROW(ParseExtents("7x7", xyz), InputError);
  EXPECT_THROW(ParseProblemFamily("7x7", xyz), InputError);
  try {
    ParseExtents("7", xy);
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("x, y"), std::string::npos) << error.what();
  }
}

// n of N angles are contiguous, as central as they can be, and one lattice serves even and odd n: the chosen angles
// lie around the estimate, which is within half a step of the lattice frame.
TEST(OrientationLattice, AnglesLieAroundTheEstimate) {
  Task task = TaskWith({AxisKind::kX, AxisKind::kPitch, AxisKind::kYaw});
  task.axes[1].resolution = task.axes[2].resolution = 0.05;
  task.axes[1].max_cells = 5;
  task.axes[2].max_cells = 6;
  ASSERT_EQ(LatticeOrientations(task), 30);
  ContactMap::Layer layer{{0}, {}};
  for (auto& travel : layer.travel) travel.assign(1, ContactMap::kUnlimited);
  const auto map = std::make_shared<const ContactMap>(
      CellBox{Cell::Zero(), Cell::Zero()}, std::vector<ContactMap::Layer>(30, layer), Eigen::Vector3d::Zero(), 0.5);
  for (int pitches = 1; pitches <= 5; ++pitches) {
    for (int yaws = 1; yaws <= 6; ++yaws) {
      const Eigen::Quaterniond frame_R_estimate = FrameREstimate(task, {2, pitches, yaws});
      EXPECT_LE(frame_R_estimate.angularDistance(Eigen::Quaterniond::Identity()), 0.025 * std::sqrt(2.0) + 1e-9);
      const Problem problem = MakeCuboidProblem(task, map, {2, 1, 1, yaws, pitches});
      ASSERT_EQ(problem.hypotheses.size(), static_cast<std::size_t>(2 * yaws * pitches));
      // Pitches and yaws relative to the estimate: pairs of equal and opposite angles, a step apart.
      std::vector<double> yaw_rad;
      std::vector<double> pitch_rad;
      for (const Hypothesis& h : problem.hypotheses) {
        const Eigen::Matrix3d r = LatticeOrientation(task, h.orientation).toRotationMatrix();
        const Eigen::Matrix3d e = frame_R_estimate.toRotationMatrix();
        yaw_rad.push_back(std::atan2(r(1, 0), r(0, 0)) - std::atan2(e(1, 0), e(0, 0)));
        pitch_rad.push_back(std::asin(-r(2, 0)) - std::asin(-e(2, 0)));
      }
      for (const auto& [angles, count] : {std::pair{yaw_rad, yaws}, std::pair{pitch_rad, pitches}}) {
        const auto [low, high] = std::minmax_element(angles.begin(), angles.end());
        EXPECT_NEAR(*low, -*high, 1e-12);
        EXPECT_NEAR(*high - *low, 0.05 * (count - 1), 1e-12);
      }
    }
  }
  EXPECT_THROW(MakeCuboidProblem(task, map, {2, 1, 1, 7, 1}), InputError);
  task.axes[1].max_cells = 4;
  EXPECT_THROW(MakeCuboidProblem(task, map, {2, 1, 1, 2, 2}), InputError);
}

TEST(ProblemFamily, AUnionHoldsEveryProblemOnce) {
  const ProblemFamily a = ParseProblemFamily("2..4x2x2..3");
  const ProblemFamily b = ParseProblemFamily("3..5x2x3");
  const ProblemFamily both = UnionOf({b, a, a}, "both");
  EXPECT_EQ(both.spec, "both");
  EXPECT_TRUE(std::is_sorted(both.problems.begin(), both.problems.end()));
  EXPECT_EQ(std::adjacent_find(both.problems.begin(), both.problems.end()), both.problems.end());
  for (const ProblemFamily* part : {&a, &b}) {
    for (const Extents& extents : part->problems) {
      EXPECT_TRUE(std::binary_search(both.problems.begin(), both.problems.end(), extents)) << ToString(extents);
    }
  }
  EXPECT_EQ(both.problems.size(), 7U);
  EXPECT_TRUE(UnionOf({}, "").problems.empty());
}

}  // namespace
}  // namespace feeler::planner
