#include "feeler/planner/options/solver_options.h"

#include <fmt/format.h>

#include <cmath>

#include "feeler/core/error.h"

namespace feeler::planner {

std::string_view ToString(SolverKind kind) {
  switch (kind) {
    case SolverKind::kRtdpBel: return "rtdp-bel";
    case SolverKind::kERtdpBel: return "e-rtdp-bel";
    case SolverKind::kCertified: return "certified";
  }
  return "?";
}

std::string_view ToString(HeuristicKind kind) {
  switch (kind) {
    case HeuristicKind::kCertificate: return "certificate";
    case HeuristicKind::kLines: return "lines";
    case HeuristicKind::kFirstContact: return "first-contact";
    case HeuristicKind::kCuboids: return "cuboids";
  }
  return "?";
}

std::string_view ToString(JumpKind kind) {
  switch (kind) {
    case JumpKind::kSameHypotheses: return "same";
    case JumpKind::kSubsets: return "subsets";
  }
  return "?";
}

void Validate(const SolverOptions& options) {
  if (!std::isfinite(options.epsilon) || options.epsilon < 1.0) {
    throw InputError("epsilon", fmt::format("{} is below 1", options.epsilon), "the inflation is a number >= 1");
  }
  if (!std::isfinite(options.gap) || options.gap < 1.0) {
    throw InputError("gap", fmt::format("{} is below 1", options.gap),
                     "the ratio of cost and lower bound is a number >= 1");
  }
  if (!(options.time_limit_s > 0.0)) {
    throw InputError("time limit", fmt::format("{} s", options.time_limit_s), "give a positive number of seconds");
  }
  if (!(options.cpu_limit_s > 0.0)) {
    throw InputError("CPU limit", fmt::format("{} s", options.cpu_limit_s), "give a positive number of seconds");
  }
  if (options.expansion_limit < 1) {
    throw InputError("expansion limit", fmt::format("{}", options.expansion_limit), "give at least 1");
  }
}

SolverOptions PaperSetting(SolverKind solver, double epsilon) {
  SolverOptions options;
  options.solver = solver;
  options.epsilon = epsilon;
  options.heuristic = HeuristicKind::kLines;
  options.canonical_translation = false;
  return options;
}

SolverOptions FastSetting(SolverKind solver, double epsilon) {
  SolverOptions options;
  options.solver = solver;
  options.epsilon = epsilon;
  return options;
}

}  // namespace feeler::planner
