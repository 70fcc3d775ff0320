// Families of problems as text. Laws: counts for the uncertain axes only and counts for x, y, z name the same problems;
// what is printed is read back; a union holds every problem of its parts once, in lexicographic order; anything else is
// an InputError that says how to write it.

#include "planner/preprocess/problem_family.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"

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
  const Task xz = TaskWith({AxisKind::kX, AxisKind::kZ, AxisKind::kYaw});
  EXPECT_EQ(ParseExtents("7x5", xz), (Extents{7, 1, 5}));
  const Task z = TaskWith({AxisKind::kZ});
  EXPECT_EQ(ParseExtents("9", z), (Extents{1, 1, 9}));
  EXPECT_EQ(ParseProblemFamily("2..4x3", xy).problems, ParseProblemFamily("2..4x3x1").problems);
  EXPECT_EQ(ParseProblemFamily("2..4x3", xz).problems, ParseProblemFamily("2..4x1x3").problems);
  for (const Task& task : {xy, xz, z}) {
    for (const Extents& extents : FamilyOf(task).problems) EXPECT_EQ(ParseExtents(ToString(extents), task), extents);
    EXPECT_EQ(ParseProblemFamily(FamilyOf(task).spec, task).problems, FamilyOf(task).problems);
  }
}

TEST(ProblemFamilyOfATask, RefusesOtherNumbersOfCounts) {
  const Task xy = TaskWith({AxisKind::kX, AxisKind::kY});
  const Task xyz = TaskWith({AxisKind::kX, AxisKind::kY, AxisKind::kZ});
  for (const char* bad : {"7", "7x7x7x7", "7x", "7x0", "7x99", ""}) {
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
