#include "feeler/workflow/scale/shard.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <functional>
#include <queue>
#include <string_view>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/policies/storage/hash.h"

namespace feeler::workflow {
namespace {

constexpr const char* kHowTo = "give I/N with I from 1 to N, e.g. 2/8, or auto in a job of a scheduler";

std::optional<std::int64_t> Number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::int64_t> Variable(const Environment& environment, const char* name) {
  const char* text = environment(name);
  if (text == nullptr || *text == '\0') return std::nullopt;
  const std::optional<std::int64_t> value = Number(text);
  if (!value)
    throw InputError(name, fmt::format("\"{}\" is not a whole number", text), "leave --shard to the scheduler");
  return value;
}

Shard Checked(std::int64_t index, std::int64_t count, const std::string& where, const std::string& mend) {
  if (count < 1 || count > kMostShards) {
    throw InputError(where, fmt::format("{} shards are out of range 1..{}", count, kMostShards), mend);
  }
  if (index < 1 || index > count) {
    throw InputError(where, fmt::format("shard {} is out of range 1..{}", index, count), mend);
  }
  return {static_cast<int>(index), static_cast<int>(count)};
}

Shard FromScheduler(std::optional<std::int64_t> count, const Environment& environment) {
  const bool told = count.has_value();
  const auto require_told = [&](std::int64_t own, const char* name) {
    if (told && *count != own) {
      throw InputError("--shard", fmt::format("says {} shards, {} says {}", *count, name, own), "leave out the number");
    }
    return own;
  };
  if (const auto id = Variable(environment, "SLURM_ARRAY_TASK_ID")) {
    const auto tasks = Variable(environment, "SLURM_ARRAY_TASK_COUNT");
    if (!tasks && !told) {
      throw InputError("SLURM_ARRAY_TASK_COUNT", "is not set", "give --shard auto/N with N the number of array tasks");
    }
    const std::int64_t of = tasks ? require_told(*tasks, "SLURM_ARRAY_TASK_COUNT") : *count;
    const std::int64_t least = Variable(environment, "SLURM_ARRAY_TASK_MIN").value_or(0);
    const std::int64_t step = std::max<std::int64_t>(1, Variable(environment, "SLURM_ARRAY_TASK_STEP").value_or(1));
    if ((*id - least) % step != 0) {
      throw InputError("SLURM_ARRAY_TASK_ID", fmt::format("{} is not of the array {}:{}", *id, least, step),
                       "use an array of even steps, e.g. --array=1-8");
    }
    return Checked((*id - least) / step + 1, of, "SLURM_ARRAY_TASK_ID", "use an array of even steps, e.g. --array=1-8");
  }
  const auto rank = Variable(environment, "OMPI_COMM_WORLD_RANK");
  const auto size = Variable(environment, "OMPI_COMM_WORLD_SIZE");
  if (rank && size) {
    return Checked(*rank + 1, require_told(*size, "OMPI_COMM_WORLD_SIZE"), "OMPI_COMM_WORLD_RANK", kHowTo);
  }
  const auto first = Variable(environment, "FEELER_SHARD_FIRST");
  constexpr std::pair<const char*, int> kCounters[] = {
      {"JOB_COMPLETION_INDEX", 0}, {"PBS_ARRAY_INDEX", 1}, {"PBS_ARRAYID", 1}};
  for (const auto& [name, from] : kCounters) {
    const auto index = Variable(environment, name);
    if (!index) continue;
    if (!told) count = Variable(environment, "FEELER_SHARD_COUNT");
    if (!count) throw InputError("--shard", fmt::format("{} does not tell of how many", name), "give auto/N");
    return Checked(
        *index - first.value_or(from) + 1, *count, name,
        "count from 0 to N-1 on Kubernetes and from 1 to N on PBS, or let FEELER_SHARD_FIRST say from where");
  }
  throw InputError("--shard", "auto: no scheduler's variables in the environment",
                   "give I/N, or run it in a Slurm or PBS array, under mpirun, or in an indexed Kubernetes job");
}

/// What a problem costs beside its hypotheses, in hypotheses: on the plug 0.9 ms and 1.5 us for each were measured.
constexpr double kFixedCost = 600.0;

}  // namespace

Shard ParseShard(const std::string& text, const Environment& environment) {
  const std::size_t slash = text.find('/');
  const std::string_view whole(text);
  const std::string_view head = whole.substr(0, slash);
  std::optional<std::int64_t> count;
  if (slash != std::string::npos) {
    count = Number(whole.substr(slash + 1));
    if (!count) throw InputError("--shard", "\"" + text + "\" is not I/N", kHowTo);
    Checked(1, *count, "--shard", kHowTo);
  }
  if (head == "auto") return FromScheduler(count, environment);
  const std::optional<std::int64_t> index = Number(head);
  if (!index || !count) throw InputError("--shard", "\"" + text + "\" is not I/N", kHowTo);
  return Checked(*index, *count, "--shard", kHowTo);
}

Shard ParseShard(const std::string& text) {
  return ParseShard(text, [](const char* name) -> const char* { return std::getenv(name); });
}

double PredictedCost(const planner::Extents& extents) { return static_cast<double>(extents.Count()) + kFixedCost; }

std::vector<planner::Extents> ProblemsOfShard(const planner::ProblemFamily& family, const Shard& shard) {
  std::vector<planner::Extents> longest_first = family.problems;
  std::ranges::stable_sort(longest_first, std::ranges::greater(), PredictedCost);
  using Load = std::pair<double, int>;  // predicted cost so far, shard: of equals the first
  std::priority_queue<Load, std::vector<Load>, std::greater<>> loads;
  for (int index = 1; index <= shard.count; ++index) loads.emplace(0.0, index);
  std::vector<planner::Extents> own;
  for (const planner::Extents& extents : longest_first) {
    const auto [load, index] = loads.top();
    loads.pop();
    loads.emplace(load + PredictedCost(extents), index);
    if (index == shard.index) own.push_back(extents);
  }
  std::ranges::sort(own);
  return own;
}

policies::DatabaseShard DatabaseShardOf(const planner::ProblemFamily& family, const Shard& shard) {
  std::string list;
  for (const planner::Extents& extents : family.problems) list += planner::ToString(extents) + " ";
  return {.index = shard.index,
          .count = shard.count,
          .problems = static_cast<std::int64_t>(ProblemsOfShard(family, shard).size()),
          .family = static_cast<std::int64_t>(family.problems.size()),
          .digest = policies::HashText(list)};
}

std::vector<std::int64_t> NumbersOfShard(std::int64_t first, std::int64_t end, const std::optional<Shard>& shard) {
  std::vector<std::int64_t> numbers;
  for (std::int64_t number = first; number < end; ++number) {
    if (!shard || number % shard->count == shard->index - 1) numbers.push_back(number);
  }
  return numbers;
}

}  // namespace feeler::workflow
