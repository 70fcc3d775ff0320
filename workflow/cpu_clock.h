#pragma once

#include <ctime>

namespace feeler::workflow {

/// CPU seconds that the calling thread has used.
inline double ThreadCpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace feeler::workflow
