// The second module: experiments and the report. It links what reads pictures, so it is loaded when it is asked for.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>

#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"
#include "feeler/core/progress.h"
#include "feeler/evaluation/registry.h"
#include "feeler/evaluation/report/page.h"
#include "interruptible.h"

namespace nb = nanobind;
using namespace nb::literals;  // NOLINT

namespace feeler::python {
namespace {

nb::dict RunExperiment(const std::string& name, const std::string& out, bool quick, int jobs, const std::string& task,
                       std::uint64_t seed, int solver_seeds, const std::string& command, const nb::object& progress) {
  const evaluation::Experiment& experiment = evaluation::FindExperiment(name);
  CancellationToken token;
  evaluation::ExperimentRequest request;
  request.out = out;
  request.quick = quick;
  request.jobs = Threads(jobs);
  request.task = task;
  request.seed = seed;
  request.solver_seeds = solver_seeds;
  request.command = command;
  request.cancellation = &token;
  std::exception_ptr raised;
  request.progress = [&](std::int64_t done, std::int64_t total) {
    if (progress.is_none() || raised) return;
    const nb::gil_scoped_acquire acquired;
    try {
      if (progress(done, total).is(nb::handle(Py_False))) token.Cancel();
    } catch (...) {
      raised = std::current_exception();
      token.Cancel();
    }
  };
  const evaluation::ExperimentOutcome outcome =
      RunInterruptibly(token, [&] { return evaluation::RunExperiment(experiment, request); });
  if (raised) std::rethrow_exception(raised);
  nb::dict d;
  d["complete"] = outcome.complete;
  d["partial_file"] = outcome.partial_file;
  d["text"] = outcome.text;
  return d;
}

nb::dict Report(const std::string& folder, const std::string& out, double replay_megabytes) {
  if (!(replay_megabytes >= 0.0 && replay_megabytes <= 1000.0)) {
    throw InputError("replay_megabytes", "is out of range", "give 0 to 1000");
  }
  evaluation::Results results;
  std::string page;
  {
    const nb::gil_scoped_release released;
    results = evaluation::ReadResults(folder);
    evaluation::ReportOptions options;
    options.replay_bytes = std::llround(1e6 * replay_megabytes);
    page = evaluation::ReportPage(results, folder, options);
    WriteFileAtomically(out, page);
  }
  std::size_t episodes = 0;
  for (const evaluation::ReportedRecords& records : results.records) episodes += records.episodes.size();
  nb::list faults;
  for (const evaluation::Fault& fault : results.faults) faults.append(evaluation::ToString(fault));
  nb::dict d;
  d["experiments"] = results.experiments.size();
  d["episodes"] = episodes;
  d["faults"] = faults;
  d["bytes"] = page.size();
  d["path"] = out;
  return d;
}

}  // namespace
}  // namespace feeler::python

NB_MODULE(_evaluation, m) {
  using namespace feeler;          // NOLINT
  using namespace feeler::python;  // NOLINT
  m.doc() = "Experiments and the report; use them by way of the package `feeler`.";
  // The errors are those of the first module: one class each, whichever library raised it.
  nb::register_exception_translator(
      [](const std::exception_ptr& p, void*) {
        const auto raise = [](const char* name, const std::exception& e) {
          const nb::object errors = nb::module_::import_("feeler._feeler");
          PyErr_SetString(nb::object(errors.attr(name)).ptr(), e.what());
        };
        try {
          std::rethrow_exception(p);
        } catch (const InputError& e) {
          raise("InputError", e);
        } catch (const NegativeResult& e) {
          raise("NegativeResult", e);
        } catch (const WorldError& e) {
          raise("WorldError", e);
        } catch (const Interrupted& e) {
          raise("Interrupted", e);
        } catch (const Error& e) {
          raise("Error", e);
        }
      },
      nullptr);
  m.def(
      "set_data_folder", [](const std::string& folder) { SetDataFolder(folder); }, "folder"_a);
  m.def("experiments", [] {
    nb::dict d;
    for (const evaluation::Experiment& experiment : evaluation::Experiments()) {
      d[nb::str(experiment.name.c_str())] = experiment.summary;
    }
    return d;
  });
  m.def("run_experiment", &RunExperiment, "name"_a, "out"_a, "quick"_a, "jobs"_a, "task"_a, "seed"_a, "solver_seeds"_a,
        "command"_a, "progress"_a.none());
  m.def("report", &Report, "folder"_a, "out"_a, "replay_megabytes"_a);
}
