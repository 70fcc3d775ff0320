#include "core/robot.h"

namespace feeler {

std::string_view ToString(StopReason reason) {
  switch (reason) {
    case StopReason::kReached: return "reached";
    case StopReason::kContact: return "contact";
    case StopReason::kForceLimit: return "force_limit";
    case StopReason::kTimeLimit: return "time_limit";
    case StopReason::kUnplanned: return "unplanned";
    case StopReason::kAborted: return "aborted";
  }
  return "";
}

}  // namespace feeler
