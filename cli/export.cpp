// feeler export: a lattice problem in the formats of other POMDP solvers.
#include <cstdio>
#include <memory>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/noise/noisy_solve.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/noise/noisy_pomdp.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/model/rock_sample.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/policies/io/pomdp_export.h"

namespace feeler::cli {
namespace {

struct ExportFlags {
  std::string problem;
  std::string rock_sample;
  std::uint64_t seed = 1;
  std::string format = "pomdp";
  std::string out;
  double upper_bound = 0.0;  ///< 0: not given
  double discount = 1.0;
  NoiseFlags noise;
};

void Write(const ExportFlags& flags, const std::string& text) {
  if (flags.out.empty()) {
    PrintResult(text);
  } else {
    WriteFileAtomically(flags.out, text);
  }
}

/// "7x8": a grid of 7 by 7 with 8 rocks, drawn from the seed.
std::string RockSampleText(const ExportFlags& flags) {
  int size = 0;
  int rocks = 0;
  char rest = 0;
  const bool digits = flags.rock_sample.find_first_not_of("0123456789x") == std::string::npos;
  if (!digits || std::sscanf(flags.rock_sample.c_str(), "%4dx%4d%c", &size, &rocks, &rest) != 2) {
    throw InputError("--rock-sample", "\"" + flags.rock_sample + "\"", "give size and rocks, e.g. 7x8");
  }
  const planner::Pomdp pomdp = planner::MakeRockSample(planner::DrawRockSample(size, rocks, flags.seed));
  return flags.format == "pomdp" ? planner::FormatCassandraPomdp(pomdp) : planner::FormatPomdpx(pomdp);
}

std::string NoisyText(const CLI::App& command, const ExportFlags& flags, const planner::NoisyProblem& noisy) {
  if (command.count("--upper-bound") > 0) {
    throw InputError("--upper-bound", "does not go with noise", "--wrong-cost says what a wrong declaration costs");
  }
  planner::Pomdp pomdp = planner::MakeNoisyPomdp(noisy);
  pomdp.discount = flags.discount;
  constexpr std::size_t kMostBytes = 400'000'000;
  constexpr std::size_t kBytesPerLine = 40;
  const std::size_t rows = pomdp.action_count() * pomdp.state_count();
  if ((pomdp.transitions.entries.size() + 2 * rows) * kBytesPerLine > kMostBytes) {
    throw InputError(flags.problem, "takes more than 400 MB", "export a smaller problem");
  }
  return flags.format == "pomdp" ? planner::FormatCassandraPomdp(pomdp) : planner::FormatPomdpx(pomdp);
}

void Run(const CLI::App& command, const ExportFlags& flags) {
  if (flags.format != "pomdp" && flags.format != "pomdpx") {
    throw InputError("--format", "unknown value \"" + flags.format + "\"", "choose one of pomdp, pomdpx");
  }
  RequireOutputs({{"--out", flags.out, flags.format == "pomdp" ? FileKind::kPomdp : FileKind::kPomdpx}},
                 {flags.problem});
  if (flags.problem.empty() == flags.rock_sample.empty()) {
    throw InputError("export", "give either --problem or --rock-sample", "see feeler export --help");
  }
  if (!flags.rock_sample.empty()) {
    for (const char* option : {"--discount", "--upper-bound", "--missed-contact", "--false-stop", "--slip",
                               "--confidence", "--wrong-cost"}) {
      if (command.count(option) > 0) throw InputError(option, "does not go with --rock-sample", "leave it out");
    }
    return Write(flags, RockSampleText(flags));
  }
  planner::LatticeProblemData data = policies::ReadLatticeProblem(flags.problem);
  const planner::Noise noise = flags.noise.Over(command, data.noise);
  flags.noise.RequireNoise(command, noise);
  data.noise = {};
  const planner::Problem problem = planner::MakeLatticeProblem(data);
  if (noise.any()) return Write(flags, NoisyText(command, flags, {problem, noise, flags.noise.declaration}));
  policies::PomdpOptions options;
  options.discount = flags.discount;
  if (flags.upper_bound > 0.0) options.upper_bound = flags.upper_bound;
  const std::string text =
      flags.format == "pomdp" ? policies::FormatPomdp(problem, options) : policies::FormatPomdpx(problem, options);
  Write(flags, text);
}

}  // namespace

void AddExportCommand(CLI::App& app, Session& /*session*/) {
  auto flags = std::make_shared<ExportFlags>();
  CLI::App* command = app.add_subcommand("export", "Write a lattice problem for other POMDP solvers");
  command->add_option("--problem", flags->problem, "lattice problem file (docs/file-formats.md)");
  command->add_option("--rock-sample", flags->rock_sample,
                      "write a RockSample benchmark instead, e.g. 7x8: 7 x 7 cells, 8 rocks drawn from the seed");
  AddSeed(*command, flags->seed, "of the rocks");
  command->add_option("--format", flags->format, "pomdp (Cassandra's) or pomdpx (mixed observability)")
      ->capture_default_str();
  command->add_option("--out", flags->out, "file to write (default: standard output)");
  AddReal(*command, "--upper-bound", flags->upper_bound, 1e-12, 1e12,
          "a proven upper bound of the optimal cost, such as a policy's: makes the penalty of a wrong declaration "
          "smaller, default: one worked out from the problem",
          false);
  AddReal(*command, "--discount", flags->discount, 0.5, 1.0,
          "of the written model: 1 is the problem itself, solvers that need less than 1 find another value "
          "(docs/file-formats.md)");
  flags->noise.AddTo(*command);
  command->callback([command, flags] { Run(*command, *flags); });
}

}  // namespace feeler::cli
