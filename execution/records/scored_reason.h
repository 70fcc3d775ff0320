#pragma once

#include <string>

#include "feeler/core/robot.h"
#include "feeler/execution/contact/execution_record.h"

namespace feeler::execution {

/// The reason of a record once the truth is known: "inserted", or why not. `verdict`: that of the judge.
inline std::string ScoredReason(bool inserted, const std::string& verdict, const ExecutionRecord& execution) {
  if (inserted) return "inserted";
  return execution.believed_inserted ? "believed inserted, but " + verdict : execution.reason;
}

/// The reason of a record whose way to the start pose did not end there.
inline std::string TransferFailure(const MotionResult& transfer) {
  return "transfer to the start pose: " + std::string(ToString(transfer.reason)) +
         (transfer.detail.empty() ? "" : ", " + transfer.detail);
}

}  // namespace feeler::execution
