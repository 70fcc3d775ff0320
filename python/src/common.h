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

#include <chrono>
#include <exception>
#include <functional>
#include <future>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/pose.h"
#include "feeler/core/progress.h"

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

/// Runs `work` on a thread of its own, without the interpreter's lock, while this one listens for signals: Ctrl-C
/// cancels, waits for the work to end, and raises KeyboardInterrupt. Exceptions of `work` come out here.
template <class Work>
auto RunInterruptibly(CancellationToken& token, Work&& work) {
  auto future = std::async(std::launch::async, std::forward<Work>(work));
  bool stopped = false;
  nb::gil_scoped_release released;
  while (future.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    if (stopped) continue;
    const nb::gil_scoped_acquire acquired;
    if (PyErr_CheckSignals() != 0) {
      stopped = true;
      token.Cancel();
      // The exception that is set belongs to this thread; it is raised again when the work has ended.
      PyErr_Clear();
    }
  }
  if (stopped) {
    try {
      future.get();
    } catch (...) {  // NOLINT: what the cancelled work says is of no interest
    }
    const nb::gil_scoped_acquire acquired;
    PyErr_SetNone(PyExc_KeyboardInterrupt);
    throw nb::python_error();
  }
  return future.get();
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
