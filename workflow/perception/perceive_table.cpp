#include "feeler/workflow/perception/perceive_table.h"

#include <nlohmann/json.hpp>

#include "feeler/core/error.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/perception/input_file.h"

namespace feeler::workflow {
bool IsTableFile(const std::string& path) {
  try {
    return perception::ParseJson(perception::ReadFile(path), path).contains("rules");
  } catch (const InputError&) {
    return false;
  }
}

perception::UncertaintyTable LoadTable(const std::string& path, const Task& task, const std::string& fingerprint) {
  perception::UncertaintyTable table = perception::ParseTable(perception::ReadFile(path), path);
  RequireTask(table, task, fingerprint, path);
  if (table.axes.size() != task.axes.size())
    throw InputError(path, "has other axes than the task", "make one with feeler perceive calibrate");
  return table;
}

void UsePrior(const std::string& path, PlanningSetup& setup) {
  const perception::UncertaintyTable table =
      LoadTable(path, setup.task(), env::Fingerprint(setup.model, env::Opening::kClosed));
  setup.prior_deviation = perception::PriorDeviation(table);
  if (setup.prior_deviation.empty()) {
    throw InputError(path, "does not know how its errors are spread ('deviation')",
                     "make it anew with feeler perceive calibrate");
  }
}

planner::ProblemFamily FamilyOfTable(const perception::UncertaintyTable& table, const Task& task,
                                     const std::string& spec) {
  std::vector<planner::ProblemFamily> problems;
  for (const std::vector<int>& counts : perception::FamilyOf(table)) {
    problems.push_back({{planner::ExtentsAlong(planner::AxesOf(task), counts)}, spec});
  }
  return planner::UnionOf(problems, spec);
}

std::optional<planner::Extents> SnapTo(const planner::ProblemFamily& family, const Task& task,
                                       const std::vector<int>& counts) {
  std::optional<planner::Extents> best;
  for (const planner::Extents& problem : family.problems) {
    const std::vector<int> offered = planner::ExtentsPerAxis(planner::AxesOf(task), problem);
    bool covers = true;
    for (std::size_t i = 0; i < counts.size(); ++i) covers = covers && offered[i] >= counts[i];
    if (covers && (!best || problem.Count() < best->Count())) best = problem;
  }
  return best;
}

}  // namespace feeler::workflow
