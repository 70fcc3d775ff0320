#include "core/task.h"

namespace feeler {

std::string_view ToString(AxisKind kind) {
  switch (kind) {
    case AxisKind::kX: return "x";
    case AxisKind::kY: return "y";
    case AxisKind::kZ: return "z";
    case AxisKind::kYaw: return "yaw";
    case AxisKind::kPitch: return "pitch";
  }
  return "";
}

std::string_view ToString(GoalKind kind) { return kind == GoalKind::kSingleton ? "singleton" : "insertable"; }

}  // namespace feeler
