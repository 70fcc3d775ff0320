// Laws of the table of looks on plug maps with an opening: the cost falls with the number of hypotheses that are gone,
// and ever more slowly; with one left nothing is to pay; a rectangle without a row costs no more than the rest of
// it; short tours cost what they do on paper; walking changes a cost by no more than the walk; threads change no value,
// and a cancellation is heeded. That the values are lower bounds is for open_bound_test.cpp.

#include "feeler/planner/bounds/openings/look_table.h"

#include <gtest/gtest.h>

#include <memory>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/contact/fill_dead_ends.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

struct Parts {
  std::shared_ptr<const ContactMap> open = testing::MakePlugMap(true, {4, 3, 3});
  std::shared_ptr<const ContactMap> filled = FillDeadEnds(*open);
  ContactMasks masks{*filled};
  Openings openings = FindOpenings(*open, *filled, 0);

  LookTable Table(const Cell& largest, int threads = 1, const StepCosts& costs = {1.0, 0.0}) const {
    return LookTable({*filled, masks, openings}, costs, Cell::Zero(), largest, Parallelism(threads));
  }
  /// The tool is inside the target of no member.
  bool Outside(const Cell& size, const Cell& displacement) const {
    bool outside = true;
    ForEachCell({Cell::Zero(), size - Cell::Ones()},
                [&](const Cell& h) { outside = outside && !filled->Blocked(displacement - h); });
    return outside;
  }
  /// Displacements of the least hypothesis about the target, and inside of it.
  static CellBox Around(const Cell& size) { return {Cell(-8, -7, -4), Cell(7, 6, 0) + size}; }
};

template <class Visit>
void ForEachEntry(const Cell& largest, const Visit& visit) {
  ForEachCell({Cell::Ones(), largest}, [&](const Cell& size) {
    ForEachCell(Parts::Around(size), [&](const Cell& displacement) { visit(size, displacement); });
  });
}

TEST(LookTable, FallsEverMoreSlowlyAsHypothesesGo) {
  const Parts parts;
  ASSERT_EQ(parts.openings.mouths.size(), 1U);
  const Cell largest(4, 3, 1);
  for (const StepCosts& costs : {StepCosts{1.0, 0.0}, StepCosts{1.3, 0.7}}) {
    const LookTable table = parts.Table(largest, 1, costs);
    int positive = 0;
    ForEachEntry(largest, [&](const Cell& size, const Cell& at) {
      const int count = size.x() * size.y();
      double before = 0.0;
      double fell = 0.0;
      for (int gone = 0; gone < count; ++gone) {
        const double cost = table.At(at, size, gone);
        if (gone > 0) {
          ASSERT_LE(cost, before + 1e-9);
        }
        // Values are rounded down to a unit of 1/64 of a step.
        if (gone > 1) {
          ASSERT_LE(before - cost, fell + 4.0 / 64.0 * costs.free);
        }
        fell = before - cost;
        before = cost;
        positive += cost > 0.0 ? 1 : 0;
      }
      ASSERT_EQ(before, 0.0) << "one is left";
    });
    EXPECT_GT(positive, 10000);
  }
}

TEST(LookTable, ARectangleWithoutARowCostsNoMoreThanTheRest) {
  const Parts parts;
  const LookTable table = parts.Table(Cell(4, 3, 1));
  int positive = 0;
  ForEachEntry(Cell(4, 3, 1), [&](const Cell& size, const Cell& at) {
    if (!parts.Outside(size, at)) return;
    for (int axis = 0; axis < 2; ++axis) {
      if (size[axis] == 1) continue;
      Cell rest = size;
      --rest[axis];
      const int row = size.prod() - rest.prod();
      const double cost = table.At(at, size, row);
      ASSERT_LE(cost, table.At(at, rest, 0) + 1.0 / 16.0);
      Cell from = at;
      --from[axis];
      ASSERT_LE(cost, table.At(from, rest, 0) + 1.0 / 16.0);
      positive += cost > 0.0 ? 1 : 0;
    }
  });
  EXPECT_GT(positive, 1000);
}

TEST(LookTable, KnowsShortTours) {
  const Parts parts;
  const LookTable table = parts.Table(Cell(4, 3, 1));
  const Cell above = parts.openings.mouths.front() + Cell(0, 0, 1);
  // Two beside each other, a cell above the mouth of one: down, and whoever is not there is known.
  EXPECT_DOUBLE_EQ(table.At(above, Cell(2, 1, 1), 0), 2.0);
  // Three in a row, the tool above the first: one step down for all, one along for two; the third is what is left.
  EXPECT_DOUBLE_EQ(table.At(above, Cell(3, 1, 1), 0), 3.0 + 2.0);
  // Without one of them that may be the first.
  EXPECT_DOUBLE_EQ(table.At(above, Cell(3, 1, 1), 1), 2.0);
}

TEST(LookTable, AStepChangesACostByNoMoreThanItself) {
  const Parts parts;
  const Cell largest(3, 3, 1);
  const LookTable table = parts.Table(largest);
  ForEachEntry(largest, [&](const Cell& size, const Cell& at) {
    for (const Direction d : kDirections) {
      bool free = parts.Outside(size, at);
      ForEachCell({Cell::Zero(), size - Cell::Ones()},
                  [&](const Cell& h) { free = free && parts.filled->StepFree(at - h, d); });
      if (!free) continue;
      const double unit = 1.0 / 16.0;
      ASSERT_LE(table.At(at, size, 0), table.At(at + UnitCell(d), size, 0) + size.x() * size.y() + unit);
    }
  });
}

TEST(LookTable, IsTheSameForAnyNumberOfThreads) {
  const Parts parts;
  const Cell largest(4, 3, 1);
  const LookTable one = parts.Table(largest, 1);
  const LookTable three = parts.Table(largest, 3);
  ForEachEntry(largest, [&](const Cell& size, const Cell& at) {
    for (int gone = 0; gone < size.x() * size.y(); ++gone) ASSERT_EQ(one.At(at, size, gone), three.At(at, size, gone));
  });
  EXPECT_GT(one.bytes(), 10000U);
}

TEST(LookTable, HeedsACancellation) {
  const Parts parts;
  CancellationToken token;
  std::int64_t last = 0;
  const ProgressCallback progress = [&](std::int64_t done, std::int64_t total) {
    EXPECT_LE(done, total);
    last = done;
    token.Cancel();
  };
  const LookTable table({*parts.filled, parts.masks, parts.openings}, {1.0, 0.0}, Cell::Zero(), Cell(9, 9, 1),
                        Parallelism(1), progress, &token);
  EXPECT_LT(last, 100) << "it went on to the end";
}

}  // namespace
}  // namespace feeler::planner
