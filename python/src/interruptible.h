#pragma once

#include <nanobind/nanobind.h>

#include <chrono>
#include <exception>
#include <future>
#include <string>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"

/// How long work is done.
namespace feeler::python {

/// `count` threads. Throws InputError that names the argument `where` unless there are 1 to 1024.
inline Parallelism Threads(int count, const char* where = "jobs") {
  if (count < 1 || count > 1024) throw InputError(where, "are " + std::to_string(count), "give 1 to 1024");
  return Parallelism(count);
}

/// Runs `work` on a thread of its own, without the interpreter's lock, while this one listens for signals: what a
/// handler raises (Ctrl-C: KeyboardInterrupt) cancels, and is raised when the work has ended. Exceptions of `work` come
/// out here. Python hears signals in its main thread alone.
template <class Work>
auto RunInterruptibly(CancellationToken& token, Work&& work) {
  auto future = std::async(std::launch::async, std::forward<Work>(work));
  std::exception_ptr signal;
  const nanobind::gil_scoped_release released;
  while (future.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    if (signal) continue;
    const nanobind::gil_scoped_acquire acquired;
    if (PyErr_CheckSignals() == 0) continue;
    signal = std::make_exception_ptr(nanobind::python_error());
    token.Cancel();
  }
  if (signal) {
    try {
      future.get();
    } catch (...) {  // NOLINT: what the cancelled work says is of no interest
    }
    std::rethrow_exception(signal);
  }
  return future.get();
}

}  // namespace feeler::python
