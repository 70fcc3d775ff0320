// Tasks and solving.
#include "planner.h"

#include "feeler/env/model/task_file.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::python {
namespace {

GoalKind ParseGoal(const std::string& name) {
  return Named(name, "goal", {GoalKind::kSingleton, GoalKind::kInsertable});
}

nb::object Number(double value) { return nb::float_(value); }

/// A value per axis of the target frame.
template <class ValueOf>
nb::tuple PerAxis(const ValueOf& value_of) {
  return nb::make_tuple(value_of(0), value_of(1), value_of(2));
}

nb::dict ResultDict(const planner::SolverResult& r, const planner::Problem& problem,
                    const planner::SolverOptions& options, const std::string& unit) {
  const auto text = [](std::string_view t) { return nb::str(t.data(), t.size()); };
  nb::dict d;
  d["problem"] = problem.name;
  d["status"] = text(planner::ToString(r.status));
  d["solver"] = text(planner::ToString(options.solver));
  d["heuristic"] = text(planner::ToString(options.heuristic));
  d["hypotheses"] = problem.hypotheses.size();
  d["expected_cost"] = Number(r.expected_cost);
  d["cost_unit"] = unit;
  d["lower_bound"] = Number(r.lower_bound);
  d["ratio"] = Number(r.Ratio());
  d["trials"] = r.trials;
  d["expansions"] = r.expansions;
  d["cpu_s"] = r.cpu_s;
  d["wall_s"] = r.wall_s;
  d["policy_nodes"] = r.complete() ? r.policy->nodes.size() : 0;
  nb::list pairs;
  for (const auto& [i, j] : r.indistinguishable) pairs.append(nb::make_tuple(i, j));
  d["indistinguishable"] = pairs;
  return d;
}

/// The solver on a thread of its own; (result, policy or None).
nb::tuple Solve(const std::shared_ptr<const planner::Problem>& problem, const nb::dict& given, CancellationToken* outer,
                const nb::object& on_bounds, int jobs, const std::string& unit) {
  CancellationToken own;
  CancellationToken& token = outer != nullptr ? *outer : own;
  planner::SolverOptions options = ToSolverOptions(given, token);
  Raised raised;
  Held callback;
  if (!on_bounds.is_none()) callback = Held(on_bounds);
  options.on_bounds = [&](const planner::BoundsRow& row) {
    if (!callback || raised.error) return;
    const nb::gil_scoped_acquire acquired;
    try {
      nb::dict d;
      d["wall_s"] = row.wall_s;
      d["trials"] = row.trials;
      d["expansions"] = row.expansions;
      d["lower_bound"] = row.lower_bound;
      d["upper_bound"] = row.upper_bound;
      d["ratio"] = row.Ratio();
      const nb::object answer = (*callback)(d);
      if (answer.is(nb::handle(Py_False))) token.Cancel();
    } catch (...) {
      raised.Keep();
      token.Cancel();
    }
  };
  planner::Validate(options);
  planner::SolverResult result = RunInterruptibly(token, [&] {
    const auto tables = planner::BuildPlanningTables(*problem, options, Threads(jobs));
    return planner::Solve(*problem, options, tables);
  });
  raised.Rethrow();
  nb::object policy = nb::none();
  if (result.policy) {
    policy = nb::cast(BoundPolicy{problem, std::make_shared<const planner::PolicyGraph>(*result.policy)});
  }
  return nb::make_tuple(ResultDict(result, *problem, options, unit), policy);
}

void BindTask(nb::module_& m) {
  nb::class_<PlanningTask>(m, "PlanningTask")
      .def(
          "__init__",
          [](PlanningTask* self, const std::string& name, const std::string& opening, const std::string& goal,
             const std::string& cost) { new (self) PlanningTask(name, opening, goal, cost); },
          "name"_a, "opening"_a, "goal"_a, "cost"_a)
      .def(
          "load", [](PlanningTask& self, int jobs, const nb::object& progress) { self.Setup(jobs, progress); },
          "jobs"_a, "progress"_a.none())
      .def_prop_ro("loaded", &PlanningTask::loaded)
      .def_prop_ro("argument", &PlanningTask::name)
      .def_prop_ro("name", [](const PlanningTask& t) { return t.task().name; })
      .def_prop_ro("file", [](const PlanningTask& t) { return t.model().file.string(); })
      .def_prop_ro("cell_m", [](const PlanningTask& t) { return t.task().cell_m; })
      .def_prop_ro("insertion", [](const PlanningTask& t) { return std::string(ToString(t.task().insertion)); })
      .def_prop_ro("insertion_depth_m", [](const PlanningTask& t) { return t.task().insertion_depth_m; })
      .def_prop_ro("start_offset_m", [](const PlanningTask& t) { return t.task().start_offset_m; })
      .def_prop_ro("move_lengths", [](const PlanningTask& t) { return t.task().move_lengths; })
      .def_prop_ro("world_T_target",
                   [](const PlanningTask& t) { return Eigen::Matrix4d(t.task().world_T_target.matrix()); })
      .def_prop_ro("axes",
                   [](const PlanningTask& t) {
                     nb::list axes;
                     for (const UncertainAxis& axis : t.task().axes) {
                       nb::dict d;
                       d["kind"] = std::string(ToString(axis.kind));
                       d["resolution"] = axis.resolution;
                       d["unit"] = axis.angular() ? "rad" : "m";
                       d["min_cells"] = axis.min_cells;
                       d["max_cells"] = axis.max_cells;
                       axes.append(d);
                     }
                     return axes;
                   })
      .def_prop_ro("tolerance",
                   [](const PlanningTask& t) {
                     nb::dict d;
                     d["lateral_m"] = t.task().tolerance.lateral_m;
                     d["lateral_per_axis_m"] = PerAxis([&](int axis) { return t.task().tolerance.Lateral(axis); });
                     d["vertical_m"] = t.task().tolerance.vertical_m;
                     d["angle_rad"] = t.task().tolerance.angle_rad;
                     d["angle_per_axis_rad"] = PerAxis([&](int axis) { return t.task().tolerance.Angle(axis); });
                     return d;
                   })
      .def_prop_ro("contact_map", [](PlanningTask& t) { return t.Setup(1, nb::none())->map; })
      .def_prop_ro("fingerprint", [](PlanningTask& t) { return t.Setup(1, nb::none())->fingerprint; })
      .def(
          "problem",
          [](PlanningTask& t, const nb::object& extents) {
            const auto setup = t.Setup(1, nb::none());
            const planner::Extents e = ToExtents(extents, setup->task());
            return std::make_shared<const planner::Problem>(planner::MakeCuboidProblem(setup->task(), setup->map, e));
          },
          "extents"_a)
      .def("cost_unit", [](PlanningTask& t) { return workflow::CostUnit(t.options().cost_kind, t.task().cost); });
}

}  // namespace

PlanningTask::PlanningTask(const std::string& name, const std::string& opening, const std::string& goal,
                           const std::string& cost)
    : name_(name) {
  options_.opening = Named(opening, "opening", {env::Opening::kClosed, env::Opening::kOpen});
  if (!goal.empty()) options_.goal = ParseGoal(goal);
  options_.cost_kind = Named(cost, "cost", {CostKind::kDistance, CostKind::kTime});
  model_ = env::LoadTask(name);
}

std::shared_ptr<const workflow::PlanningSetup> PlanningTask::Setup(int jobs, const nb::object& progress) {
  if (setup_) return setup_;
  CancellationToken token;
  workflow::PlanningSetupOptions options = options_;
  options.jobs = Threads(jobs);
  options.progress = ToProgress(progress, token);
  setup_ = RunInterruptibly(token, [&] {
    return std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup(name_, options));
  });
  return setup_;
}

void BindPlanner(nb::module_& m) {
  nb::class_<CancellationToken>(m, "Cancellation",
                                "Asks long work to stop cleanly and keep what is done; from any thread.")
      .def(nb::init<>())
      .def("cancel", &CancellationToken::Cancel)
      .def_prop_ro("cancelled", &CancellationToken::cancelled);
  BindProblem(m);
  BindPolicy(m);
  BindTask(m);
  m.def("solve", &Solve, "problem"_a, "options"_a, "cancellation"_a.none(), "on_bounds"_a.none(), "jobs"_a,
        "cost_unit"_a);
}

}  // namespace feeler::python
