// Law: no task that ships has a finding that can be made without a contact map.

#include <gtest/gtest.h>

#include <string>

#include "feeler/env/model/task_file.h"
#include "feeler/workflow/check/task_check.h"

namespace feeler::workflow {
namespace {

TEST(TaskCheck, TasksThatShipHaveNoQuickFindings) {
  for (const std::string& name : env::ListTasks()) {
    const env::TaskModel task = env::LoadTask(name);
    for (const env::TaskFinding& finding : QuickFindings(task, env::Opening::kClosed, LargestExtents(task.task))) {
      ADD_FAILURE() << finding.where << ": " << finding.what << " (" << finding.mend << ")";
    }
  }
}

}  // namespace
}  // namespace feeler::workflow
