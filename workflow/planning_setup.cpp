#include "workflow/planning_setup.h"

#include "env/contact_map_cache.h"
#include "env/fingerprint.h"

namespace feeler::workflow {

PlanningSetup LoadPlanningSetup(const std::string& task, const PlanningSetupOptions& options) {
  PlanningSetup setup;
  setup.model = env::LoadTask(task);
  if (options.goal) setup.model.task.goal = *options.goal;
  setup.opening = options.opening;
  setup.map = std::make_shared<const planner::ContactMap>(
      env::GetContactMap(setup.model, options.opening, options.jobs, options.progress));
  setup.fingerprint = env::Fingerprint(setup.model, options.opening);
  return setup;
}

}  // namespace feeler::workflow
