#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/planner/solve.h"

namespace feeler::cli {

/// The options that `solve` and `preprocess` share.
struct SolverFlags {
  std::string solver = "certified";
  std::string setting = "fast";
  std::string heuristic;  ///< empty: the setting's
  double epsilon = planner::SolverOptions{}.epsilon;
  double gap = 1.2;
  double time_limit_s = 0.0;  ///< 0: not given
  std::int64_t expansion_limit = 0;
  std::uint64_t seed = 1;

  void AddTo(CLI::App& command);
  /// Throws InputError naming the option that is out of range.
  planner::SolverOptions Options(const CLI::App& command) const;
};

/// --opening closed|open.
env::Opening ParseOpening(const std::string& text);
/// --experience rollout|naive|none.
planner::ExperienceKind ParseExperience(const std::string& text);
/// --cost distance|time.
CostKind ParseCost(const std::string& text);
/// --goal singleton|insertable.
GoalKind ParseGoal(const std::string& text);

}  // namespace feeler::cli
