#include "feeler/planner/motion/robot_description.h"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <tinyxml2.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>

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

/// urdfdom takes zero for what it cannot read as a number, or drops the joint: said before it looks, by link or joint.
void RequireNumbers(const tinyxml2::XMLElement& element, const std::string& where) {
  constexpr std::array<std::string_view, 18> kNumeric = {"xyz",   "rpy",      "value",  "ixx",    "ixy",   "ixz",
                                                         "iyy",   "iyz",      "izz",    "lower",  "upper", "effort",
                                                         "scale", "velocity", "radius", "length", "size",  "rgba"};
  for (const auto* attribute = element.FirstAttribute(); attribute != nullptr; attribute = attribute->Next()) {
    if (std::find(kNumeric.begin(), kNumeric.end(), attribute->Name()) == kNumeric.end()) continue;
    std::istringstream words{std::string(attribute->Value())};
    for (std::string word; words >> word;) {
      double value = 0;
      const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
      const char* end = word.data() + word.size();
      const auto [rest, error] = std::from_chars(begin, end, value);
      if (error == std::errc() && rest == end && std::isfinite(value)) continue;
      throw InputError(
          where,
          fmt::format("{} in line {}: \"{}\" is not a finite number", attribute->Name(), attribute->GetLineNum(), word),
          "give numbers in m, rad, kg, Nm");
    }
  }
  for (const auto* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    RequireNumbers(*child, fmt::format("{}<{}>", where, child->Name()));
  }
}

void RequireNumbers(const std::string& text, const std::string& file) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) return;  // urdfdom says what is wrong
  if (document.RootElement() == nullptr) return;
  for (const auto* part = document.RootElement()->FirstChildElement(); part != nullptr;
       part = part->NextSiblingElement()) {
    const char* name = part->Attribute("name");
    RequireNumbers(*part, fmt::format("{}: <{} name=\"{}\">", file, part->Name(), name == nullptr ? "" : name));
  }
}

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
  RequireNumbers(text.str(), file);
  urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text.str());
  if (!model || !model->getRoot()) {
    throw InputError(file, "not a valid robot description: " + last_urdf_message, "correct the URDF");
  }
  return model;
}

}  // namespace feeler::planner
