#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/setup/policy_registry.h"
#include "planner.h"

namespace feeler::python {

/// The problems that episodes draw from, as `feeler run` chooses them.
planner::ProblemFamily FamilyFor(const nb::object& extents, const Task& task, policies::Database* database);

/// Makes the policy of each episode: a named one, a graph, or one of Python.
workflow::PolicyFactory FactoryFor(const nb::object& policy, const std::shared_ptr<policies::Database>& database,
                                   const std::vector<std::string>& options, const std::shared_ptr<Raised>& raised);

}  // namespace feeler::python
