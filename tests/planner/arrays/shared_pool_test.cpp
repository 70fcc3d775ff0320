// Laws of a pool that processes of a host share:
//   - what any process keeps every process finds, whole and under its key alone, however many write at once;
//   - what there is no room for is not kept and harms nothing;
//   - the last process removes the file; what killed ones leave is begun anew; where no file can be made there is none;
//   - tables of pairs from a pool are those made alone.
#include "feeler/planner/arrays/shared_pool.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "feeler/planner/bounds/orientations/oriented_pairs.h"
#include "tests/planner/synthetic_pipe.h"

namespace feeler::planner {
namespace {

namespace fs = std::filesystem;

class SharedPoolTest : public ::testing::Test {
 protected:
  SharedPoolTest() {
    std::string name = (fs::temp_directory_path() / "feeler-pool-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    file_ = folder_ / "a.pool";
  }
  ~SharedPoolTest() override { fs::remove_all(folder_); }
  fs::path folder_;
  fs::path file_;
};

SharedPool::Key KeyOf(int i) { return {i, -i, 3 * i, i % 7, 1}; }

std::vector<std::uint8_t> BytesOf(int i) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(1 + (i * 37) % 5000));
  for (std::size_t k = 0; k < bytes.size(); ++k)
    bytes[k] = static_cast<std::uint8_t>(k * 31 + static_cast<std::size_t>(i));
  return bytes;
}

bool Holds(const SharedPool& pool, int i) { return std::ranges::equal(pool.Find(KeyOf(i)), BytesOf(i)); }

TEST_F(SharedPoolTest, WhatOneProcessKeepsAllFind) {
  constexpr int kProcesses = 4;
  constexpr int kArrays = 400;  // each kept by two processes at once
  const auto pool = SharedPool::Open(file_);
  ASSERT_NE(pool, nullptr);
  for (int process = 0; process < kProcesses; ++process) {
    if (fork() != 0) continue;
    const auto mine = SharedPool::Open(file_);
    bool good = mine != nullptr;
    for (int i = 0; good && i < kArrays; ++i) {
      if (i % kProcesses != process && (i + 1) % kProcesses != process) continue;
      good = std::ranges::equal(mine->Keep(KeyOf(i), BytesOf(i)), BytesOf(i)) && Holds(*mine, i);
    }
    _exit(good ? 0 : 1);
  }
  for (int process = 0; process < kProcesses; ++process) {
    int status = -1;
    wait(&status);
    EXPECT_EQ(status, 0);
  }
  for (int i = 0; i < kArrays; ++i) EXPECT_TRUE(Holds(*pool, i)) << i;
  EXPECT_TRUE(pool->Find(KeyOf(kArrays)).empty());
}

TEST_F(SharedPoolTest, FullPoolsKeepNoMore) {
  constexpr std::uint64_t kRoom = (std::uint64_t{1} << 22) + 10'000;  // of which the table takes 4 MB
  const auto pool = SharedPool::Open(file_, kRoom);
  ASSERT_NE(pool, nullptr);
  const std::vector<std::uint8_t> large(6'000, 7);
  EXPECT_FALSE(pool->Keep(KeyOf(1), large).empty());
  EXPECT_TRUE(pool->Keep(KeyOf(2), large).empty());
  EXPECT_TRUE(pool->Find(KeyOf(2)).empty());
  EXPECT_TRUE(std::ranges::equal(pool->Find(KeyOf(1)), large));
}

TEST_F(SharedPoolTest, TheLastRemovesTheFileAndKilledOnesLeaveNothing) {
  {
    const auto pool = SharedPool::Open(file_);
    const auto other = SharedPool::Open(file_);
    ASSERT_FALSE(pool->Keep(KeyOf(1), BytesOf(1)).empty());
    EXPECT_TRUE(Holds(*other, 1));
    EXPECT_TRUE(fs::exists(file_));
  }
  EXPECT_FALSE(fs::exists(file_));
  if (fork() == 0) {
    const auto pool = SharedPool::Open(file_);
    _exit(pool->Keep(KeyOf(1), BytesOf(1)).empty() ? 1 : 0);  // no destructor runs
  }
  int status = -1;
  wait(&status);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(fs::exists(file_));
  const auto pool = SharedPool::Open(file_);
  ASSERT_NE(pool, nullptr);
  EXPECT_TRUE(pool->Find(KeyOf(1)).empty());
  EXPECT_EQ(SharedPool::Open("/proc/no/such.pool"), nullptr);
}

TEST_F(SharedPoolTest, PairsFromAPoolAreThoseMadeAlone) {
  const auto map = testing::MakePipeMap(testing::MakePipeTask(3, 2), 0.5);
  const auto flags = std::make_shared<const StepFlagsGrid>(*map, Parallelism());
  StepCosts costs;
  costs.contact = 5.0;
  const OrientedPairs alone(flags, costs);
  const auto pool = SharedPool::Open(file_);
  const OrientedPairs first(flags, costs, pool);
  const OrientedPairs second(flags, costs, SharedPool::Open(file_));
  int pooled = 0;
  for (const Cell& offset : {Cell(1, 0, 0), Cell(-1, 2, 0)}) {
    for (const int other : {map->orientations() - 1}) {
      const auto expected = alone.Get(offset, 0, other);
      EXPECT_TRUE(std::ranges::equal(first.Get(offset, 0, other)->values, expected->values));
      EXPECT_TRUE(std::ranges::equal(second.Get(offset, 0, other)->values, expected->values));
      pooled += pool->Find({offset.x(), offset.y(), offset.z(), 0, other}).empty() ? 0 : 1;
    }
  }
  EXPECT_EQ(pooled, 2);
}

}  // namespace
}  // namespace feeler::planner
