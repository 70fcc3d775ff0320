#include "feeler/cli/solver_flags.h"

#include <array>
#include <cmath>

#include "feeler/cli/common/numbers.h"
#include "feeler/core/error.h"

namespace feeler::cli {
namespace {

/// Of epsilon and gap: beyond, a policy is as good as none and sums overflow.
constexpr double kMostRatio = 1e6;

template <class Kind, std::size_t kCount>
Kind Choose(const std::string& option, const std::string& text, const std::array<Kind, kCount>& kinds) {
  std::string known;
  for (const Kind kind : kinds) {
    if (ToString(kind) == text) return kind;
    known += (known.empty() ? "" : ", ") + std::string(ToString(kind));
  }
  throw InputError(option, "unknown value \"" + text + "\"", "choose one of " + known);
}

}  // namespace

void SolverFlags::AddTo(CLI::App& command) {
  command.add_option("--solver", solver, "rtdp-bel, e-rtdp-bel or certified")->capture_default_str();
  command
      .add_option("--setting", setting,
                  "fast: canonical translation, tight heuristic; paper: as printed, medium heuristic")
      ->capture_default_str();
  command.add_option("--heuristic", heuristic, "certificate, cuboids, lines or first-contact (default: the setting's)");
  AddReal(command, "--epsilon", epsilon, 1.0, kMostRatio, "inflation of the heuristic (rtdp-bel, e-rtdp-bel)");
  AddReal(command, "--gap", gap, 1.0, kMostRatio, "stop at this ratio of expected cost to lower bound (certified)");
  AddReal(command, "--time-limit", time_limit_s, 1e-6, 1e9, "wall seconds per problem, default: none", false);
  AddInteger(command, "--expansion-limit", expansion_limit, 1, std::int64_t{1'000'000'000'000},
             "belief expansions per problem, default: none", false);
  AddSeed(command, seed, "of the sampled trials");
}

planner::SolverOptions SolverFlags::Options(const CLI::App& command) const {
  using planner::HeuristicKind;
  using planner::SolverKind;
  const auto kind =
      Choose("--solver", solver, std::array{SolverKind::kRtdpBel, SolverKind::kERtdpBel, SolverKind::kCertified});
  planner::SolverOptions options;
  if (setting == "fast") {
    options = planner::FastSetting(kind, epsilon);
  } else if (setting == "paper") {
    options = planner::PaperSetting(kind, epsilon);
  } else {
    throw InputError("--setting", "unknown value \"" + setting + "\"", "choose one of fast, paper");
  }
  if (!heuristic.empty()) {
    options.heuristic = Choose("--heuristic", heuristic,
                               std::array{HeuristicKind::kCertificate, HeuristicKind::kCuboids, HeuristicKind::kLines,
                                          HeuristicKind::kFirstContact});
    options.cuboids_where_tight = false;
  }
  options.gap = gap;
  options.seed = seed;
  if (command.count("--time-limit") > 0) options.time_limit_s = time_limit_s;
  if (command.count("--expansion-limit") > 0) options.expansion_limit = expansion_limit;
  planner::Validate(options);
  return options;
}

env::Opening ParseOpening(const std::string& text) {
  return Choose("--opening", text, std::array{env::Opening::kClosed, env::Opening::kOpen});
}

planner::ExperienceKind ParseExperience(const std::string& text) {
  using planner::ExperienceKind;
  return Choose("--experience", text,
                std::array{ExperienceKind::kRollout, ExperienceKind::kNaive, ExperienceKind::kNone});
}

CostKind ParseCost(const std::string& text) {
  return Choose("--cost", text, std::array{CostKind::kDistance, CostKind::kTime});
}

GoalKind ParseGoal(const std::string& text) {
  return Choose("--goal", text, std::array{GoalKind::kSingleton, GoalKind::kInsertable});
}

}  // namespace feeler::cli
