#include "feeler/execution/contact/executor_options.h"

#include <cmath>
#include <string>

#include "feeler/core/error.h"

namespace feeler::execution {
namespace {

void RequirePositive(const char* option, double value) {
  if (!(std::isfinite(value) && value > 0.0)) {
    throw InputError("executor options", std::string(option) + " is " + std::to_string(value),
                     "give a positive finite number");
  }
}

}  // namespace

ExecutorOptions OptionsForThreshold(double threshold_n) {
  ExecutorOptions options;
  if (threshold_n > options.contact_force_n) {
    options = ExecutorOptions::WithFriction();
    options.contact_force_n = threshold_n;
  }
  return options;
}

void Validate(const ExecutorOptions& options) {
  RequirePositive("transfer_speed_m_s", options.transfer_speed_m_s);
  RequirePositive("probe_speed_m_s", options.probe_speed_m_s);
  if (!(options.force_budget_n > options.contact_force_n)) {
    throw InputError("executor options",
                     "force_budget_n is " + std::to_string(options.force_budget_n) + ", and a contact is told from " +
                         std::to_string(options.contact_force_n) + " N on",
                     "give a larger budget");
  }
  RequirePositive("contact_force_n", options.contact_force_n);
  RequirePositive("shortfall_m", options.shortfall_m);
  RequirePositive("overtravel_cells", options.overtravel_cells);
  RequirePositive("sure_overtravel_cells", options.sure_overtravel_cells);
  RequirePositive("fast_margin_cells", options.fast_margin_cells);
  RequirePositive("free_margin_cells", options.free_margin_cells);
  RequirePositive("retreat_m", options.retreat_m);
  RequirePositive("confirm_limit_m", options.confirm_limit_m);
  RequirePositive("insertion_speed_m_s", options.insertion_speed_m_s);
  RequirePositive("sliding_speed_m_s", options.sliding_speed_m_s);
  RequirePositive("insertion_force_limit_n", options.insertion_force_limit_n);
  RequirePositive("time_limit_s", options.time_limit_s);
  RequirePositive("motion_limit", options.motion_limit);
  RequirePositive("matching tolerance_cells", options.matching.tolerance_cells);
  RequirePositive("fit violation_cells", options.fit.violation_cells);
  RequirePositive("fit step_cells", options.fit.step_cells);
}

}  // namespace feeler::execution
