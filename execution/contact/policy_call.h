#pragma once

#include <fmt/format.h>

#include <exception>

#include "feeler/core/clock.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/execution/contact/mover.h"

namespace feeler::execution {

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
