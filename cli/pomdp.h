#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "feeler/cli/session.h"
#include "feeler/cli/solver_flags.h"

namespace feeler::cli {

/// `feeler solve --pomdp`: what it takes beside the options that all problems share.
struct PomdpFlags {
  std::string pomdp;
  double precision = 1e-3;
  int levels = 15;
  int simulate = 0;
  std::string experience;

  void AddTo(CLI::App& command);
};

/// Fails with an InputError if an option was given that only --pomdp takes.
void RequireNoPomdpFlags(const CLI::App& command);

/// Solves a general POMDP and prints the result.
void RunSolvePomdp(const CLI::App& command, const PomdpFlags& flags, const SolverFlags& solver, const std::string& out,
                   bool json, Session& session);

/// `feeler policy simulate`.
void AddPolicySimulateCommand(CLI::App& policy, Session& session);

}  // namespace feeler::cli
