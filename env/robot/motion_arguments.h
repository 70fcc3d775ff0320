#pragma once

#include <fmt/format.h>

#include <cmath>

#include "feeler/core/error.h"
#include "feeler/core/pose.h"

namespace feeler::env {

// What a motion of the simulated robot refuses: numbers and poses that make no sense. Throw InputError.

inline void RequirePositive(double value, const char* where, const char* what) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw InputError(where, fmt::format("{} is {}", what, value), "give a finite number above zero");
  }
}

inline void RequirePose(const Pose& pose, const char* where) {
  if (!pose.matrix().allFinite()) throw InputError(where, "the pose is not finite", "give finite numbers");
  const Eigen::Matrix3d r = pose.linear();
  if (!(r.transpose() * r).isIdentity(1e-6) || r.determinant() < 0) {
    throw InputError(where, "the pose's rotation is not a rotation", "give an orthonormal right-handed matrix");
  }
}

}  // namespace feeler::env
