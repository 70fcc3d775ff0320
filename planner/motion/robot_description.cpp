#include "feeler/planner/motion/robot_description.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <fstream>
#include <sstream>

#include "feeler/core/error.h"
#include "feeler/core/text/plain_locale.h"

namespace feeler::planner {
namespace {

// urdfdom reports through a process-wide handler; what it says is kept for the error message of this thread.
thread_local std::string last_urdf_message;

class KeepMessage : public console_bridge::OutputHandler {
 public:
  void log(const std::string& text, console_bridge::LogLevel level, const char* /*file*/, int /*line*/) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_WARN) last_urdf_message = text;
  }
};

}  // namespace

urdf::ModelInterfaceSharedPtr ReadRobotDescription(const std::string& file) {
  const PlainLocale plain;
  static KeepMessage handler;
  console_bridge::useOutputHandler(&handler);
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file, "cannot read the robot description", "give a readable URDF file");
  std::stringstream text;
  text << in.rdbuf();
  last_urdf_message.clear();
  urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text.str());
  if (!model || !model->getRoot()) {
    throw InputError(file, "not a valid robot description: " + last_urdf_message, "correct the URDF");
  }
  return model;
}

}  // namespace feeler::planner
