#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "feeler/cli/common/progress_bar.h"
#include "feeler/core/progress.h"

namespace feeler::workflow {
class Ranks;
}

namespace feeler::cli {

/// What every subcommand shares: the Ctrl-C token and the exit code it leaves (0 done, 1 the answer is no).
struct Session {
  CancellationToken* cancellation = nullptr;
  int exit_code = 0;
  workflow::Ranks* ranks = nullptr;  ///< the processes of this job; null if it is alone (always for feeler-execute)

  /// True on ranks that work for rank 0, which alone holds the files. (cli/session.cpp)
  bool serves() const;
};

/// Prints a result for machines: one JSON document on stdout.
void PrintJson(const nlohmann::json& value);
/// The number, or null where it is not finite.
nlohmann::json NumberOrNull(double value);

/// Updates the bar, and ends the work with Interrupted where a signal has come: for work that leaves nothing to keep
/// when it is given up. The bar must outlive the callback.
ProgressCallback Interruptible(ProgressBar& bar, const Session& session);

}  // namespace feeler::cli
