#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_finding.h"

namespace feeler::cli {

/// A finding as one line, as every message: what is not printable is escaped.
std::string LineOf(const env::TaskFinding& finding);
/// "error" or "warning".
std::string_view SeverityName(env::TaskFinding::Severity severity);
nlohmann::json ToJson(const env::TaskFindings& findings);

/// The quick part of `feeler task check`, before a command spends time on a task: warnings are said, a finding that
/// prevents every problem of the task is thrown as InputError. What prevents its largest problems alone is said, and so
/// is a missing lid, because policies can be planned without one.
void CheckQuickly(const std::string& task, env::Opening opening);

}  // namespace feeler::cli
