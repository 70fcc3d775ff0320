#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "feeler/planner/noise/noisy_problem.h"
#include "feeler/planner/options/solver_options.h"

namespace feeler::cli {

/// The options of noise in the readings of single steps.
struct NoiseFlags {
  planner::Noise noise;
  planner::Declaration declaration;

  void AddTo(CLI::App& command);
  /// What was given on the command line over what stands in the problem's file.
  planner::Noise Over(const CLI::App& command, planner::Noise noise) const;
  /// Throws InputError if an option about declarations was given although there is no noise.
  void RequireNoise(const CLI::App& command, const planner::Noise& noise) const;
};

/// What of the result is told beside it.
struct NoisyOutput {
  std::string task;  ///< or the name of the problem
  std::string unit;  ///< of costs
  std::string out;   ///< policy file; may be empty
  bool json = false;
};

/// Solves a noisy problem and prints bounds and result.
void RunSolveNoisy(const planner::NoisyProblem& noisy, const planner::SolverOptions& options,
                   const NoisyOutput& output);

}  // namespace feeler::cli
