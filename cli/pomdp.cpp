// feeler solve --pomdp and feeler policy simulate: general POMDPs.
#include "feeler/cli/pomdp.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/planner/pomdp/files/alpha_file.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/model/pulse.h"
#include "feeler/planner/pomdp/model/simulate.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"
#include "feeler/policies/io/controller_json.h"
#include "feeler/policies/io/json_input.h"

namespace feeler::cli {
namespace {

using planner::PomdpSolverKind;

PomdpSolverKind KindOf(const CLI::App& command, const SolverFlags& solver, const planner::Pomdp& pomdp) {
  if (command.count("--solver") == 0) return planner::PomdpSolverOptions::DefaultKind(pomdp);
  for (const PomdpSolverKind kind : {PomdpSolverKind::kPointBased, PomdpSolverKind::kCertified,
                                     PomdpSolverKind::kRtdpBel, PomdpSolverKind::kERtdpBel}) {
    if (ToString(kind) == solver.solver) return kind;
  }
  throw InputError("--solver", "unknown value \"" + solver.solver + "\"",
                   "choose one of point-based, certified, rtdp-bel, e-rtdp-bel");
}

planner::PomdpSolverOptions Options(const CLI::App& command, const PomdpFlags& flags, const SolverFlags& solver,
                                    const planner::Pomdp& pomdp) {
  for (const char* option :
       {"--gap", "--heuristic", "--setting", "--task", "--problem", "--extents", "--goal", "--cost", "--missed-contact",
        "--false-stop", "--slip", "--confidence", "--wrong-cost", "--opening", "--prior", "--jobs"}) {
    if (command.count(option) > 0) throw InputError(option, "does not go with --pomdp", "see feeler solve --help");
  }
  planner::PomdpSolverOptions options;
  options.kind = KindOf(command, solver, pomdp);
  options.precision = flags.precision;
  options.levels = flags.levels;
  options.simulate = flags.simulate;
  options.seed = solver.seed;
  if (command.count("--epsilon") > 0) options.epsilon = solver.epsilon;
  if (command.count("--time-limit") > 0) options.time_limit_s = solver.time_limit_s;
  if (command.count("--expansion-limit") > 0) options.expansion_limit = solver.expansion_limit;
  planner::Validate(options);
  const bool bel = options.kind == PomdpSolverKind::kRtdpBel || options.kind == PomdpSolverKind::kERtdpBel;
  if (!bel) {
    for (const char* option : {"--simulate", "--levels", "--epsilon"}) {
      if (command.count(option) > 0)
        throw InputError(option, "goes with rtdp-bel and e-rtdp-bel", "see feeler solve --help");
    }
  }
  if (!flags.experience.empty() && options.kind != PomdpSolverKind::kERtdpBel) {
    throw InputError("--experience", "goes with --solver e-rtdp-bel", "leave it out");
  }
  return options;
}

/// The model of a file, and the wall seconds that reading it took; nothing where the time limit or Ctrl-C came first.
std::optional<planner::Pomdp> Read(const std::string& path, double time_limit_s, const Session& session,
                                   double& seconds) {
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  try {
    std::optional<planner::Pomdp> pomdp = planner::ReadPomdp(path, [&] {
      const bool cancelled = session.cancellation != nullptr && session.cancellation->cancelled();
      return cancelled || elapsed_s() >= time_limit_s;
    });
    seconds = elapsed_s();
    return pomdp;
  } catch (const planner::Interrupted&) {
    return std::nullopt;
  }
}

void RequirePolicyExtension(const std::string& out) {
  for (const char* extension : {".json", ".alpha", ".policyx"}) {
    if (out.empty() || out.ends_with(extension)) return;
  }
  throw InputError("--out", fmt::format("unknown extension of \"{}\"", out), "give a .json, .alpha or .policyx file");
}

bool EndsIn(const std::string& path, const char* extension) { return path.ends_with(extension); }

void WritePomdpPolicy(const planner::Pomdp& pomdp, const planner::PomdpResult& result, const std::string& path) {
  if (EndsIn(path, ".alpha") || EndsIn(path, ".policyx")) {
    if (result.alphas.empty()) {
      throw InputError("--out", "only the point-based solver makes alpha vectors", "write a graph: .json");
    }
    WriteFileAtomically(
        path, EndsIn(path, ".alpha") ? FormatAlpha(pomdp, result.alphas) : FormatPolicyx(pomdp, result.alphas));
    return;
  }
  WriteFileAtomically(path, policies::FormatController(pomdp, *result.controller, result.value_lower));
}

nlohmann::json SimulationJson(const planner::SimulationResult& s) {
  return {{"episodes", s.episodes}, {"mean", s.mean},       {"half_width", NumberOrNull(s.half_width)},
          {"steps", s.steps_mean},  {"at_goal", s.at_goal}, {"cut_short", s.cut_short}};
}

void PrintSimulation(const planner::SimulationResult& s) {
  // Neither what is left out of episodes that were cut short nor one episode has an interval.
  const bool interval = s.cut_short == 0 && std::isfinite(s.half_width);
  Print("episodes       {}\nmean reward    {:.6g}{}\nsteps          {:.1f}\nat a goal      {}\n", s.episodes, s.mean,
        interval ? fmt::format(" +- {:.2g} (95 %)", s.half_width) : "", s.steps_mean, s.at_goal);
  if (s.cut_short > 0) Print("cut short      {}: the mean is of what they earned until then\n", s.cut_short);
}

std::string Extension(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(dot);
}

struct SimulateFlags {
  std::string pomdp;
  std::string policy;
  int episodes = 10000;
  int max_steps = 0;
  std::uint64_t seed = 1;
  bool json = false;
};

void RunSimulate(const SimulateFlags& flags, Session& session) {
  if (flags.episodes < 1) throw InputError("--episodes", fmt::format("{}", flags.episodes), "give at least 1");
  if (flags.max_steps < 0) throw InputError("--max-steps", fmt::format("{}", flags.max_steps), "give at least 0");
  double read_s = 0.0;
  const auto read = Read(flags.pomdp, std::numeric_limits<double>::infinity(), session, read_s);
  if (!read) throw NegativeResult(flags.pomdp, "cancelled while it was read");
  const planner::Pomdp& pomdp = *read;
  const std::string text = policies::ReadTextFile(flags.policy, std::size_t{1} << 29);
  planner::PomdpController controller;
  std::vector<planner::FullAlphaVector> alphas;
  std::unique_ptr<planner::PomdpAgent> agent;
  if (EndsIn(flags.policy, ".alpha") || EndsIn(flags.policy, ".policyx")) {
    alphas = EndsIn(flags.policy, ".alpha") ? planner::ParseAlpha(text, flags.policy, pomdp)
                                            : planner::ParsePolicyx(text, flags.policy, pomdp);
    agent = std::make_unique<planner::BeliefAgent>(
        pomdp, [&](std::span<const planner::SparseEntry> belief) { return planner::BestAction(alphas, belief); });
  } else if (EndsIn(flags.policy, ".json")) {
    controller = policies::ParseController(text, flags.policy, pomdp);
    agent = std::make_unique<planner::ControllerAgent>(controller);
  } else {
    throw InputError("--policy", fmt::format("unknown extension \"{}\"", Extension(flags.policy)),
                     "give a .json, .alpha or .policyx file");
  }
  ProgressBar bar("episodes");
  planner::SimulationOptions options;
  options.episodes = flags.episodes;
  options.max_steps = flags.max_steps;
  options.seed = flags.seed;
  options.cancellation = session.cancellation;
  options.progress = bar.Callback();
  const planner::SimulationResult result = planner::SimulatePomdp(pomdp, *agent, options);
  bar.Finish();
  if (flags.json) {
    nlohmann::json document = SimulationJson(result);
    document["pomdp"] = pomdp.name;
    document["discount"] = pomdp.discount;
    PrintJson(document);
  } else {
    PrintSimulation(result);
  }
  if (result.episodes < flags.episodes) session.exit_code = 1;
}

}  // namespace

void PomdpFlags::AddTo(CLI::App& command) {
  command.get_option("--solver")
      ->description(
          "rtdp-bel, e-rtdp-bel or certified; with --pomdp also point-based, the default there for discounts below 1");
  command.add_option("--pomdp", pomdp, "general POMDP: .pomdp (Cassandra's format) or .pomdpx (APPL's), docs/pomdp.md");
  AddReal(command, "--precision", precision, 0.0, 1e9,
          "with --pomdp: stop when value_upper - value_lower is at most this");
  AddInteger(command, "--levels", levels, 0, 1000000,
             "with --pomdp: levels of RTDP-Bel's discretisation of beliefs; 0: none");
  AddInteger(command, "--simulate", simulate, 0, 100000000,
             "with --pomdp: episodes of RTDP-Bel's controller to simulate afterwards");
  command.add_option("--experience", experience,
                     "with --pomdp and e-rtdp-bel: policy (.json) of a similar problem with the same actions and "
                     "observations");
}

void RequireNoPomdpFlags(const CLI::App& command) {
  for (const char* option : {"--precision", "--levels", "--simulate", "--experience"}) {
    if (command.count(option) > 0) throw InputError(option, "goes with --pomdp", "leave it out");
  }
}

void RunSolvePomdp(const CLI::App& command, const PomdpFlags& flags, const SolverFlags& solver, const std::string& out,
                   bool json, Session& session) {
  RequireOutputs({{"--out", out, FileKind::kPomdpPolicy}}, {flags.pomdp, flags.experience});
  RequirePolicyExtension(out);
  double read_s = 0.0;
  const bool limited = command.count("--time-limit") > 0;
  const auto read =
      Read(flags.pomdp, limited ? solver.time_limit_s : std::numeric_limits<double>::infinity(), session, read_s);
  if (!read) throw NegativeResult(flags.pomdp, "the time limit, or Ctrl-C, came while it was read");
  const planner::Pomdp& pomdp = *read;
  planner::PomdpSolverOptions options = Options(command, flags, solver, pomdp);
  options.time_limit_s = std::max(1e-6, options.time_limit_s - read_s);
  options.cancellation = session.cancellation;
  planner::PomdpController experience;
  if (!flags.experience.empty()) {
    experience = policies::ParseController(policies::ReadTextFile(flags.experience), flags.experience, pomdp);
    options.experience = &experience;
  }
  bool header = false;
  options.on_bounds = [&header](const planner::ValueBounds& row) {
    if (!header) {
      Note("{:>9} {:>9} {:>12} {:>14} {:>14} {:>12}\n", "time s", "trials", "expansions", "value lower", "value upper",
           "width");
      header = true;
    }
    Note("{:>9.3f} {:>9} {:>12} {:>14.5f} {:>14.5f} {:>12.5f}\n", row.wall_s, row.trials, row.expansions, row.lower,
         row.upper, row.upper - row.lower);
  };
  const planner::PomdpResult result = planner::SolvePomdp(pomdp, options);
  if (!out.empty() && result.controller) WritePomdpPolicy(pomdp, result, out);
  if (json) {
    nlohmann::json document = {{"problem", pomdp.name},
                               {"states", pomdp.state_count()},
                               {"actions", pomdp.action_count()},
                               {"observations", pomdp.observation_count()},
                               {"discount", pomdp.discount},
                               {"values", pomdp.values_are_costs ? "cost" : "reward"},
                               {"status", planner::ToString(result.status)},
                               {"solver", planner::ToString(options.kind)},
                               {"value_lower", NumberOrNull(result.value_lower)},
                               {"value_upper", NumberOrNull(result.value_upper)},
                               {"trials", result.trials},
                               {"expansions", result.expansions},
                               {"cpu_s", result.cpu_s},
                               {"wall_s", result.wall_s},
                               {"policy_nodes", result.controller ? result.controller->nodes.size() : 0},
                               {"alpha_vectors", result.alphas.size()},
                               {"seed", options.seed}};
    if (result.simulated) document["simulated"] = SimulationJson(*result.simulated);
    PrintJson(document);
  } else {
    Print("status         {}\nvalue          {:.6g} to {:.6g}\npolicy nodes   {}\n", planner::ToString(result.status),
          result.value_lower, result.value_upper, result.controller ? result.controller->nodes.size() : 0);
    Print("expansions     {}\nCPU, wall      {:.3f} s, {:.3f} s\n", result.expansions, result.cpu_s, result.wall_s);
    if (result.simulated) PrintSimulation(*result.simulated);
  }
  if (!result.controller) session.exit_code = 1;
}

void AddPolicySimulateCommand(CLI::App& policy, Session& session) {
  auto flags = std::make_shared<SimulateFlags>();
  CLI::App* command =
      policy.add_subcommand("simulate", "Seeded episodes of a general POMDP under a policy: mean reward, interval");
  command->add_option("--pomdp", flags->pomdp, "the model: .pomdp or .pomdpx")->required();
  command
      ->add_option("--policy", flags->policy,
                   "what feeler solve --pomdp --out wrote: .json (graph), .alpha or .policyx")
      ->required();
  AddInteger(*command, "--episodes", flags->episodes, 1, 100000000, "how many");
  AddInteger(*command, "--max-steps", flags->max_steps, 0, 1000000000,
             "steps of an episode at most (0: until a goal, or until the discount leaves a millionth)");
  AddSeed(*command, flags->seed, "of the episodes");
  command->add_flag("--json", flags->json, "print the result as JSON");
  command->callback([flags, &session] { RunSimulate(*flags, session); });
}

}  // namespace feeler::cli
