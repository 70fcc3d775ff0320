// Policy databases: build, look into, verify, merge.
#include "feeler/policies/storage/database.h"

#include <filesystem>
#include <set>

#include "common.h"
#include "feeler/planner/family/preprocess.h"
#include "feeler/workflow/setup/database_builder.h"
#include "planner.h"

namespace feeler::python {
namespace {

nb::dict RowDict(const policies::StoredProblem& row, const std::vector<AxisKind>& axes) {
  nb::dict d;
  d["extents"] = nb::tuple(nb::cast(planner::ExtentsPerAxis(axes, row.extents)));
  d["status"] = row.status;
  d["solver"] = row.solver;
  d["epsilon"] = row.epsilon;
  d["gap"] = row.gap;
  d["expected_cost"] = row.expected_cost;
  d["lower_bound"] = row.lower_bound;
  d["ratio"] = row.Ratio();
  d["expansions"] = row.expansions;
  d["seed"] = row.seed;
  d["version"] = row.version;
  d["cpu_s"] = row.cpu_s;
  d["wall_s"] = row.wall_s;
  return d;
}

nb::dict InfoOf(const policies::DatabaseInfo& info) {
  nb::dict d;
  d["problems"] = info.problems;
  d["solved"] = info.solved;
  d["ratio_mean"] = info.ratio_mean;
  d["ratio_max"] = info.ratio_max;
  d["expected_cost_mean"] = info.expected_cost_mean;
  d["cpu_s"] = info.cpu_s;
  d["wall_s"] = info.wall_s;
  d["policy_nodes"] = info.policy_nodes;
  d["bytes"] = info.bytes;
  nb::dict statuses;
  for (const auto& [status, count] : info.statuses) statuses[nb::str(status.c_str())] = count;
  d["statuses"] = statuses;
  nb::list ratios;
  for (const policies::RatioBin& bin : info.ratios) {
    nb::dict b;
    b["up_to"] = bin.up_to;
    b["count"] = bin.count;
    ratios.append(b);
  }
  d["ratios"] = ratios;
  return d;
}

/// Extents in the axes of the database.
planner::Extents ExtentsFor(const policies::Database& database, const nb::object& extents) {
  std::string text;
  if (!nb::try_cast(extents, text)) {
    std::vector<int> counts;
    if (!nb::try_cast(extents, counts))
      throw InputError("extents", "are no counts", "give one per axis, e.g. (7, 7, 5)");
    for (const int count : counts) text += (text.empty() ? "" : "x") + std::to_string(count);
  }
  return planner::ParseExtents(text, database.identity().axes);
}

nb::tuple Preprocess(PlanningTask& task, const nb::object& family_given, const nb::dict& solver,
                     const std::string& order, const std::string& experience, int jobs, const std::string& path,
                     CancellationToken* outer, const nb::object& progress) {
  CancellationToken own;
  CancellationToken& token = outer != nullptr ? *outer : own;
  const auto setup = task.Setup(jobs, nb::none());
  const planner::ProblemFamily family = ToFamily(family_given, setup->task());
  planner::PreprocessOptions options;
  options.solver = ToSolverOptions(solver, token);
  options.solver.cancellation = nullptr;
  if (order != "uncertainty" && order != "random")
    throw InputError("order", "unknown name \"" + order + "\"", "choose uncertainty or random");
  options.order = order == "random" ? planner::ProblemOrder::kRandom : planner::ProblemOrder::kUncertainty;
  options.seed = options.solver.seed;
  bool found = false;
  for (const auto kind :
       {planner::ExperienceKind::kRollout, planner::ExperienceKind::kNaive, planner::ExperienceKind::kNone}) {
    if (planner::ToString(kind) == experience) {
      options.experience = kind;
      found = true;
    }
  }
  if (!found) throw InputError("experience", "unknown name \"" + experience + "\"", "choose rollout, naive or none");
  options.jobs = Threads(jobs);
  options.cancellation = &token;
  Raised raised;
  const ProgressCallback inner = ToProgress(progress, token);
  options.progress = [&](std::int64_t done, std::int64_t total) {
    if (raised.error || token.cancelled()) return;  // what is done is kept: the family ends by its own rules
    try {
      inner(done, total);
    } catch (...) {
      const nb::gil_scoped_acquire acquired;
      raised.Keep();
      token.Cancel();
    }
  };
  const workflow::DatabaseBuild build =
      RunInterruptibly(token, [&] { return workflow::BuildDatabase(*setup, family, options, path); });
  raised.Rethrow();
  nb::dict d;
  d["problems"] = build.summary.problems;
  d["skipped"] = build.summary.skipped;
  d["complete"] = build.summary.complete;
  d["failed"] = build.summary.failed;
  d["cancelled"] = build.summary.cancelled;
  d["wall_s"] = build.summary.wall_s;
  d["cpu_s"] = build.summary.cpu_s;
  return nb::make_tuple(d, InfoOf(build.info));
}

/// The better answer to a problem: a policy beats none, then the smaller ratio.
bool Better(const policies::StoredProblem& a, const policies::StoredProblem& b) {
  if (a.policy.has_value() != b.policy.has_value()) return a.policy.has_value();
  return a.Ratio() < b.Ratio();
}

std::int64_t Merge(const std::vector<std::string>& paths, const std::string& out) {
  if (paths.empty()) throw InputError("merge", "no database given", "give one or more");
  std::vector<policies::Database> sources;
  for (const std::string& path : paths) {
    std::error_code error;
    if (std::filesystem::equivalent(path, out, error))
      throw InputError(out, "is one of the inputs", "write to another file");
    sources.push_back(policies::Database::OpenReadOnly(path));
  }
  const policies::DatabaseIdentity& identity = sources.front().identity();
  for (const policies::Database& source : sources) {
    const policies::DatabaseIdentity& other = source.identity();
    source.RequireFingerprint(identity.task, identity.fingerprint);
    if (other.settings != identity.settings || other.opening != identity.opening || other.goal != identity.goal ||
        !(other.cost == identity.cost)) {
      throw InputError(source.path(), "was made with other settings than " + sources.front().path(), "make it again");
    }
  }
  policies::Database target = policies::Database::OpenOrCreate(out, identity);
  std::int64_t written = 0;
  for (policies::Database& source : sources) {
    source.ForEach([&](const policies::StoredProblem& row) {
      const auto there = target.Get(row.extents);
      if (there && !Better(row, *there)) return;
      target.Put(row);
      ++written;
    });
  }
  return written;
}

}  // namespace

void BindDatabase(nb::module_& m) {
  using policies::Database;
  nb::class_<Database>(m, "Database")
      .def_static(
          "open", [](const std::string& path) { return std::make_shared<Database>(Database::OpenReadOnly(path)); },
          "path"_a)
      .def_prop_ro("path", &Database::path)
      .def_prop_ro("identity",
                   [](const Database& d) {
                     const policies::DatabaseIdentity& identity = d.identity();
                     nb::dict out;
                     out["task"] = identity.task;
                     out["fingerprint"] = identity.fingerprint;
                     out["opening"] = identity.opening;
                     out["goal"] = identity.goal;
                     out["settings"] = identity.settings;
                     out["created_by"] = identity.created_by;
                     nb::list axes;
                     for (const AxisKind axis : identity.axes) axes.append(std::string(ToString(axis)));
                     out["axes"] = axes;
                     return out;
                   })
      .def("__len__", [](Database& d) { return d.Info().problems; })
      .def("info", [](Database& d) { return InfoOf(d.Info()); })
      .def("list",
           [](Database& d) {
             nb::list rows;
             for (const policies::StoredProblem& row : d.List()) rows.append(RowDict(row, d.identity().axes));
             return rows;
           })
      .def(
          "contains", [](Database& d, const nb::object& extents) { return d.Contains(ExtentsFor(d, extents)); },
          "extents"_a)
      .def(
          "get",
          [](Database& d, const nb::object& extents, PlanningTask& task) -> nb::object {
            const planner::Extents e = ExtentsFor(d, extents);
            const auto setup = task.Setup(1, nb::none());
            d.RequireFingerprint(setup->task().name, setup->fingerprint);
            const auto row = d.Get(e);
            if (!row) return nb::none();
            nb::object policy = nb::none();
            if (row->policy) {
              auto problem =
                  std::make_shared<const planner::Problem>(planner::MakeCuboidProblem(setup->task(), setup->map, e));
              policy =
                  nb::cast(BoundPolicy{std::move(problem), std::make_shared<const planner::PolicyGraph>(*row->policy)});
            }
            return nb::make_tuple(RowDict(*row, d.identity().axes), policy);
          },
          "extents"_a, "task"_a)
      .def("digest", &Database::ContentDigest, nb::call_guard<nb::gil_scoped_release>())
      .def(
          "verify",
          [](Database& d, PlanningTask& task, int jobs, CancellationToken* outer, const nb::object& progress) {
            CancellationToken own;
            CancellationToken& token = outer != nullptr ? *outer : own;
            const auto setup = task.Setup(jobs, nb::none());
            const ProgressCallback callback = ToProgress(progress, token);
            const workflow::DatabaseVerification v = RunInterruptibly(token, [&] {
              d.Verify();
              return workflow::VerifyDatabase(*setup, d, Threads(jobs), callback, &token);
            });
            nb::dict out;
            out["problems"] = v.problems;
            out["policies"] = v.policies;
            out["hypotheses"] = v.hypotheses;
            out["largest_cost_error"] = v.largest_cost_error;
            out["faults"] = v.faults;
            out["first_fault"] = v.first_fault;
            return out;
          },
          "task"_a, "jobs"_a, "cancellation"_a.none(), "progress"_a.none());
  m.def("preprocess", &Preprocess, "task"_a, "family"_a.none(), "solver"_a, "order"_a, "experience"_a, "jobs"_a,
        "path"_a, "cancellation"_a.none(), "progress"_a.none());
  m.def("merge_databases", &Merge, "paths"_a, "out"_a, nb::call_guard<nb::gil_scoped_release>());
}

}  // namespace feeler::python
