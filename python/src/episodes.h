#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/setup/policy_registry.h"
#include "planner.h"

namespace feeler::python {

/// Makes the policy of each episode: a named one, a graph, or one of Python.
workflow::PolicyFactory FactoryFor(const nb::object& policy, const std::shared_ptr<policies::Database>& database,
                                   const std::vector<std::string>& options, const std::shared_ptr<Raised>& raised);

}  // namespace feeler::python
