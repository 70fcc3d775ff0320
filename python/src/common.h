#pragma once

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <exception>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/error.h"
#include "feeler/core/pose.h"
#include "feeler/core/progress.h"
#include "interruptible.h"

/// What the binding's sources share. Errors of the library reach Python as feeler.InputError and its sisters; Python's
/// own, raised in a callback, come back out as they are.
namespace feeler::python {

namespace nb = nanobind;
using namespace nb::literals;  // NOLINT

using DoubleArray = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using FloatArray = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;

/// Poses cross as 4 x 4 matrices. Throws InputError for what is no rigid transform.
inline Pose ToPose(const Eigen::Matrix4d& matrix, const char* where) {
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  if (!matrix.allFinite() || !(r.transpose() * r).isIdentity(1e-6) || r.determinant() < 0.0 ||
      !matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1))) {
    throw InputError(where, "the pose is not a finite rigid transform", "give a 4 x 4 matrix [[R, p], [0, 1]]");
  }
  Pose pose = Pose::Identity();
  pose.linear() = r;
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

/// JSON as Python objects.
nb::object ToPython(const nlohmann::json& json);
nb::object ToPython(const nlohmann::ordered_json& json);

/// An array that owns its memory.
template <class T>
nb::object NewArray(std::vector<T>&& values, std::vector<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.data(), owner));
}

/// An entry of a dict of options; none: not given. Throws InputError that names the key.
template <class T>
std::optional<T> Take(const nb::dict& options, const char* key) {
  if (!options.contains(key) || options[key].is_none()) return std::nullopt;
  T value;
  if (!nb::try_cast(options[key], value)) {
    throw InputError(key, std::string("has the wrong type (") + nb::type_name(options[key].type()).c_str() + ")",
                     "see its documentation");
  }
  return value;
}

/// A direction by its name. Throws InputError.
inline Direction ToDirection(const std::string& name) {
  const auto direction = ParseDirection(name);
  if (!direction) throw InputError("direction", "unknown \"" + name + "\"", "choose +x, -x, +y, -y, +z or -z");
  return *direction;
}

/// A callback of Python as progress callback: `callback(done, total)`; None: nothing. Returning False asks to stop, as
/// `token` cancelled does. What it raises ends the work and is raised by the call.
ProgressCallback ToProgress(const nb::object& callback, CancellationToken& token);

/// Holds a reference that may be dropped on any thread.
class Held {
 public:
  Held() = default;
  explicit Held(nb::object object)
      : object_(new nb::object(std::move(object)), [](nb::object* held) {
          const nb::gil_scoped_acquire acquired;
          delete held;
        }) {}
  const nb::object& operator*() const { return *object_; }
  explicit operator bool() const { return object_ != nullptr; }

 private:
  std::shared_ptr<nb::object> object_;
};

/// The first exception that Python code raised inside of a run which the library must not take for its own.
struct Raised {
  std::exception_ptr error;
  /// Cancelled: no more of Python's methods are called, which ends the run; none: they always are.
  const CancellationToken* stop = nullptr;
  /// Call in a catch clause with the lock held.
  void Keep() {
    if (!error) error = std::current_exception();
  }
  void Rethrow() const {
    if (error) std::rethrow_exception(error);
  }
};

void BindSimulation(nb::module_& module);
void BindVector(nb::module_& module);
void BindPlanner(nb::module_& module);
void BindDatabase(nb::module_& module);
void BindEpisodes(nb::module_& module);
void BindRobot(nb::module_& module);
void BindPerception(nb::module_& module);
void BindRecording(nb::module_& module);

}  // namespace feeler::python
