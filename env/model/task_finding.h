#pragma once

#include <string>
#include <vector>

namespace feeler::env {

/// Something about a task that its owner should know before it costs time.
struct TaskFinding {
  enum class Severity { kWarning, kError };
  Severity severity = Severity::kError;  ///< error: it prevents work
  std::string kind;                      ///< for machines: "margin", "tolerance", ...
  std::string where;                     ///< file and element
  std::string what;                      ///< one line, with how much
  std::string mend;
};
using TaskFindings = std::vector<TaskFinding>;

/// Throws the first finding that prevents work, if there is one, as InputError.
void RequireNoError(const TaskFindings& findings);

}  // namespace feeler::env
