// Law of tables of differences: exact. Every value that went in comes out, whatever the lanes' shares, those that stand
// for themselves (cut, or none) and those of lanes without a share included; rows that differ by a common share alone
// are stored once.
#include "feeler/planner/bounds/orientations/difference_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "feeler/core/random.h"

namespace feeler::planner {
namespace {

template <class T>
void ExpectExact(std::uint64_t seed) {
  RandomStream random(seed, sizeof(T), "difference rows");
  const std::size_t cells = 200;
  const std::vector<T> times = {0, 1, 1, 2, 3};
  std::vector<std::vector<T>> values(cells, std::vector<T>(times.size(), 0));
  for (std::vector<T>& row : values) {
    for (std::size_t lane = 1; lane < times.size(); ++lane) {
      const std::uint64_t kind = random.Index(20);
      row[lane] = kind == 0   ? std::numeric_limits<T>::max()
                  : kind == 1 ? DifferenceRows<T>::kAsIs
                              : static_cast<T>(random.Index(DifferenceRows<T>::kAsIs));
    }
  }
  const DifferenceRows<T> table(
      cells, times, [&](std::size_t cell, std::span<T> row) { std::ranges::copy(values[cell], row.begin()); });
  for (std::size_t lane = 0; lane < times.size(); ++lane) {
    const auto of_lane = table.Of(lane, times.size(), times[lane]);
    for (std::size_t cell = 0; cell < cells; ++cell) ASSERT_EQ(of_lane[cell], values[cell][lane]);
  }
}

TEST(DifferenceRows, AreExact) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    ExpectExact<std::uint8_t>(seed);
    ExpectExact<std::uint16_t>(seed);
  }
}

TEST(DifferenceRows, StoreRowsThatDifferByTheirShareOnce) {
  const std::vector<std::uint8_t> times = {0, 1, 2};
  const DifferenceRows<std::uint8_t> table(100, times, [](std::size_t cell, std::span<std::uint8_t> row) {
    row[0] = 0;
    row[1] = static_cast<std::uint8_t>(3 + cell);
    row[2] = static_cast<std::uint8_t>(7 + 2 * cell);
  });
  EXPECT_EQ(table.bytes(), 100 * sizeof(std::uint32_t) + 3);
}

}  // namespace
}  // namespace feeler::planner
