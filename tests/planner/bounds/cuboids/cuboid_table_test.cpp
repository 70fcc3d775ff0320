// Tables of cuboids of hypotheses. Laws: boxes of a partition are disjoint, within the largest size, and their union is
// the set, for random sets and every order of axes. The bound of each cuboid is at most what an optimal policy costs,
// found by search to optimality with another bound, at places near and far; equal to it where contact tells cuboids
// into cuboids. Values do not depend on the number of threads, on mirror symmetry being used, or on how much larger
// the table is. Random dense beliefs (L-shapes, boxes with holes) with the values of value iteration are in
// heuristic_test.cpp.

#include "feeler/planner/bounds/cuboids/cuboid_table.h"

#include <gtest/gtest.h>

#include "feeler/core/random.h"
#include "feeler/planner/bounds/cuboids/box_partition.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/solve.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

TEST(BoxPartition, CutsAnySetIntoDisjointBoxes) {
  RandomStream random(5, 0, "box partition");
  for (int round = 0; round < 200; ++round) {
    std::vector<Bits256> layers(1 + random.Index(5));
    const double density = random.Uniform();
    for (Bits256& layer : layers) {
      for (int bit = 0; bit < 256; ++bit) {
        if (random.Uniform() < density) layer.Set(bit);
      }
    }
    const Cell largest(1 + static_cast<int>(random.Index(16)), 1 + static_cast<int>(random.Index(16)), 3);
    for (const AxisOrder& order : kAxisOrders) {
      std::vector<Bits256> rest = layers;
      std::vector<HypothesisBox> boxes;
      PartitionIntoBoxes(rest, order, largest, boxes);
      std::vector<Bits256> covered(layers.size());
      for (const HypothesisBox& box : boxes) {
        EXPECT_TRUE((box.size.array() <= largest.array()).all());
        for (int z = box.low.z(); z < box.low.z() + box.size.z(); ++z) {
          const Bits256 cells = Rectangle(box.low.x(), box.low.y(), box.size.x(), box.size.y());
          EXPECT_EQ(cells.Count(), box.size.x() * box.size.y());
          EXPECT_FALSE((covered[static_cast<std::size_t>(z)] & cells).Any());
          covered[static_cast<std::size_t>(z)] = covered[static_cast<std::size_t>(z)] | cells;
        }
      }
      EXPECT_EQ(covered, layers);
    }
  }
}

struct Plug {
  explicit Plug(const Cell& half, int cut = 0, bool open = false)
      : map(testing::MakePlugMap(open, half, cut)), masks(*map), certificates(*map, StepCosts{}, Cell::Zero()) {}
  CuboidTable Table(const Cell& largest, int threads = 1) const {
    return {*map, masks, certificates, StepCosts{}, Cell::Zero(), largest, Parallelism(threads)};
  }
  std::shared_ptr<const ContactMap> map;
  ContactMasks masks;
  CertificateTable certificates;
};

TEST(CuboidTable, IsBelowTheOptimum) {
  Task task = testing::MakePlugTask();
  SolverOptions options;
  options.gap = 1.0;
  RandomStream random(6, 0, "starts");
  double sum_of_ratios = 0.0;
  int count = 0;
  for (const int kind : {0, 1, 2}) {
    const Plug plug({5, 4, 3}, kind == 1 ? 2 : 0, kind == 2);
    const CuboidTable table = plug.Table({3, 2, 2});
    for (const Extents& extents : {Extents{2, 1, 1}, Extents{1, 1, 2}, Extents{3, 1, 1}, Extents{2, 2, 1},
                                   Extents{3, 2, 1}, Extents{2, 2, 2}, Extents{3, 2, 2}}) {
      if (kind == 2 && extents.Count() > 2) continue;
      for (int round = 0; round < (extents.Count() > 4 ? 1 : 2); ++round) {
        Problem problem = MakeCuboidProblem(task, plug.map, extents);
        problem.start += Cell(static_cast<int>(random.Index(10)) - 5, static_cast<int>(random.Index(8)) - 4,
                              static_cast<int>(random.Index(16)) - 10);
        const SolverResult result = Solve(problem, options);
        ASSERT_TRUE(result.complete());
        const double bound =
            table.At(problem.start, {extents.nx, extents.ny, extents.nz}, 0) * table.unit() / extents.Count();
        EXPECT_LE(bound, result.expected_cost + 1e-9) << ToString(extents) << " " << problem.start.transpose();
        if (kind == 0 && (extents.Count() <= 2 || extents.ny + extents.nz == 2)) {
          EXPECT_NEAR(bound, result.expected_cost, 1e-9) << ToString(extents) << " " << problem.start.transpose();
        }
        sum_of_ratios += bound / result.expected_cost;
        ++count;
      }
    }
  }
  EXPECT_GT(sum_of_ratios / count, 0.95);
}

TEST(CuboidTable, ThreadsMirrorsAndSizeMakeNoDifference) {
  const Plug plug({5, 4, 3});
  const CuboidTable one = plug.Table({4, 3, 2});
  const CuboidTable two = plug.Table({4, 3, 3}, 3);
  for (int x = -16; x <= 20; ++x) {
    for (int y = -14; y <= 17; ++y) {
      for (int z = -3; z <= 12; ++z) {
        for (const Cell& size : {Cell(4, 3, 2), Cell(3, 3, 1), Cell(1, 2, 2)}) {
          const Cell here(x, y, z);
          ASSERT_EQ(one.At(here, size, 0), two.At(here, size, 0));
          const Cell mirrored(size.x() - 1 - x, y, z);
          ASSERT_EQ(one.At(here, size, 0), one.At(mirrored, size, 0));
        }
      }
    }
  }
  EXPECT_LT(one.bytes(), two.bytes());
}

}  // namespace
}  // namespace feeler::planner
