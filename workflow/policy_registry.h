#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "planner/belief/problem.h"
#include "planner/preprocess/problem_family.h"
#include "policies/policy.h"
#include "policies/storage/database.h"

namespace feeler::workflow {

/// Gives the policy for one problem; called once an episode. Safe to call from several threads. Throws InputError if
/// there is no policy for the problem.
using PolicyFactory =
    std::function<std::unique_ptr<policies::Policy>(const planner::Problem& problem, const planner::Extents& extents)>;

/// Names that `MakePolicyFactory` knows.
std::vector<std::string> PolicyNames();

/// Whether episodes of this policy end with the fallback ladder unless told otherwise: it belongs to policies that
/// localize by touch, a baseline that does not is measured as it is. Throws InputError for an unknown name.
bool UsesLadder(const std::string& name);

/// The factory of a policy by its name. `database` serves the policies that read one and may be null for the others.
/// Throws InputError for an unknown name (listing the known) or a missing database.
PolicyFactory MakePolicyFactory(const std::string& name, std::shared_ptr<policies::Database> database);

}  // namespace feeler::workflow
