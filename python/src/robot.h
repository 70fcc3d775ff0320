#pragma once

#include <memory>
#include <string>

#include "common.h"
#include "feeler/core/robot.h"
#include "feeler/policies/policy.h"

namespace feeler::python {

/// A robot whose motions Python carries out (feeler.Robot). Exceptions are kept in `raised`; the library sees an
/// InputError, which ends its run.
std::unique_ptr<Robot> RobotFromPython(nb::object object, std::shared_ptr<Raised> raised);
/// The same of a policy (feeler.Policy).
std::unique_ptr<policies::Policy> PolicyFromPython(nb::object object, std::shared_ptr<Raised> raised);

}  // namespace feeler::python
