#pragma once

#include "feeler/execution/records/pose_error.h"

namespace feeler::workflow {

using execution::PoseError;
using execution::PoseErrorOf;
using execution::WithinTolerance;

}  // namespace feeler::workflow
