#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common.h"
#include "feeler/planner/solve.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::python {

/// A task with everything that planning for it needs; the contact map is loaded when it is first asked for.
class PlanningTask {
 public:
  PlanningTask(const std::string& name, const std::string& opening, const std::string& goal, const std::string& cost);
  const Task& task() const { return setup_ ? setup_->task() : model_.task; }
  const env::TaskModel& model() const { return setup_ ? setup_->model : model_; }
  const std::string& name() const { return name_; }
  const workflow::PlanningSetupOptions& options() const { return options_; }
  /// Loads the map if it is not there yet; call it with the lock held.
  std::shared_ptr<const workflow::PlanningSetup> Setup(int jobs, const nb::object& progress);
  bool loaded() const { return setup_ != nullptr; }

 private:
  std::string name_;
  workflow::PlanningSetupOptions options_;
  env::TaskModel model_;
  std::shared_ptr<const workflow::PlanningSetup> setup_;
};

/// "7x7x5" of a text or a sequence of counts; empty for None.
std::string ExtentsText(const nb::object& extents);
/// Hypotheses per axis of the task, from the same.
planner::Extents ToExtents(const nb::object& extents, const Task& task);
planner::ProblemFamily ToFamily(const nb::object& family, const Task& task);

/// Options of a solver from a dict: those of `feeler solve`. `token` outlives the run.
planner::SolverOptions ToSolverOptions(const nb::dict& options, CancellationToken& token);

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

/// A policy graph with the problem it belongs to.
struct BoundPolicy {
  std::shared_ptr<const planner::Problem> problem;
  std::shared_ptr<const planner::PolicyGraph> graph;
};

/// Parts of BindPlanner.
void BindProblem(nb::module_& module);
void BindPolicy(nb::module_& module);

}  // namespace feeler::python
