#include "feeler/planner/family/preprocess.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <functional>
#include <limits>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

#include "feeler/core/worker_pool.h"
#include "feeler/planner/family/family_solver.h"

namespace feeler::planner {
namespace {

/// How far ahead of the first open problem a thread looks for one whose experience is ready.
constexpr std::size_t kLookAhead = 256;
/// Budget of the certified solver for a problem where none is given.
constexpr std::int64_t kDefaultExpansionLimit = 20000;
constexpr std::int64_t kDefaultExpansionLimitOrientations = 60000;
constexpr std::int64_t kDefaultExpansionLimitSmallOrientations = 200000;
constexpr std::int64_t kDefaultExpansionLimitPerAxis = 3000;

std::int64_t DefaultExpansionLimit(const FamilyTraits& family, std::size_t hypotheses) {
  if (!family.orientations) return family.cells_per_axis ? kDefaultExpansionLimitPerAxis : kDefaultExpansionLimit;
  return hypotheses <= kSmallOrientedHypotheses ? kDefaultExpansionLimitSmallOrientations
                                                : kDefaultExpansionLimitOrientations;
}

class Framework {
 public:
  Framework(const Task& task, std::shared_ptr<const ContactMap> map, const ProblemFamily& family,
            const PreprocessOptions& options, PolicySink& sink)
      : solver_(task, std::move(map), family, options),
        family_(family),
        options_(options),
        sink_(sink),
        order_(OrderOf(family, options.order, options.seed)),
        states_(order_.size()) {
    if (!solver_.needs_experience() && options.jobs.threads() + static_cast<int>(options.distant.size()) > 1) {
      std::ranges::stable_sort(order_, std::ranges::greater(),
                               [&](std::size_t i) { return family.problems[i].Count(); });
    }
  }

  PreprocessSummary Run() {
    MarkWanted();
    MarkStored();
    const std::size_t near = static_cast<std::size_t>(options_.jobs.threads());
    if (!order_.empty()) {
      std::atomic<std::size_t> next{0};
      RunOnThreads(static_cast<int>(near + options_.distant.size()), [&] {
        // The calling thread always runs, and works here; of the others those that can be had.
        const std::size_t worker = next++;
        if (worker >= near) return Work(options_.distant[worker - near]);
        Work([this](const Extents& extents, const std::optional<SimilarProblem>& similar) {
          return solver_.Solve(extents, similar);
        });
      });
    }
    summary_.cancelled = Cancelled();
    summary_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    return summary_;
  }

 private:
  enum class Progress { kOpen, kRunning, kSolved, kFailed };
  struct State {
    Progress progress = Progress::kOpen;
    bool wanted = true;          ///< to be handed over
    bool helps = false;          ///< to be solved for its policy, though not wanted
    bool stored_before = false;  ///< by an earlier run; the policy is read when it is needed
    std::shared_ptr<const PolicyGraph> policy;
    bool to_do() const { return progress == Progress::kOpen && (wanted || helps); }
  };

  const Extents& At(std::size_t k) const { return family_.problems[order_[k]]; }
  bool Cancelled() const { return options_.cancellation != nullptr && options_.cancellation->cancelled(); }

  void MarkWanted() {
    for (std::size_t k = 0; k < order_.size(); ++k) {
      states_[k].wanted = !options_.only || std::binary_search(options_.only->begin(), options_.only->end(), At(k));
      if (states_[k].wanted) ++summary_.problems;
    }
  }

  void MarkStored() {
    for (std::size_t k = 0; k < order_.size(); ++k) {
      if (!states_[k].wanted || !sink_.Done(At(k))) continue;
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

  /// True if the policy that k is solved with is there, or none is needed. One that nobody is to hand over is put on
  /// the list.
  bool IsReady(std::size_t k, std::size_t& similar) {
    while (true) {
      similar = solver_.needs_experience() ? MostSimilar(k) : k;
      if (similar == k) return true;
      State& state = states_[similar];
      if (state.progress == Progress::kOpen && !state.to_do()) {
        state.helps = true;
        first_open_ = std::min(first_open_, similar);
      }
      if (state.progress != Progress::kSolved) return false;
      if (state.policy) return true;
      std::optional<PolicyGraph> stored = sink_.Load(At(similar));
      if (stored) {
        state.policy = std::make_shared<const PolicyGraph>(std::move(*stored));
        return true;
      }
      state.progress = Progress::kFailed;
    }
  }

  /// Waits for a problem that can be solved now: the first open one whose experience is ready. Returns false when there
  /// is nothing left to do.
  bool Take(std::unique_lock<std::mutex>& lock, std::size_t& taken, std::size_t& similar) {
    while (true) {
      if (Cancelled() || failed_) return false;
      while (first_open_ < order_.size() && !states_[first_open_].to_do()) ++first_open_;
      if (first_open_ == order_.size()) return false;
      const std::size_t begin = first_open_;
      std::size_t seen = 0;
      for (std::size_t k = begin; k < order_.size() && seen < kLookAhead; ++k) {
        if (!states_[k].to_do()) continue;
        ++seen;
        if (!IsReady(k, similar)) continue;
        taken = k;
        states_[k].progress = Progress::kRunning;
        return true;
      }
      if (first_open_ < begin) continue;                        // helpers were put on the list
      changed_.wait_for(lock, std::chrono::milliseconds(200));  // a cancellation notifies nobody
    }
  }

  void Finish(std::size_t k, SolverResult result) {
    if (states_[k].wanted) {
      sink_.Store(At(k), solver_.ProblemOf(At(k)), result);
      ++(result.complete() ? summary_.complete : summary_.failed);
      Advance();
    } else {
      ++summary_.helpers;
    }
    summary_.cpu_s += result.cpu_s;
    states_[k].progress = result.complete() ? Progress::kSolved : Progress::kFailed;
    if (solver_.needs_experience() && result.complete()) {
      states_[k].policy = std::make_shared<const PolicyGraph>(std::move(*result.policy));
    }
    changed_.notify_all();
  }

  void Work(const DistantSolver& solve) {
    std::unique_lock lock(mutex_);
    try {
      std::size_t k = 0;
      std::size_t similar = 0;
      while (Take(lock, k, similar)) {
        std::optional<SimilarProblem> experience;
        if (similar != k) experience = SimilarProblem{At(similar), states_[similar].policy};
        lock.unlock();
        SolverResult result = solve(At(k), experience);
        lock.lock();
        if (result.status == SolverStatus::kCancelled) break;
        Finish(k, std::move(result));
      }
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      failed_ = true;
      changed_.notify_all();
      throw;
    }
    changed_.notify_all();
  }

  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();  // before the tables are built
  FamilySolver solver_;
  const ProblemFamily& family_;
  const PreprocessOptions& options_;
  PolicySink& sink_;
  std::vector<std::size_t> order_;
  std::vector<State> states_;

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
