#include "feeler/workflow/scale/estimate.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <optional>
#include <system_error>

#include "feeler/core/error.h"
#include "feeler/core/interrupted.h"
#include "feeler/core/worker_pool.h"
#include "feeler/planner/family/family_solver.h"
#include "feeler/policies/storage/database_sink.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::workflow {
namespace {

double ProcessSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A folder of its own that goes with it.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    std::string name = (std::filesystem::temp_directory_path(error) / "feeler-estimate-XXXXXX").string();
    if (error || mkdtemp(name.data()) == nullptr)
      throw InputError(name, "cannot be created", "let TMPDIR name a folder");
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string File(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// Seconds to commit one of these results to a database.
double CommitSeconds(const PlanningSetup& setup, const planner::PreprocessOptions& options,
                     const std::vector<planner::Extents>& extents, const std::vector<planner::SolverResult>& results) {
  const ScratchFolder folder;
  policies::Database database = policies::Database::Create(folder.File("sample.db"), IdentityOf(setup, options));
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < results.size(); ++i) {
    database.Put(policies::ToStoredProblem(extents[i], options.solver, results[i]));
  }
  const double all_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return all_s / static_cast<double>(std::max<std::size_t>(1, results.size()));
}

/// Times of all places from those of the sampled ones (in increasing order): that of the nearest.
std::vector<double> FromNearest(std::size_t count, const std::vector<std::size_t>& places,
                                const std::vector<double>& seconds) {
  std::vector<double> all(count);
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    while (nearest + 1 < places.size() && places[nearest + 1] + places[nearest] <= 2 * i) ++nearest;
    all[i] = seconds[nearest];
  }
  return all;
}

/// What one half of the sample says of the sum over the other, relative.
double HalfError(const std::vector<double>& seconds, std::size_t half) {
  std::vector<std::size_t> places;
  std::vector<double> known;
  double truth = 0.0;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    if (i % 2 == half) {
      places.push_back(i);
      known.push_back(seconds[i]);
    } else {
      truth += seconds[i];
    }
  }
  if (known.empty() || truth <= 0.0) return 0.0;
  const std::vector<double> all = FromNearest(seconds.size(), places, known);
  double predicted = 0.0;
  for (std::size_t i = 0; i < seconds.size(); ++i) predicted += i % 2 == half ? 0.0 : all[i];
  return std::abs(predicted - truth) / truth;
}

}  // namespace

FamilyEstimate EstimateFamily(const PlanningSetup& setup, const planner::ProblemFamily& family,
                              const planner::PreprocessOptions& given, std::int64_t sample) {
  planner::PreprocessOptions options = given;
  options.openings = setup.opening == env::Opening::kOpen;
  FamilyEstimate estimate;
  const std::size_t count = family.problems.size();
  estimate.problems = static_cast<std::int64_t>(count);
  if (count == 0) return estimate;
  std::vector<planner::Extents> order = family.problems;
  std::ranges::stable_sort(order, std::ranges::greater(), [](const planner::Extents& e) { return e.Count(); });

  const std::size_t taken = std::clamp<std::size_t>(static_cast<std::size_t>(sample), 1, count);
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < taken; ++i) places.push_back(taken == 1 ? 0 : i * (count - 1) / (taken - 1));
  std::vector<planner::Extents> extents;
  for (const std::size_t place : places) extents.push_back(order[place]);

  const double before_s = ProcessSeconds();
  const planner::FamilySolver solver(setup.task(), setup.map, family, options);
  estimate.tables_s = ProcessSeconds() - before_s;
  std::vector<planner::SolverResult> results(taken);
  const bool all = ParallelFor(
      taken, options.jobs, [&](std::size_t i) { results[i] = solver.Solve(extents[i], std::nullopt); },
      options.progress, options.cancellation);
  if (!all || (options.cancellation != nullptr && options.cancellation->cancelled())) throw Interrupted();

  std::vector<double> seconds;
  for (const planner::SolverResult& result : results) {
    seconds.push_back(result.cpu_s);
    estimate.sample_cpu_s += result.cpu_s;
  }
  estimate.sampled = static_cast<std::int64_t>(taken);
  estimate.piece_s = FromNearest(count, places, seconds);
  for (const double piece_s : estimate.piece_s) estimate.cpu_s += piece_s;
  estimate.cpu_error = taken == count ? 0.0 : std::max(HalfError(seconds, 0), HalfError(seconds, 1));
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  estimate.rank_bytes = static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
  estimate.commit_s = CommitSeconds(setup, options, extents, results);
  return estimate;
}

JobModel ModelOf(const FamilyEstimate& estimate) {
  constexpr double kMessage_s = 2e-3;  // two naps of a rank that waits (mpi_ranks.cpp)
  return {.piece_s = estimate.piece_s,
          .start_s = estimate.tables_s,
          .commit_s = estimate.commit_s,
          .message_s = kMessage_s};
}

}  // namespace feeler::workflow
