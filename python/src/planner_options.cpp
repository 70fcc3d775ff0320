// What is asked of the planner: extents, families, options of a solver.
#include <algorithm>

#include "feeler/planner/family/problem_family.h"
#include "planner.h"

namespace feeler::python {

std::string ExtentsText(const nb::object& extents) {
  if (extents.is_none()) return "";
  std::string text;
  std::vector<int> counts;
  if (!nb::try_cast(extents, text) && nb::try_cast(extents, counts)) text = fmt::format("{}", fmt::join(counts, "x"));
  if (text.empty()) {
    throw InputError("extents", "are no counts", "give one per axis of the task, e.g. (7, 7, 5), or \"7x7x5\"");
  }
  return text;
}

planner::Extents ToExtents(const nb::object& extents, const Task& task) {
  const std::string text = ExtentsText(extents);
  const planner::Extents result = planner::ParseExtents(text, task);
  planner::RequireWithinTask({{result}, text}, task);
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
  planner::RequireWithinTask(result, task);
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

}  // namespace feeler::python
