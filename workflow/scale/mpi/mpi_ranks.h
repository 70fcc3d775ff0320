#pragma once

#include <memory>

#include "feeler/core/progress.h"
#include "feeler/workflow/scale/ranks.h"

namespace feeler::workflow {

/// The ranks of this job over MPI. Call once, from the main thread; destroy it there: rank 0 then lets the others go.
/// On ranks other than 0 a cancellation of rank 0 cancels `cancellation`.
std::unique_ptr<Ranks> ConnectMpiRanks(CancellationToken& cancellation);

}  // namespace feeler::workflow
