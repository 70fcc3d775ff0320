#include "feeler/cli/quick_check.h"

#include <algorithm>

#include "feeler/cli/common/console.h"
#include "feeler/core/error.h"
#include "feeler/workflow/check/task_check.h"

namespace feeler::cli {
namespace {

using env::TaskFinding;
using env::TaskFindings;

bool PreventsAll(const TaskFinding& finding) {
  return finding.severity == TaskFinding::Severity::kError && finding.kind != "lid";
}

}  // namespace

std::string LineOf(const TaskFinding& finding) { return Error(finding.where, finding.what, finding.mend).what(); }

std::string_view SeverityName(TaskFinding::Severity severity) {
  return severity == TaskFinding::Severity::kError ? "error" : "warning";
}

nlohmann::json ToJson(const TaskFindings& findings) {
  nlohmann::json list = nlohmann::json::array();
  for (const TaskFinding& finding : findings) {
    list.push_back({{"severity", SeverityName(finding.severity)},
                    {"kind", finding.kind},
                    {"where", finding.where},
                    {"what", finding.what},
                    {"mend", finding.mend}});
  }
  return list;
}

void CheckQuickly(const std::string& name, env::Opening opening) {
  const env::TaskModel task_model = env::LoadTask(name);
  const Task& task = task_model.task;
  const TaskFindings findings = workflow::QuickFindings(task_model, opening, workflow::LargestExtents(task));
  if (std::any_of(findings.begin(), findings.end(), PreventsAll)) {
    for (const TaskFinding& finding : workflow::QuickFindings(task_model, opening, workflow::SmallestExtents(task))) {
      if (PreventsAll(finding)) throw InputError(finding.where, finding.what, finding.mend);
    }
  }
  for (const TaskFinding& finding : findings) Note("feeler: warning: {}\n", LineOf(finding));
}

}  // namespace feeler::cli
