#pragma once

#include <string>

#include "feeler/core/progress.h"

namespace feeler::cli {

/// The person at the terminal. What is read is a line of standard input; its end is a no.
class Operator {
 public:
  explicit Operator(const CancellationToken* cancellation) : cancellation_(cancellation) {}

  /// Enter, "y", "yes", "go" or "start": true. Everything else, an end of the input or a signal: false.
  bool Agrees(const std::string& question);

 private:
  const CancellationToken* cancellation_;
};

}  // namespace feeler::cli
