// Tasks, contact maps, problems, solving, policy graphs.
#include "planner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "feeler/core/file_output.h"
#include "feeler/env/model/task_file.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/policy/expand_policy.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/policies/io/policy_drawing.h"
#include "feeler/policies/io/policy_json.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::python {
namespace {

template <class T>
std::optional<T> Take(const nb::dict& options, const char* key) {
  if (!options.contains(key) || options[key].is_none()) return std::nullopt;
  T value;
  if (!nb::try_cast(options[key], value)) throw InputError(key, "has the wrong type", "see the documentation");
  return value;
}

/// The one of `kinds` with this name.
template <class Kind>
Kind Named(const std::string& name, const char* what, std::initializer_list<Kind> kinds) {
  std::vector<std::string_view> names;
  for (const Kind kind : kinds) {
    if (ToString(kind) == name) return kind;
    names.push_back(ToString(kind));
  }
  throw InputError(what, "unknown name \"" + name + "\"", fmt::format("choose {}", fmt::join(names, ", ")));
}

GoalKind ParseGoal(const std::string& name) {
  return Named(name, "goal", {GoalKind::kSingleton, GoalKind::kInsertable});
}

nb::object Number(double value) { return nb::float_(value); }

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
    const auto tables = planner::BuildPlanningTables(*problem, options, Parallelism(jobs));
    return planner::Solve(*problem, options, tables);
  });
  raised.Rethrow();
  nb::object policy = nb::none();
  if (result.policy) {
    policy = nb::cast(BoundPolicy{problem, std::make_shared<const planner::PolicyGraph>(*result.policy)});
  }
  return nb::make_tuple(ResultDict(result, *problem, options, unit), policy);
}

nb::object TravelOf(const planner::ContactMap& map, int direction, int orientation) {
  const Cell size = map.domain().Size();
  const auto& values = map.layer(orientation).travel[direction];
  // x fastest in the map: (z, y, x) in rows, handed out as (x, y, z).
  std::vector<float> copy(values.size());
  const auto nx = static_cast<std::size_t>(size.x());
  const auto ny = static_cast<std::size_t>(size.y());
  const auto nz = static_cast<std::size_t>(size.z());
  for (std::size_t z = 0; z < nz; ++z) {
    for (std::size_t y = 0; y < ny; ++y) {
      for (std::size_t x = 0; x < nx; ++x) copy[(x * ny + y) * nz + z] = values[(z * ny + y) * nx + x];
    }
  }
  return NewArray(std::move(copy), {nx, ny, nz});
}

void RequireOrientation(const planner::ContactMap& map, int orientation) {
  if (orientation < 0 || orientation >= map.orientations()) {
    throw InputError("orientation", fmt::format("{} of {}", orientation, map.orientations()), "count from 0");
  }
}

nb::object CellsOf(const std::vector<planner::Hypothesis>& hypotheses) {
  std::vector<std::int32_t> rows;
  for (const planner::Hypothesis& h : hypotheses) {
    for (int axis = 0; axis < 3; ++axis) rows.push_back(h.offset[axis]);
    rows.push_back(h.orientation);
  }
  return NewArray(std::move(rows), {hypotheses.size(), 4});
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
                     d["vertical_m"] = t.task().tolerance.vertical_m;
                     d["angle_rad"] = t.task().tolerance.angle_rad;
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

void BindMap(nb::module_& m) {
  nb::class_<planner::ContactMap>(m, "ContactMap", "How far the tool can travel from each displacement to the target.")
      .def_prop_ro("shape", [](const planner::ContactMap& map) { return Eigen::Vector3i(map.domain().Size()); })
      .def_prop_ro("origin", [](const planner::ContactMap& map) { return Eigen::Vector3i(map.domain().min); })
      .def_prop_ro("phase", [](const planner::ContactMap& map) { return map.phase(); })
      .def_prop_ro("margin_cells", &planner::ContactMap::margin_cells)
      .def_prop_ro("orientations", &planner::ContactMap::orientations)
      .def(
          "travel",
          [](const planner::ContactMap& map, const std::string& direction, int orientation) {
            RequireOrientation(map, orientation);
            const auto d = ParseDirection(direction);
            if (!d) throw InputError("direction", "unknown \"" + direction + "\"", "choose +x, -x, +y, -y, +z or -z");
            return TravelOf(map, IndexOf(*d), orientation);
          },
          "direction"_a, "orientation"_a = 0)
      .def(
          "blocked",
          [](const planner::ContactMap& map, int orientation) {
            RequireOrientation(map, orientation);
            const Cell size = map.domain().Size();
            const std::size_t count = static_cast<std::size_t>(map.domain().Count());
            bool* data = new bool[count];
            std::size_t at = 0;
            for (int x = 0; x < size.x(); ++x) {
              for (int y = 0; y < size.y(); ++y) {
                for (int z = 0; z < size.z(); ++z)
                  data[at++] = map.Blocked(map.domain().min + Cell(x, y, z), orientation);
              }
            }
            nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
            const std::size_t shape[3] = {static_cast<std::size_t>(size.x()), static_cast<std::size_t>(size.y()),
                                          static_cast<std::size_t>(size.z())};
            return nb::ndarray<nb::numpy, bool>(data, 3, shape, owner);
          },
          "orientation"_a = 0);
}

void BindProblem(nb::module_& m) {
  nb::class_<planner::Problem>(m, "Problem", "A start belief and everything needed to plan from it.")
      .def_ro("name", &planner::Problem::name)
      .def_prop_ro("start", [](const planner::Problem& p) { return Eigen::Vector3i(p.start); })
      .def_prop_ro("hypotheses", [](const planner::Problem& p) { return CellsOf(p.hypotheses); })
      .def_prop_ro("weights",
                   [](const planner::Problem& p) {
                     std::vector<double> weights;
                     for (const planner::Hypothesis& h : p.hypotheses) weights.push_back(h.weight);
                     const std::size_t n = weights.size();
                     return NewArray(std::move(weights), {n});
                   })
      .def_ro("move_lengths", &planner::Problem::move_lengths)
      .def_prop_ro("goal", [](const planner::Problem& p) { return std::string(ToString(p.goal)); })
      .def_prop_ro("workspace",
                   [](const planner::Problem& p) {
                     return nb::make_tuple(Eigen::Vector3i(p.workspace.min), Eigen::Vector3i(p.workspace.max));
                   })
      .def_prop_ro("contact_map", [](const planner::Problem& p) { return p.map; })
      .def(
          "outcome",
          [](const planner::Problem& p, const Eigen::Vector3i& robot, const std::string& direction, int cells,
             int hypothesis) {
            const auto d = ParseDirection(direction);
            if (!d) throw InputError("direction", "unknown \"" + direction + "\"", "choose +x, -x, +y, -y, +z or -z");
            if (cells < 1) throw InputError("cells", fmt::format("is {}", cells), "give 1 or more");
            if (hypothesis < 0 || hypothesis >= static_cast<int>(p.hypotheses.size())) {
              throw InputError("hypothesis", fmt::format("{} of {}", hypothesis, p.hypotheses.size()), "count from 0");
            }
            const Outcome o =
                planner::Simulate(p, robot, {*d, cells}, p.hypotheses[static_cast<std::size_t>(hypothesis)]);
            return nb::make_tuple(o.cells, o.contact);
          },
          "robot"_a, "direction"_a, "cells"_a, "hypothesis"_a,
          "What a guarded move from a cell returns under a hypothesis: (cells, contact).");
  m.def(
      "lattice_problem",
      [](const std::string& json) {
        return std::make_shared<const planner::Problem>(
            planner::MakeLatticeProblem(policies::ParseLatticeProblem(json, "lattice problem")));
      },
      "json"_a);
  m.def(
      "read_lattice_problem",
      [](const std::string& path) {
        return std::make_shared<const planner::Problem>(
            planner::MakeLatticeProblem(policies::ReadLatticeProblem(path)));
      },
      "path"_a);
}

void BindPolicy(nb::module_& m) {
  nb::class_<BoundPolicy>(m, "PolicyGraph", "A frozen policy with its problem.")
      .def_prop_ro("problem", [](const BoundPolicy& p) { return p.problem; })
      .def_prop_ro("expected_cost", [](const BoundPolicy& p) { return p.graph->expected_cost; })
      .def_prop_ro("lower_bound", [](const BoundPolicy& p) { return p.graph->lower_bound; })
      .def("__len__", [](const BoundPolicy& p) { return p.graph->nodes.size(); })
      .def("evaluate",
           [](const BoundPolicy& p) {
             planner::PolicyEvaluation e;
             {
               const nb::gil_scoped_release released;
               e = planner::Evaluate(*p.problem, *p.graph);
             }
             nb::dict d;
             d["valid"] = e.valid();
             d["fault"] = e.fault;
             d["expected_cost"] = e.expected_cost;
             d["worst_cost"] = e.worst_cost;
             d["expected_moves"] = e.expected_moves;
             d["expected_contacts"] = e.expected_contacts;
             d["expected_cells"] = e.expected_cells;
             const std::size_t n = e.cost.size();
             d["cost"] = NewArray(std::move(e.cost), {n});
             return d;
           })
      .def("expand",
           [](const BoundPolicy& p) {
             const planner::ExpandedPolicy tree = planner::ExpandPolicy(*p.problem, *p.graph);
             nb::list nodes;
             for (const planner::ExpandedNode& node : tree.nodes) {
               nb::dict d;
               d["move"] = nb::none();
               if (!node.is_leaf())
                 d["move"] = nb::make_tuple(std::string(ToString(node.move.direction)), node.move.cells);
               nb::list outcomes;
               for (const planner::ExpandedBranch& branch : node.outcomes) {
                 outcomes.append(
                     nb::make_tuple(branch.outcome.cells, branch.outcome.contact, branch.next, branch.probability));
               }
               d["outcomes"] = outcomes;
               std::vector<std::int32_t> hypotheses(node.hypotheses.begin(), node.hypotheses.end());
               const std::size_t n = hypotheses.size();
               d["hypotheses"] = NewArray(std::move(hypotheses), {n});
               d["robot"] = Eigen::Vector3i(node.robot);
               d["probability"] = node.probability;
               d["expected_cost"] = node.expected_cost;
               nodes.append(d);
             }
             return nodes;
           })
      .def(
          "draw",
          [](const BoundPolicy& p, const std::string& format, const std::string& title, int max_depth,
             double min_probability) {
            const planner::ExpandedPolicy tree = planner::ExpandPolicy(*p.problem, *p.graph);
            const policies::PolicyDrawingOptions options{max_depth, min_probability};
            if (format == "dot") return policies::FormatPolicyDot(tree, title, options);
            if (format == "html") return policies::FormatPolicyHtml(tree, title, options);
            throw InputError("format", "unknown \"" + format + "\"", "choose dot or html");
          },
          "format"_a, "title"_a, "max_depth"_a, "min_probability"_a)
      .def(
          "json",
          [](const BoundPolicy& p, const std::string& task) {
            return policies::FormatPolicyFile(policies::ToPolicyFile(*p.problem, *p.graph, task));
          },
          "task"_a)
      .def(
          "save",
          [](const BoundPolicy& p, const std::string& path, const std::string& task) {
            WriteFileAtomically(path, policies::FormatPolicyFile(policies::ToPolicyFile(*p.problem, *p.graph, task)));
          },
          "path"_a, "task"_a);
  m.def(
      "read_policy",
      [](std::shared_ptr<const planner::Problem> problem, const std::string& path) {
        auto graph = std::make_shared<const planner::PolicyGraph>(
            policies::ToPolicy(policies::ReadPolicyFile(path), *problem, path));
        return BoundPolicy{std::move(problem), std::move(graph)};
      },
      "problem"_a, "path"_a);
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
  options.jobs = Parallelism(jobs);
  options.progress = ToProgress(progress, token);
  setup_ = RunInterruptibly(token, [&] {
    return std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup(name_, options));
  });
  return setup_;
}

planner::Extents ToExtents(const nb::object& extents, const Task& task) {
  std::string text;
  if (!nb::try_cast(extents, text)) {
    std::vector<int> counts;
    if (!nb::try_cast(extents, counts)) {
      throw InputError("extents", "are no counts", "give one per axis of the task, e.g. (7, 7, 5), or \"7x7x5\"");
    }
    text = fmt::format("{}", fmt::join(counts, "x"));
  }
  const planner::Extents result = planner::ParseExtents(text, task);
  workflow::RequireWithinTask({{result}, text}, task);
  return result;
}

planner::ProblemFamily ToFamily(const nb::object& family, const Task& task) {
  if (family.is_none()) return planner::FamilyOf(task);
  std::string text;
  planner::ProblemFamily result;
  if (nb::try_cast(family, text)) {
    result = planner::ParseProblemFamily(text, task);
  } else {
    std::vector<planner::ProblemFamily> all;
    for (nb::handle item : family) {
      const planner::Extents extents = ToExtents(nb::borrow<nb::object>(item), task);
      all.push_back({{extents}, planner::ToString(extents, task)});
    }
    if (all.empty()) throw InputError("family", "holds no problem", "give a range, e.g. \"2..5x2..5x2..5\", or a list");
    std::string spec;
    for (const auto& one : all) spec += (spec.empty() ? "" : ",") + one.spec;
    result = planner::UnionOf(all, spec);
  }
  workflow::RequireWithinTask(result, task);
  return result;
}

planner::SolverOptions ToSolverOptions(const nb::dict& given, CancellationToken& token) {
  using planner::HeuristicKind;
  using planner::SolverKind;
  for (const auto& [key, value] : given) {
    const std::string name = nb::str(key).c_str();
    static constexpr const char* kKnown[] = {
        "solver", "epsilon",   "gap",    "time_limit_s", "cpu_limit_s", "expansion_limit", "memory_limit_bytes",
        "seed",   "heuristic", "setting"};
    if (std::none_of(std::begin(kKnown), std::end(kKnown), [&](const char* k) { return name == k; })) {
      throw InputError("solve", "unknown option \"" + name + "\"",
                       fmt::format("choose from {}", fmt::join(kKnown, ", ")));
    }
  }
  planner::SolverOptions options;
  const auto solver = Named(Take<std::string>(given, "solver").value_or("certified"), "solver",
                            {SolverKind::kRtdpBel, SolverKind::kERtdpBel, SolverKind::kCertified});
  const double epsilon = Take<double>(given, "epsilon").value_or(options.epsilon);
  const std::string setting = Take<std::string>(given, "setting").value_or("fast");
  if (setting != "fast" && setting != "paper") {
    throw InputError("setting", "unknown name \"" + setting + "\"", "choose fast or paper");
  }
  options = setting == "paper" ? planner::PaperSetting(solver, epsilon) : planner::FastSetting(solver, epsilon);
  options.solver = solver;
  if (const auto v = Take<double>(given, "gap")) options.gap = *v;
  if (const auto v = Take<double>(given, "time_limit_s")) options.time_limit_s = *v;
  if (const auto v = Take<double>(given, "cpu_limit_s")) options.cpu_limit_s = *v;
  if (const auto v = Take<std::int64_t>(given, "expansion_limit")) options.expansion_limit = *v;
  if (const auto v = Take<std::size_t>(given, "memory_limit_bytes")) options.memory_limit_bytes = *v;
  if (const auto v = Take<std::uint64_t>(given, "seed")) options.seed = *v;
  if (const auto v = Take<std::string>(given, "heuristic")) {
    options.heuristic = Named(
        *v, "heuristic",
        {HeuristicKind::kCertificate, HeuristicKind::kLines, HeuristicKind::kFirstContact, HeuristicKind::kCuboids});
  }
  options.cancellation = &token;
  return options;
}

void BindPlanner(nb::module_& m) {
  nb::class_<CancellationToken>(m, "Cancellation",
                                "Asks long work to stop cleanly and keep what is done; from any thread.")
      .def(nb::init<>())
      .def("cancel", &CancellationToken::Cancel)
      .def_prop_ro("cancelled", &CancellationToken::cancelled);
  BindMap(m);
  BindProblem(m);
  BindPolicy(m);
  BindTask(m);
  m.def("solve", &Solve, "problem"_a, "options"_a, "cancellation"_a.none(), "on_bounds"_a.none(), "jobs"_a,
        "cost_unit"_a);
}

}  // namespace feeler::python
