#pragma once

#include "feeler/core/error.h"

namespace feeler {

/// A signal asked the command to end. Thrown, from a progress callback too, where there is no result to keep; the
/// command line exits with 1.
class Interrupted : public Error {
 public:
  Interrupted() : Error("interrupted", "ended by a signal") {}
};

}  // namespace feeler
