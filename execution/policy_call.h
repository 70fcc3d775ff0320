#pragma once

#include <fmt/format.h>
#include <time.h>

#include <exception>

#include "execution/execution_record.h"
#include "execution/mover.h"

namespace feeler::execution {

/// CPU time of the calling thread, s.
inline double ThreadCpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Calls a policy in the middle of an episode: what it takes is counted in `policy_cpu_s`, what it throws is a failure
/// of the episode (ExecutionFailure).
template <class Call>
auto CallPolicy(ExecutionRecord& record, const Call& call) {
  struct Counted {
    ~Counted() { record.policy_cpu_s += ThreadCpuSeconds() - before; }
    ExecutionRecord& record;
    double before = ThreadCpuSeconds();
  };
  const Counted counted{record};
  try {
    return call();
  } catch (const std::exception& error) {
    throw ExecutionFailure(fmt::format("policy threw: {}", error.what()));
  } catch (...) {
    throw ExecutionFailure("policy threw: no standard exception");
  }
}

}  // namespace feeler::execution
