// Laws of shards: every problem and every number falls to exactly one shard; the split depends on family and count
// alone; predicted costs differ by no more than that of a problem; schedulers' variables, whatever they count from,
// give I/N, and what is out of range or missing is refused.
#include "feeler/workflow/scale/shard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "feeler/core/error.h"

namespace feeler::workflow {
namespace {

class ShardSplit : public ::testing::TestWithParam<int> {};

TEST_P(ShardSplit, IsAPartitionOfEvenCost) {
  const int count = GetParam();
  const planner::ProblemFamily family = planner::ParseProblemFamily("2..9x3..8x1..7");
  std::set<planner::Extents> all;
  std::vector<double> loads;
  double largest = 0.0;
  for (const planner::Extents& extents : family.problems) largest = std::max(largest, PredictedCost(extents));
  for (int index = 1; index <= count; ++index) {
    const std::vector<planner::Extents> own = ProblemsOfShard(family, {index, count});
    EXPECT_TRUE(std::is_sorted(own.begin(), own.end()));
    EXPECT_EQ(DatabaseShardOf(family, {index, count}).problems, static_cast<std::int64_t>(own.size()));
    loads.push_back(0.0);
    for (const planner::Extents& extents : own) {
      EXPECT_TRUE(all.insert(extents).second) << planner::ToString(extents);
      loads.back() += PredictedCost(extents);
    }
  }
  EXPECT_EQ(all.size(), family.problems.size());
  EXPECT_LE(*std::ranges::max_element(loads) - *std::ranges::min_element(loads), largest);
}

TEST_P(ShardSplit, OfNumbersIsAPartition) {
  const int count = GetParam();
  std::multiset<std::int64_t> all;
  for (int index = 1; index <= count; ++index) {
    const auto own = NumbersOfShard(0, 100, Shard{index, count});
    all.insert(own.begin(), own.end());
  }
  const auto whole = NumbersOfShard(0, 100, std::nullopt);
  EXPECT_EQ(all, std::multiset<std::int64_t>(whole.begin(), whole.end()));
}

INSTANTIATE_TEST_SUITE_P(Counts, ShardSplit, ::testing::Values(1, 2, 3, 7, 64, 1000));

Shard Parse(const std::string& text, const std::map<std::string, std::string>& variables = {}) {
  return ParseShard(text, [&](const char* name) -> const char* {
    const auto it = variables.find(name);
    return it == variables.end() ? nullptr : it->second.c_str();
  });
}

TEST(ParseShard, TakesIOfN) {
  EXPECT_EQ(Parse("2/3"), (Shard{2, 3}));
  EXPECT_EQ(Parse("1/1"), (Shard{1, 1}));
  for (const char* bad :
       {"", "0/3", "4/3", "-1/3", "1/0", "1", "/3", "1/", "1/3x", " 1/3", "1.5/3", "2/9999999", "auto"}) {
    EXPECT_THROW(Parse(bad), InputError) << bad;
  }
}

TEST(ParseShard, TakesTheVariablesOfSchedulers) {
  const auto slurm = [](const char* id, const char* count, const char* least, const char* step) {
    return std::map<std::string, std::string>{{"SLURM_ARRAY_TASK_ID", id},
                                              {"SLURM_ARRAY_TASK_COUNT", count},
                                              {"SLURM_ARRAY_TASK_MIN", least},
                                              {"SLURM_ARRAY_TASK_STEP", step}};
  };
  EXPECT_EQ(Parse("auto", slurm("0", "4", "0", "1")), (Shard{1, 4}));
  EXPECT_EQ(Parse("auto", slurm("4", "4", "1", "1")), (Shard{4, 4}));
  EXPECT_EQ(Parse("auto", slurm("17", "3", "11", "3")), (Shard{3, 3}));
  EXPECT_THROW(Parse("auto", slurm("16", "3", "11", "3")), InputError);
  EXPECT_THROW(Parse("auto/5", slurm("0", "4", "0", "1")), InputError);
  EXPECT_THROW(Parse("auto", {{"SLURM_ARRAY_TASK_ID", "1"}}), InputError);
  EXPECT_THROW(Parse("auto", slurm("x", "4", "0", "1")), InputError);
  EXPECT_EQ(Parse("auto", {{"OMPI_COMM_WORLD_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "2"}}), (Shard{1, 2}));
  EXPECT_EQ(Parse("auto/8", {{"JOB_COMPLETION_INDEX", "7"}}), (Shard{8, 8}));
  EXPECT_EQ(Parse("auto", {{"JOB_COMPLETION_INDEX", "0"}, {"FEELER_SHARD_COUNT", "3"}}), (Shard{1, 3}));
  EXPECT_THROW(Parse("auto", {{"JOB_COMPLETION_INDEX", "0"}}), InputError);
  EXPECT_THROW(Parse("auto/8", {{"JOB_COMPLETION_INDEX", "8"}}), InputError);
  EXPECT_EQ(Parse("auto/8", {{"PBS_ARRAY_INDEX", "8"}}), (Shard{8, 8}));
  EXPECT_EQ(Parse("auto/8", {{"PBS_ARRAYID", "0"}, {"FEELER_SHARD_FIRST", "0"}}), (Shard{1, 8}));
  EXPECT_THROW(Parse("auto/8", {{"PBS_ARRAY_INDEX", "0"}}), InputError);
}

}  // namespace
}  // namespace feeler::workflow
