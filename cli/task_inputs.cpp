#include "feeler/cli/common/outputs.h"
#include "feeler/core/error.h"
#include "feeler/env/model/task_xml.h"

namespace feeler::cli {

std::vector<std::string> InputsOfTask(const std::string& task) {
  try {
    return env::FilesOfTask(task);
  } catch (const Error&) {
    return {env::FileOfTask(task).string()};
  }
}

}  // namespace feeler::cli
