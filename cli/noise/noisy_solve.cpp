// feeler solve with noise: problems whose readings are wrong now and then.
#include "feeler/cli/noise/noisy_solve.h"

#include <nlohmann/json.hpp>

#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/session.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "feeler/policies/io/noisy_policy_json.h"

namespace feeler::cli {
namespace {

nlohmann::json ResultJson(const planner::NoisyProblem& noisy, const planner::SolverOptions& options,
                          const planner::NoisyResult& result, const std::string& unit) {
  const planner::NoisyEvaluation& policy = result.evaluation;
  return {{"problem", noisy.problem.name},
          {"status", planner::ToString(result.status)},
          {"solver", planner::ToString(options.solver)},
          {"hypotheses", noisy.problem.hypotheses.size()},
          {"noise",
           {{"missed_contact", noisy.noise.missed_contact},
            {"false_stop", noisy.noise.false_stop},
            {"slip", noisy.noise.slip}}},
          {"confidence", noisy.declaration.confidence},
          {"wrong_cost", noisy.WrongCost()},
          {"expected_cost", policy.expected_cost},
          {"cost_unit", unit},
          {"lower_bound", result.lower_bound},
          {"ratio", NumberOrNull(result.Ratio())},
          {"right", policy.right},
          {"wrong", policy.wrong},
          {"given_up", policy.given_up},
          {"moves", policy.moves},
          {"trials", result.trials},
          {"expansions", result.expansions},
          {"beliefs", result.beliefs},
          {"cpu_s", result.cpu_s},
          {"wall_s", result.wall_s},
          {"policy_nodes", result.policy.nodes.size()}};
}

}  // namespace

void NoiseFlags::AddTo(CLI::App& command) {
  AddReal(command, "--missed-contact", noise.missed_contact, 0.0, 1.0,
          "probability that a blocked step reports no contact (default: the file's, or 0)", false);
  AddReal(command, "--false-stop", noise.false_stop, 0.0, 1.0,
          "probability that a free step ends the move with a false contact (default: the file's, or 0)", false);
  AddReal(command, "--slip", noise.slip, 0.0, 1.0,
          "probability that a free step is spent and the tool stays (default: the file's, or 0)", false);
  AddReal(command, "--confidence", declaration.confidence, 0.0, 1.0,
          "with noise: least probability of what is declared, above 0.5");
  AddReal(command, "--wrong-cost", declaration.wrong_cells, 0.0, 1e9,
          "with noise: cost of a wrong declaration and of giving up, in cells, above 0");
}

planner::Noise NoiseFlags::Over(const CLI::App& command, planner::Noise of_file) const {
  if (command.count("--missed-contact") > 0) of_file.missed_contact = noise.missed_contact;
  if (command.count("--false-stop") > 0) of_file.false_stop = noise.false_stop;
  if (command.count("--slip") > 0) of_file.slip = noise.slip;
  planner::Validate(of_file, "noise");
  planner::Validate(declaration, "--confidence, --wrong-cost");
  return of_file;
}

void NoiseFlags::RequireNoise(const CLI::App& command, const planner::Noise& given) const {
  if (given.any()) return;
  for (const char* option : {"--confidence", "--wrong-cost"}) {
    if (command.count(option) > 0) {
      throw InputError(option, "goes with noise", "give --missed-contact, --false-stop or --slip, or leave it out");
    }
  }
}

void RunSolveNoisy(const planner::NoisyProblem& noisy, const planner::SolverOptions& options,
                   const NoisyOutput& output) {
  const planner::NoisyResult result = planner::SolveNoisy(noisy, options);
  if (!output.out.empty()) {
    WriteFileAtomically(output.out, policies::FormatNoisyPolicy(noisy, result, output.task));
  }
  if (output.json) {
    PrintJson(ResultJson(noisy, options, result, output.unit));
    return;
  }
  const planner::NoisyEvaluation& policy = result.evaluation;
  Print("status         {}\n", planner::ToString(result.status));
  Print("expected cost  {:.6g} {}\nlower bound    {:.6g}\nratio          {:.4f}\npolicy nodes   {}\n",
        policy.expected_cost, output.unit, result.lower_bound, result.Ratio(), result.policy.nodes.size());
  Print("declares       {:.4f} right, {:.5f} wrong, {:.5f} given up, after {:.1f} moves\n", policy.right, policy.wrong,
        policy.given_up, policy.moves);
  Print("expansions     {}\nCPU, wall      {:.3f} s, {:.3f} s\n", result.expansions, result.cpu_s, result.wall_s);
}

}  // namespace feeler::cli
