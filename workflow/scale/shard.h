#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "feeler/planner/family/problem_family.h"
#include "feeler/policies/storage/database.h"

namespace feeler::workflow {

/// One of `count` parts of a job that run on their own, wherever a scheduler puts them.
struct Shard {
  int index = 1;  ///< from 1
  int count = 1;
  bool operator==(const Shard&) const = default;
};
inline constexpr int kMostShards = 1'000'000;

/// Reads an environment variable; null if it is not set.
using Environment = std::function<const char*(const char* name)>;

/// Parses "I/N", counted from 1, or takes it from the environment of the scheduler:
/// - "auto": Slurm arrays (SLURM_ARRAY_TASK_ID, _COUNT, _MIN, _STEP, whatever they count from), OpenMPI
///   (OMPI_COMM_WORLD_RANK, _SIZE);
/// - "auto/N" besides for those that do not tell how many there are: Kubernetes indexed jobs (JOB_COMPLETION_INDEX,
///   from 0), PBS (PBS_ARRAY_INDEX) and Torque (PBS_ARRAYID), from 1, or from FEELER_SHARD_FIRST. FEELER_SHARD_COUNT
///   stands in for N.
/// Throws InputError naming --shard or the variable.
Shard ParseShard(const std::string& text, const Environment& environment);
/// In the environment of this process.
Shard ParseShard(const std::string& text);

/// Relative CPU time that a problem of a family is expected to take.
double PredictedCost(const planner::Extents& extents);

/// The problems of the family that fall to a shard, in lexicographic order.
/// Laws: every problem falls to exactly one of the shards 1..count; the split depends on family and count alone; the
/// predicted costs of two shards differ by no more than the largest of a problem (longest first, each to the least
/// loaded).
std::vector<planner::Extents> ProblemsOfShard(const planner::ProblemFamily& family, const Shard& shard);

/// What a database of the shard says of itself.
policies::DatabaseShard DatabaseShardOf(const planner::ProblemFamily& family, const Shard& shard);

/// The numbers first..end-1 that fall to a shard: every count-th, as episodes are alike. Every number falls to one.
std::vector<std::int64_t> NumbersOfShard(std::int64_t first, std::int64_t end, const std::optional<Shard>& shard);

}  // namespace feeler::workflow
