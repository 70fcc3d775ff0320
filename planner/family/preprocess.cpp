#include "feeler/planner/family/preprocess.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

#include "feeler/core/orientation_lattice.h"
#include "feeler/core/worker_pool.h"

namespace feeler::planner {
namespace {

/// How far ahead of the first open problem a thread looks for one whose experience is ready.
constexpr std::size_t kLookAhead = 256;
/// Budget of the certified solver for a problem where none is given.
constexpr std::int64_t kDefaultExpansionLimit = 20000;
constexpr std::int64_t kDefaultExpansionLimitOrientations = 60000;
constexpr std::int64_t kDefaultExpansionLimitSmallOrientations = 200000;
constexpr std::int64_t kDefaultExpansionLimitOpen = 500;

std::int64_t DefaultExpansionLimit(const FamilyTraits& family, std::size_t hypotheses) {
  if (family.openings) return kDefaultExpansionLimitOpen;
  if (!family.orientations) return kDefaultExpansionLimit;
  return hypotheses <= kSmallOrientedHypotheses ? kDefaultExpansionLimitSmallOrientations
                                                : kDefaultExpansionLimitOrientations;
}

class Framework {
 public:
  Framework(const Task& task, std::shared_ptr<const ContactMap> map, const ProblemFamily& family,
            const PreprocessOptions& options, PolicySink& sink)
      : task_(task),
        map_(std::move(map)),
        family_(family),
        options_(options),
        sink_(sink),
        traits_{.openings = options.openings, .orientations = LatticeOrientations(task) > 1},
        solver_(options.solver),
        order_(OrderOf(family, options.order, options.seed)),
        states_(order_.size()) {
    solver_.on_bounds = nullptr;
    solver_.cancellation = options.cancellation;
    Validate(solver_);
    needs_experience_ = solver_.solver == SolverKind::kERtdpBel && options.experience != ExperienceKind::kNone;
  }

  PreprocessSummary Run() {
    const auto begin = std::chrono::steady_clock::now();
    summary_.problems = static_cast<std::int64_t>(order_.size());
    if (!order_.empty()) {
      tables_ = options_.tables;
      if (!tables_)
        tables_ = BuildPlanningTables(MakeCuboidProblem(task_, map_, LargestExtents(family_)),
                                      WithFamilyBudget(solver_, traits_), options_.jobs);
      MarkStored();
      RunOnThreads(options_.jobs.threads(), [this] { Work(); });
    }
    summary_.cancelled = Cancelled();
    summary_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return summary_;
  }

 private:
  enum class Progress { kOpen, kRunning, kSolved, kFailed };
  struct State {
    Progress progress = Progress::kOpen;
    bool stored_before = false;  ///< by an earlier run; the policy is read when it is needed
    std::shared_ptr<const PolicyGraph> policy;
  };

  const Extents& At(std::size_t k) const { return family_.problems[order_[k]]; }
  bool Cancelled() const { return options_.cancellation != nullptr && options_.cancellation->cancelled(); }

  void MarkStored() {
    for (std::size_t k = 0; k < order_.size(); ++k) {
      if (!sink_.Done(At(k))) continue;
      states_[k].progress = Progress::kSolved;
      states_[k].stored_before = true;
      ++summary_.skipped;
      Advance();
    }
  }

  void Advance() {
    ++done_;
    if (options_.progress) options_.progress(done_, summary_.problems);
  }

  /// Algorithm 3, line 6: among the problems before k in the order that are not known to have failed, the one most
  /// similar in its uncertainty (least difference of extents; of equals the most hypotheses, then the last). The choice
  /// depends on the order alone, not on how far the threads are. k if there is none.
  std::size_t MostSimilar(std::size_t k) const {
    std::size_t best = k;
    std::tuple<int, int> best_key;
    for (std::size_t j = 0; j < k; ++j) {
      if (states_[j].progress == Progress::kFailed) continue;
      int difference = 0;
      for (int axis = 0; axis < kAxisKinds; ++axis) difference += std::abs(At(j)[axis] - At(k)[axis]);
      const std::tuple<int, int> key(difference, -At(j).Count());
      if (best == k || key <= best_key) {
        best = j;
        best_key = key;
      }
    }
    return best;
  }

  /// Waits for a problem that can be solved now: the first open one whose experience is ready. Returns false when there
  /// is nothing left to do.
  bool Take(std::unique_lock<std::mutex>& lock, std::size_t& taken, std::size_t& similar) {
    while (true) {
      if (Cancelled() || failed_) return false;
      while (first_open_ < order_.size() && states_[first_open_].progress != Progress::kOpen) ++first_open_;
      if (first_open_ == order_.size()) return false;
      const std::size_t end = std::min(order_.size(), first_open_ + kLookAhead);
      for (std::size_t k = first_open_; k < end; ++k) {
        if (states_[k].progress != Progress::kOpen) continue;
        similar = needs_experience_ ? MostSimilar(k) : k;
        if (similar != k && states_[similar].progress != Progress::kSolved) continue;
        if (similar != k && !states_[similar].policy) {
          std::optional<PolicyGraph> stored = sink_.Load(At(similar));
          if (!stored) {
            states_[similar].progress = Progress::kFailed;
            --k;
            continue;
          }
          states_[similar].policy = std::make_shared<const PolicyGraph>(std::move(*stored));
        }
        taken = k;
        states_[k].progress = Progress::kRunning;
        return true;
      }
      changed_.wait(lock);
    }
  }

  void Work() {
    std::unique_lock lock(mutex_);
    try {
      std::size_t k = 0;
      std::size_t similar = 0;
      while (Take(lock, k, similar)) {
        const std::shared_ptr<const PolicyGraph> policy = similar != k ? states_[similar].policy : nullptr;
        lock.unlock();
        const Problem problem = MakeCuboidProblem(task_, map_, At(k));
        std::optional<Problem> similar_problem;
        Experience experience;
        if (policy) {
          similar_problem = MakeCuboidProblem(task_, map_, At(similar));
          experience = {options_.experience, &*similar_problem, policy.get()};
        }
        SolverResult result =
            Solve(problem, WithFamilyBudget(solver_, traits_, problem.hypotheses.size()), tables_, experience);
        lock.lock();
        if (result.status == SolverStatus::kCancelled) break;
        sink_.Store(At(k), problem, result);
        summary_.cpu_s += result.cpu_s;
        ++(result.complete() ? summary_.complete : summary_.failed);
        states_[k].progress = result.complete() ? Progress::kSolved : Progress::kFailed;
        if (needs_experience_ && result.complete()) {
          states_[k].policy = std::make_shared<const PolicyGraph>(std::move(*result.policy));
        }
        Advance();
        changed_.notify_all();
      }
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      failed_ = true;
      changed_.notify_all();
      throw;
    }
    changed_.notify_all();
  }

  const Task& task_;
  std::shared_ptr<const ContactMap> map_;
  const ProblemFamily& family_;
  const PreprocessOptions& options_;
  PolicySink& sink_;
  FamilyTraits traits_;
  SolverOptions solver_;
  bool needs_experience_ = false;
  std::vector<std::size_t> order_;
  std::vector<State> states_;
  std::shared_ptr<const PlanningTables> tables_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t first_open_ = 0;
  std::int64_t done_ = 0;
  PreprocessSummary summary_;
  bool failed_ = false;  ///< a thread threw: nothing further is begun
};

}  // namespace

SolverOptions WithFamilyBudget(SolverOptions solver, const FamilyTraits& family, std::size_t hypotheses) {
  if (solver.solver == SolverKind::kCertified && std::isinf(solver.time_limit_s) && std::isinf(solver.cpu_limit_s) &&
      solver.expansion_limit == std::numeric_limits<std::int64_t>::max()) {
    solver.expansion_limit = DefaultExpansionLimit(family, hypotheses);
    solver.first_policy_in_any_case = true;
  }
  if (solver.solver == SolverKind::kCertified && solver.gap < kTightGap && solver.cuboids_where_tight &&
      solver.heuristic == HeuristicKind::kCertificate) {
    solver.heuristic = HeuristicKind::kCuboids;
  }
  return solver;
}

PreprocessSummary Preprocess(const Task& task, std::shared_ptr<const ContactMap> map, const ProblemFamily& family,
                             const PreprocessOptions& options, PolicySink& sink) {
  return Framework(task, std::move(map), family, options, sink).Run();
}

}  // namespace feeler::planner
