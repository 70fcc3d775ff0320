#pragma once

#include <optional>
#include <string>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/perception/uncertainty_table.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// Whether the file is an uncertainty table (and not, say, a problem family). False for what cannot be read.
bool IsTableFile(const std::string& path);

/// The table of a file, made for this task. Throws InputError for what is no table, and for one of another version or
/// task.
perception::UncertaintyTable LoadTable(const std::string& path, const Task& task, const std::string& fingerprint);

/// Plans with the prior of the table in a file (PlanningSetup::prior_deviation) in place of a uniform one. Throws
/// InputError as LoadTable, and for a table of old, which does not know its deviations.
void UsePrior(const std::string& path, PlanningSetup& setup);

/// Every problem that the table can lead to: the paper's problem family (Sec. V-A).
planner::ProblemFamily FamilyOfTable(const perception::UncertaintyTable& table, const Task& task,
                                     const std::string& spec);

/// The smallest problem of the family with at least these counts along the task's axes; empty if there is none.
std::optional<planner::Extents> SnapTo(const planner::ProblemFamily& family, const Task& task,
                                       const std::vector<int>& counts);

}  // namespace feeler::workflow
