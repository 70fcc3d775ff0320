#include "feeler/cli/common/session.h"

#include <cmath>

#include "feeler/cli/common/console.h"
#include "feeler/core/interrupted.h"

namespace feeler::cli {

void PrintJson(const nlohmann::json& value) {
  PrintResult(value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

nlohmann::json NumberOrNull(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

ProgressCallback Interruptible(ProgressBar& bar, const Session& session) {
  return [&bar, cancellation = session.cancellation](std::int64_t done, std::int64_t total) {
    if (cancellation != nullptr && cancellation->cancelled()) throw Interrupted();
    bar.Update(done, total);
  };
}

}  // namespace feeler::cli
