#include "feeler/cli/solver_flags.h"

#include <array>
#include <cmath>

#include "feeler/core/error.h"

namespace feeler::cli {
namespace {

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
  command.add_option("--epsilon", epsilon, "inflation of the heuristic (rtdp-bel, e-rtdp-bel), >= 1")
      ->capture_default_str();
  command.add_option("--gap", gap, "stop at this ratio of expected cost to lower bound (certified), >= 1")
      ->capture_default_str();
  command.add_option("--time-limit", time_limit_s, "wall seconds per problem (default: none)");
  command.add_option("--expansion-limit", expansion_limit, "belief expansions per problem (default: none)");
  command.add_option("--seed", seed, "of the sampled trials")->capture_default_str();
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
  options.seed = ParseSeed(seed);
  // Given limits are passed on as they are, so that 0 and nonsense are rejected rather than taken for "none".
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

std::uint64_t ParseSeed(std::int64_t seed) {
  if (seed < 0) throw InputError("--seed", std::to_string(seed) + " is negative", "give a number of at least 0");
  return static_cast<std::uint64_t>(seed);
}

Parallelism ParseJobs(int jobs) {
  if (jobs < 1 || jobs > 1024) {
    throw InputError("--jobs", std::to_string(jobs) + " threads", "give a number from 1 to 1024");
  }
  return Parallelism(jobs);
}

}  // namespace feeler::cli
