#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <memory>
#include <string>

#include "feeler/core/pose.h"

namespace feeler::env {

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct DataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using ModelHandle = std::unique_ptr<mjModel, ModelDeleter>;
using DataHandle = std::unique_ptr<mjData, DataDeleter>;

/// Routes MuJoCo's messages: a warning is kept per thread (TakeMujocoWarning), an error is thrown as WorldError;
/// neither writes a file nor ends the process. Installs the collision filter (env/model/collision_filter.h) as well.
/// Idempotent and thread-safe; every loader below calls it.
void RouteMujocoMessages();

/// The last warning MuJoCo gave on this thread since the last call; empty when there was none.
std::string TakeMujocoWarning();

/// Compiles an MJCF text held in memory. Files it names (meshes, textures) must have absolute paths.
/// Throws InputError with `where` (a file name, for people) and MuJoCo's message if it does not compile.
ModelHandle CompileMjcf(const std::string& xml, const std::string& where);

/// A fresh mjData of the model. One per thread.
DataHandle MakeData(const mjModel& model);

/// Body pose in the world; mj_kinematics must be up to date.
Pose BodyPose(const mjData& data, int body);

/// "x y z" and "w x y z" as MJCF attributes want them, exact to the last bit.
std::string MjcfVector(const Eigen::VectorXd& values);
std::string MjcfQuaternion(const Eigen::Matrix3d& rotation);

}  // namespace feeler::env
