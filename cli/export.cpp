// feeler export: a lattice problem in the formats of other POMDP solvers.
#include <iostream>
#include <limits>
#include <memory>

#include "feeler/cli/commands.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/policies/io/pomdp_export.h"

namespace feeler::cli {
namespace {

struct Flags {
  std::string problem;
  std::string format = "pomdp";
  std::string out;
  double upper_bound = std::numeric_limits<double>::infinity();
};

void Run(const Flags& flags) {
  if (flags.format != "pomdp" && flags.format != "pomdpx") {
    throw InputError("--format", "unknown value \"" + flags.format + "\"", "choose one of pomdp, pomdpx");
  }
  if (!flags.out.empty()) RequireWritable("--out", flags.out);
  const planner::Problem problem = planner::MakeLatticeProblem(policies::ReadLatticeProblem(flags.problem));
  policies::PomdpOptions options;
  options.upper_bound = flags.upper_bound;
  const std::string text =
      flags.format == "pomdp" ? policies::FormatPomdp(problem, options) : policies::FormatPomdpx(problem, options);
  if (flags.out.empty()) {
    std::cout << text;
  } else {
    WriteFileAtomically(flags.out, text);
  }
}

}  // namespace

void AddExportCommand(CLI::App& app, Session& /*session*/) {
  auto flags = std::make_shared<Flags>();
  CLI::App* command = app.add_subcommand("export", "Write a lattice problem for other POMDP solvers");
  command->add_option("--problem", flags->problem, "lattice problem file (docs/file-formats.md)")->required();
  command->add_option("--format", flags->format, "pomdp (Cassandra's) or pomdpx (mixed observability)")
      ->capture_default_str();
  command->add_option("--out", flags->out, "file to write (default: standard output)");
  command->add_option("--upper-bound", flags->upper_bound,
                      "a proven upper bound of the optimal cost, such as a policy's: makes the penalty of a wrong "
                      "declaration smaller (default: one worked out from the problem)");
  command->callback([flags] { Run(*flags); });
}

}  // namespace feeler::cli
