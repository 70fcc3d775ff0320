#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>

#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/noise/noisy_policy.h"
#include "feeler/planner/noise/noisy_problem.h"

namespace feeler::workflow {

/// How policies for noisy readings are computed.
struct NoisyPolicyOptions {
  planner::Noise noise;  ///< of single steps; some must be above 0
  planner::Declaration declaration;
  /// A budget that gives the same policy everywhere. Below what a first policy needs (several hundred for 3 x 3 x 3)
  /// the policy gives up at once.
  std::int64_t expansion_limit = 200'000;
  double gap = 1.2;
};

/// The policies for noisy readings that episodes have met: each computed once, when it is first asked for, and shared
/// by all episodes and threads.
class NoisyPolicies {
 public:
  explicit NoisyPolicies(const NoisyPolicyOptions& options) : options_(options) {}

  /// Throws InputError without noise, for noise that makes no sense, and for targets of uncertain orientation.
  std::shared_ptr<const planner::NoisyPolicy> For(const planner::Problem& problem, const planner::Extents& extents);
  const NoisyPolicyOptions& options() const { return options_; }

 private:
  NoisyPolicyOptions options_;
  std::mutex mutex_;  // guards known_
  std::map<planner::Extents, std::shared_ptr<const planner::NoisyPolicy>> known_;
};

}  // namespace feeler::workflow
