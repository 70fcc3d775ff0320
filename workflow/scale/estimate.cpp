#include "feeler/workflow/scale/estimate.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <system_error>

#include "feeler/core/error.h"
#include "feeler/core/interrupted.h"
#include "feeler/core/worker_pool.h"
#include "feeler/planner/bounds/planning_tables.h"
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

/// Seconds to commit one of these problems to a database.
double CommitSeconds(const PlanningSetup& setup, const planner::PreprocessOptions& options,
                     const std::vector<policies::StoredProblem>& problems) {
  const ScratchFolder folder;
  policies::Database database = policies::Database::Create(folder.File("sample.db"), IdentityOf(setup, options));
  const auto begin = std::chrono::steady_clock::now();
  for (const policies::StoredProblem& problem : problems) database.Put(problem);
  const double all_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return all_s / static_cast<double>(std::max<std::size_t>(1, problems.size()));
}

/// The problems in the order in which ranks are given them.
std::vector<planner::Extents> LargestFirst(const planner::ProblemFamily& family) {
  std::vector<planner::Extents> order = family.problems;
  std::ranges::stable_sort(order, std::ranges::greater(), [](const planner::Extents& e) { return e.Count(); });
  return order;
}

/// `count` places of so many, the first and the last among them, evenly spaced.
std::vector<std::size_t> Spaced(std::size_t count, std::size_t all) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < count; ++i) places.push_back(count == 1 ? 0 : i * (all - 1) / (count - 1));
  return places;
}

/// Tables of the family; their time and what is shared of them.
planner::FamilySolver SolverOf(const PlanningSetup& setup, const planner::ProblemFamily& family,
                               const planner::PreprocessOptions& options, FamilyEstimate& estimate) {
  const double before_s = ProcessSeconds();
  planner::FamilySolver solver(setup.task(), setup.map, family, options);
  estimate.tables_s = ProcessSeconds() - before_s;
  estimate.shared_bytes = static_cast<std::int64_t>(setup.map->bytes() + solver.tables().bytes());
  return solver;
}

std::int64_t PeakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
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
                              const planner::PreprocessOptions& options, std::int64_t sample) {
  FamilyEstimate estimate;
  const std::size_t count = family.problems.size();
  estimate.problems = static_cast<std::int64_t>(count);
  if (count == 0) return estimate;
  const std::vector<planner::Extents> order = LargestFirst(family);
  const std::size_t taken = std::clamp<std::size_t>(static_cast<std::size_t>(sample), 1, count);
  const std::vector<std::size_t> places = Spaced(taken, count);
  std::vector<planner::Extents> extents;
  for (const std::size_t place : places) extents.push_back(order[place]);

  const planner::FamilySolver solver = SolverOf(setup, family, options, estimate);
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
  estimate.rank_bytes = PeakBytes();
  std::vector<policies::StoredProblem> stored;
  for (std::size_t i = 0; i < taken; ++i)
    stored.push_back(policies::ToStoredProblem(extents[i], options.solver, results[i]));
  estimate.commit_s = CommitSeconds(setup, options, stored);
  return estimate;
}

FamilyEstimate EstimateFromTimes(const PlanningSetup& setup, const planner::ProblemFamily& family,
                                 const planner::PreprocessOptions& options, policies::Database& measured) {
  FamilyEstimate estimate;
  const std::vector<planner::Extents> order = LargestFirst(family);
  estimate.problems = std::ssize(order);
  estimate.sampled = estimate.problems;
  if (order.empty()) return estimate;
  std::map<planner::Extents, double> times;
  for (const policies::StoredProblem& problem : measured.List()) times[problem.extents] = problem.cpu_s;
  for (const planner::Extents& extents : order) {
    const auto at = times.find(extents);
    if (at == times.end()) {
      throw InputError("--times", "holds no problem " + planner::ToString(extents, setup.task()),
                       "give a whole database of this family");
    }
    estimate.piece_s.push_back(at->second);
    estimate.cpu_s += at->second;
  }
  estimate.sample_cpu_s = estimate.cpu_s;
  constexpr std::size_t kCommits = 64;
  const planner::FamilySolver solver = SolverOf(setup, family, options, estimate);
  solver.Solve(order.front(), std::nullopt);  // for its memory
  estimate.rank_bytes = PeakBytes();
  std::vector<policies::StoredProblem> stored;
  for (const std::size_t place : Spaced(std::min(kCommits, order.size()), order.size())) {
    if (auto problem = measured.Get(order[place])) stored.push_back(*std::move(problem));
  }
  estimate.commit_s = CommitSeconds(setup, options, stored);
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
