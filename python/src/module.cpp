// The extension module: errors, versions, run-time data; the rest by subject.
#include "common.h"
#include "feeler/core/data_folder.h"
#include "feeler/core/interrupted.h"
#include "feeler/version.h"

namespace feeler::python {

template <class Json>
static nb::object Convert(const Json& json) {
  switch (json.type()) {
    case Json::value_t::null:
    case Json::value_t::discarded: return nb::none();
    case Json::value_t::boolean: return nb::bool_(json.template get<bool>());
    case Json::value_t::number_integer: return nb::int_(json.template get<std::int64_t>());
    case Json::value_t::number_unsigned: return nb::int_(json.template get<std::uint64_t>());
    case Json::value_t::number_float: return nb::float_(json.template get<double>());
    case Json::value_t::string: {
      const auto& text = json.template get_ref<const std::string&>();
      return nb::str(text.data(), text.size());
    }
    case Json::value_t::array: {
      nb::list list;
      for (const auto& item : json) list.append(Convert(item));
      return list;
    }
    case Json::value_t::object: {
      nb::dict dict;
      for (const auto& [key, value] : json.items()) dict[nb::str(key.data(), key.size())] = Convert(value);
      return dict;
    }
    case Json::value_t::binary: break;
  }
  return nb::none();
}

nb::object ToPython(const nlohmann::json& json) { return Convert(json); }
nb::object ToPython(const nlohmann::ordered_json& json) { return Convert(json); }

ProgressCallback ToProgress(const nb::object& callback, CancellationToken& token) {
  if (callback.is_none()) {
    return [&token](std::int64_t, std::int64_t) {
      if (token.cancelled()) throw Interrupted();
    };
  }
  return [held = Held(callback), &token](std::int64_t done, std::int64_t total) {
    if (token.cancelled()) throw Interrupted();
    const nb::gil_scoped_acquire acquired;
    const nb::object answer = (*held)(done, total);
    if (answer.is(nb::handle(Py_False))) token.Cancel();
  };
}

}  // namespace feeler::python

NB_MODULE(_feeler, m) {
  using namespace feeler;          // NOLINT
  using namespace feeler::python;  // NOLINT
  m.doc() = "Bindings of the library; use them by way of the package `feeler`.";
  nb::exception<Error> error(m, "Error", PyExc_RuntimeError);
  // Registered later, tried first.
  nb::exception<InputError> input(m, "InputError", nb::make_tuple(error, nb::handle(PyExc_ValueError)).ptr());
  nb::exception<NegativeResult> negative(m, "NegativeResult", error.ptr());
  nb::exception<WorldError> world(m, "WorldError", error.ptr());
  nb::exception<Interrupted> interrupted(m, "Interrupted", error.ptr());
  m.attr("__version__") = FEELER_VERSION;
  m.def(
      "set_data_folder", [](const std::string& folder) { SetDataFolder(folder); }, "folder"_a,
      "Looks in `folder` first for models and other run-time data.");
  m.def(
      "find_data", [](const std::string& name) { return FindData(name).string(); }, "name"_a,
      "Where a folder of run-time data lies. Raises InputError that lists what was looked for.");
  BindSimulation(m);
  BindVector(m);
  BindPlanner(m);
  BindDatabase(m);
  BindRobot(m);
  BindEpisodes(m);
  BindPerception(m);
  BindRecording(m);
}
