#include "feeler/env/model/mujoco_handles.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cstring>
#include <mutex>

#include "feeler/core/error.h"
#include "feeler/core/text/plain_locale.h"
#include "feeler/env/model/collision_filter.h"
#include "feeler/env/model/contact_settings.h"

namespace feeler::env {
namespace {

thread_local std::string last_warning;

void KeepWarning(const char* text) { last_warning = text; }

// MuJoCo expects that its error handler does not return. An exception leaves it without ending the process.
[[noreturn]] void ThrowError(const char* text) { throw WorldError("MuJoCo", text); }

}  // namespace

void RouteMujocoMessages() {
  static const bool routed = [] {
    mju_user_warning = KeepWarning;
    mju_user_error = ThrowError;
    InstallCollisionFilter();
    return true;
  }();
  (void)routed;
}

std::string TakeMujocoWarning() {
  std::string warning;
  warning.swap(last_warning);
  return warning;
}

ModelHandle CompileMjcf(const std::string& xml, const std::string& where) {
  RouteMujocoMessages();
  // The parser of MuJoCo 2.2 keeps the last document in a global variable.
  static std::mutex parser;
  constexpr const char* kName = "model.xml";
  struct Vfs {
    Vfs() { mj_defaultVFS(&files); }
    ~Vfs() { mj_deleteVFS(&files); }
    mjVFS files;  // 2 MB
  };
  const auto vfs = std::make_unique<Vfs>();
  if (mj_makeEmptyFileVFS(&vfs->files, kName, static_cast<int>(xml.size())) != 0) {
    throw InputError(where, "the model does not fit into memory", "use a smaller model or free some memory");
  }
  std::memcpy(vfs->files.filedata[mj_findFileVFS(&vfs->files, kName)], xml.data(), xml.size());
  std::array<char, 1000> message{};
  const std::lock_guard lock(parser);
  const PlainLocale plain;
  ModelHandle model(mj_loadXML(kName, &vfs->files, message.data(), static_cast<int>(message.size())));
  if (!model) throw InputError(where, std::string("MuJoCo: ") + message.data(), "correct the MJCF");
  RequireSaneContactParameters(*model, where);
  return model;
}

DataHandle MakeData(const mjModel& model) {
  RouteMujocoMessages();
  DataHandle data(mj_makeData(&model));
  if (!data) throw WorldError("MuJoCo", "no memory for the state of the simulation");
  return data;
}

Pose BodyPose(const mjData& data, int body) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.xmat + 9 * body);
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(data.xpos + 3 * body);
  return pose;
}

std::string MjcfVector(const Eigen::VectorXd& values) {
  std::string text;
  for (const double value : values) {
    if (!text.empty()) text += ' ';
    text += fmt::format("{}", value);
  }
  return text;
}

std::string MjcfQuaternion(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(rotation).normalized();
  return MjcfVector(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
}

}  // namespace feeler::env
