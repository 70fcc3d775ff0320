#include "feeler/evaluation/studies/priors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/model/task_file.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/evaluation/records/episode_json.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/planner/family/prior.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/policies/storage/database.h"
#include "feeler/version.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/perception/calibrate.h"
#include "feeler/workflow/perception/perceive_table.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

/// The task planned for with equal weights and with those of the table, each with its database.
struct PlannedWith {
  std::shared_ptr<const workflow::PlanningSetup> setup;
  std::shared_ptr<policies::Database> database;
};
struct Compared {
  CostKind cost_kind = CostKind::kDistance;
  PlannedWith equal, prior;
};

/// Sums of a cost under both policies, an installation of the camera each.
struct PairedSums {
  std::map<int, std::pair<double, double>> of_installation;  ///< equal weights, prior
  int pairs = 0;
  void Add(int installation, double equal, double prior) {
    auto& sums = of_installation[installation];
    sums.first += equal;
    sums.second += prior;
    ++pairs;
  }
  double Mean(double std::pair<double, double>::*side) const {
    double sum = 0.0;
    for (const auto& [installation, sums] : of_installation) sum += sums.*side;
    return pairs > 0 ? sum / pairs : 0.0;
  }
  /// Of what equal weights cost: the share that the prior saves.
  Estimate Gain() const {
    std::vector<double> equal, prior;
    for (const auto& [installation, sums] : of_installation) {
      equal.push_back(sums.first);
      prior.push_back(sums.second);
    }
    const Estimate ratio = BootstrapRatio(prior, equal);
    return {1.0 - ratio.value, 1.0 - ratio.high, 1.0 - ratio.low};
  }
};

std::optional<PlannedWith> PlanWith(const std::vector<double>& deviation, CostKind cost_kind,
                                    const planner::ProblemFamily& family, const PriorsProtocol& protocol,
                                    const ExperimentRequest& request) {
  workflow::PlanningSetupOptions options;
  options.cost_kind = cost_kind;
  options.prior_deviation = deviation;
  options.jobs = request.jobs;
  options.progress = request.map_progress;
  PlannedWith planned;
  planned.setup = std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup("plug", options));
  planner::PreprocessOptions build;
  build.solver = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
  build.solver.gap = protocol.gap;
  build.jobs = request.jobs;
  build.store = request.store;
  build.cancellation = request.cancellation;
  build.progress = request.database_progress;
  const std::string folder = request.out + "/databases";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError(folder, "cannot be created: " + error.message(), "choose another folder");
  const std::string file =
      fmt::format("{}/plug-{}-{}.db", folder, ToString(cost_kind), deviation.empty() ? "equal-weights" : "prior");
  if (workflow::BuildDatabase(*planned.setup, family, build, file).summary.cancelled) return std::nullopt;
  planned.database = std::make_shared<policies::Database>(policies::Database::OpenReadOnly(file));
  return planned;
}

/// What a policy costs under each hypothesis of its problem, in problem order.
std::vector<double> CostsOf(const PlannedWith& planned, const planner::Extents& extents) {
  const auto stored = planned.database->Get(extents);
  if (!stored || !stored->policy) {
    throw InputError("priors", "problem " + planner::ToString(extents) + " has no policy", "give it more expansions");
  }
  const planner::PolicyEvaluation evaluation = planner::Evaluate(planned.setup->ProblemOf(extents), *stored->policy);
  if (!evaluation.valid()) throw InputError("priors", evaluation.fault, "report it");
  return evaluation.cost;
}

/// Both policies of each problem under every hypothesis.
using CostTable = std::map<planner::Extents, std::pair<std::vector<double>, std::vector<double>>>;

CostTable CostTableOf(const Compared& compared, const planner::ProblemFamily& family) {
  CostTable costs;
  for (const planner::Extents& extents : family.problems) {
    costs[extents] = {CostsOf(compared.equal, extents), CostsOf(compared.prior, extents)};
  }
  return costs;
}

/// What both policies cost in the mean if errors are as the prior has them, over the rules by their samples.
PairedSums ByThePrior(const Compared& compared, const CostTable& costs, const perception::UncertaintyTable& table) {
  PairedSums sums;
  const Task& task = compared.prior.setup->task();
  for (const perception::UncertaintyRule& rule : table.rules) {
    const planner::Extents extents =
        planner::ExtentsAlong(planner::AxesOf(task), perception::CountsFor(table.axes, rule.half));
    const planner::Problem problem = compared.prior.setup->ProblemOf(extents);
    const auto& [equal, prior] = costs.at(extents);
    double weight = 0.0, mean_equal = 0.0, mean_prior = 0.0;
    for (std::size_t h = 0; h < problem.hypotheses.size(); ++h) {
      weight += problem.hypotheses[h].weight;
      mean_equal += problem.hypotheses[h].weight * equal[h];
      mean_prior += problem.hypotheses[h].weight * prior[h];
    }
    sums.Add(0, rule.samples * mean_equal / weight, rule.samples * mean_prior / weight);
    sums.pairs += rule.samples - 1;
  }
  return sums;
}

/// Index of the hypothesis nearest to the truth; nothing if the truth lies outside of them all.
std::optional<std::size_t> HypothesisAt(const Task& task, const perception::UncertaintyTable& table,
                                        const planner::Extents& extents, const planner::Problem& problem,
                                        const perception::PoseHypotheses& found, const Pose& world_T_true) {
  if (!perception::Covers(table.axes, found, world_T_true)) return std::nullopt;
  const Eigen::VectorXd off_m = perception::OffsetAlong(table.axes, found.world_T_estimate, world_T_true);
  Cell offset = Cell::Zero();
  for (std::size_t i = 0; i < table.axes.size(); ++i) {
    const auto kind = static_cast<int>(table.axes[i].kind);
    const int last = extents[kind] - 1;
    const double place = 0.5 * last + off_m[static_cast<Eigen::Index>(i)] / task.cell_m;
    offset[kind] = std::clamp(static_cast<int>(std::lround(place)), 0, last);
  }
  const auto at = std::ranges::find(problem.hypotheses, offset, &planner::Hypothesis::offset);
  if (at == problem.hypotheses.end()) return std::nullopt;
  return static_cast<std::size_t>(at - problem.hypotheses.begin());
}

/// The same over the errors of the half of the calibration that the table does not know.
PairedSums OverHeldOut(const Compared& compared, const CostTable& costs, const workflow::Calibration& calibration) {
  PairedSums sums;
  const Task& task = compared.equal.setup->task();
  for (const workflow::CalibrationSample& sample : calibration.samples) {
    if (!sample.found || !sample.held_out) continue;
    const perception::PoseHypotheses found = HypothesesFor(calibration.table, sample.poses.world_T_estimate);
    const planner::Extents extents = planner::ExtentsAlong(planner::AxesOf(task), found.counts);
    const auto h = HypothesisAt(task, calibration.table, extents, compared.equal.setup->ProblemOf(extents), found,
                                sample.poses.world_T_true);
    if (!h) continue;
    const auto& [equal, prior] = costs.at(extents);
    sums.Add(sample.installation, equal[*h], prior[*h]);
  }
  return sums;
}

/// Kinds of motions before the insertion.
constexpr const char* kMotions[] = {"transfer", "probe", "retreat", "confirm", "approach"};

/// Episodes in physics in which a camera looks; its mounting is that of the seed.
struct CameraEpisodes {
  PairedSums seconds;                         ///< of episodes that both insert
  std::map<std::string, PairedSums> motions;  ///< by kind: how many, of those episodes
  std::map<std::string, PairedSums> spent;    ///< and their seconds
  int inserted_equal = 0;
  int inserted_prior = 0;
  int episodes = 0;
  bool complete = false;
};

/// By kind of motion: how many, and their seconds.
json SpentBy(const json& record) {
  json spent = json::object();
  for (const json& move : record.at("moves")) {
    json& its = spent[move.at("kind").get<std::string>()];
    if (its.is_null()) its = {0, 0.0};
    its[0] = its[0].get<int>() + 1;
    its[1] = its[1].get<double>() + move.at("duration_s").get<double>();
  }
  return spent;
}

/// Records of one mounting, by episode; from the store where they are finished. Null if it was cancelled.
json RunMounting(const Compared& compared, bool with_prior, std::uint64_t seed,
                 const std::shared_ptr<const workflow::EpisodePerception>& camera, const planner::ProblemFamily& family,
                 const PriorsProtocol& protocol, const ExperimentRequest& request, CellStore& cells) {
  const std::string cell =
      fmt::format("{} {} mounting {}", ToString(compared.cost_kind), with_prior ? "prior" : "equal", seed);
  if (const json* known = cells.Find(cell)) return *known;
  const PlannedWith& planned = with_prior ? compared.prior : compared.equal;
  workflow::EpisodeOptions options;
  options.seed = seed;
  options.family = family;
  options.perception = camera;
  const auto scene = workflow::BuildEpisodeScene(*planned.setup);
  const workflow::PolicyFactory factory = workflow::MakePolicyFactory("database", planned.database, {});
  json records = json::array();
  workflow::RunEpisodes(
      workflow::EpisodeRange(0, protocol.episodes), request.jobs,
      [&] { return workflow::EpisodeRunner(planned.setup, scene, factory, options); },
      [&](const workflow::EpisodeRecord& record) {
        const json full = ToJson(record);
        records.push_back({{"episode", full.at("episode")},
                           {"inserted", full.at("inserted")},
                           {"sim_time_s", full.at("sim_time_s")},
                           {"reason", full.at("reason")},
                           {"spent", SpentBy(full)}});
      },
      {}, request.cancellation);
  if (static_cast<int>(records.size()) < protocol.episodes) return nullptr;
  cells.Put(cell, records);
  return records;
}

CameraEpisodes RunCameraEpisodes(const Compared& compared, const workflow::Calibration& calibration,
                                 const planner::ProblemFamily& family, const PriorsProtocol& protocol,
                                 const ExperimentRequest& request, CellStore& cells) {
  workflow::EpisodePerception perception;
  perception.table = calibration.table;
  perception.finder = std::make_shared<const workflow::TargetFinder>(compared.equal.setup->model,
                                                                     workflow::SettingsOf(perception.table));
  const auto camera = std::make_shared<const workflow::EpisodePerception>(std::move(perception));
  CameraEpisodes all;
  for (int mounting = 0; mounting < protocol.mountings; ++mounting) {
    const std::uint64_t seed = request.seed + 1000 + static_cast<std::uint64_t>(mounting);
    const json equal = RunMounting(compared, false, seed, camera, family, protocol, request, cells);
    const json prior =
        equal.is_null() ? json() : RunMounting(compared, true, seed, camera, family, protocol, request, cells);
    if (prior.is_null()) return all;
    for (std::size_t i = 0; i < equal.size(); ++i) {
      const bool both_equal = equal[i].at("inserted").get<bool>();
      const bool both_prior = prior[i].at("inserted").get<bool>();
      ++all.episodes;
      all.inserted_equal += both_equal ? 1 : 0;
      all.inserted_prior += both_prior ? 1 : 0;
      if (!both_equal || !both_prior) continue;
      all.seconds.Add(mounting, equal[i].at("sim_time_s").get<double>(), prior[i].at("sim_time_s").get<double>());
      for (const char* kind : kMotions) {
        const json none = {0, 0.0};
        const json by_equal = equal[i].at("spent").value(kind, none);
        const json by_prior = prior[i].at("spent").value(kind, none);
        all.motions[kind].Add(mounting, by_equal[0].get<double>(), by_prior[0].get<double>());
        all.spent[kind].Add(mounting, by_equal[1].get<double>(), by_prior[1].get<double>());
      }
    }
    if (request.progress) request.progress(mounting + 1, protocol.mountings);
  }
  all.complete = true;
  return all;
}

void AddGain(const Compared& compared, const char* over, const char* unit, const PairedSums& sums, bool interval,
             ExperimentResult& result) {
  const Estimate gain = sums.Gain();
  const double equal = sums.Mean(&std::pair<double, double>::first);
  const double prior = sums.Mean(&std::pair<double, double>::second);
  result.table.rows.push_back({ToString(compared.cost_kind), over, sums.pairs, unit, equal, prior, gain.value,
                               interval ? json(gain.low) : json(), interval ? json(gain.high) : json()});
  result.text += fmt::format("{:<9} {:<18} {:>6} {:>6} {:>9.3f} {:>9.3f} {:>7.1f} {}\n", ToString(compared.cost_kind),
                             over, sums.pairs, unit, equal, prior, 100.0 * gain.value,
                             interval ? fmt::format("[{:.1f}, {:.1f}]", 100.0 * gain.low, 100.0 * gain.high) : "");
}

/// False if it was cancelled.
bool Compare(CostKind cost_kind, const workflow::Calibration& calibration, const PriorsProtocol& protocol,
             const ExperimentRequest& request, CellStore& cells, ExperimentResult& result) {
  const std::vector<double> deviation = perception::PriorDeviation(calibration.table);
  const env::TaskModel task_model = env::LoadTask("plug");
  const planner::ProblemFamily family = workflow::FamilyOfTable(calibration.table, task_model.task, "of the table");
  auto equal = PlanWith({}, cost_kind, family, protocol, request);
  if (!equal) return false;
  auto prior = PlanWith(deviation, cost_kind, family, protocol, request);
  if (!prior) return false;
  const Compared compared{cost_kind, std::move(*equal), std::move(*prior)};
  const CostTable costs = CostTableOf(compared, family);
  const CameraEpisodes episodes = RunCameraEpisodes(compared, calibration, family, protocol, request, cells);
  if (!episodes.complete) return false;
  const char* unit = cost_kind == CostKind::kTime ? "s" : "cells";
  AddGain(compared, "by the prior", unit, ByThePrior(compared, costs, calibration.table), false, result);
  AddGain(compared, "held-out errors", unit, OverHeldOut(compared, costs, calibration), true, result);
  AddGain(compared, "episodes", "s", episodes.seconds, true, result);
  result.text += fmt::format("{:<9} inserted {} of {} with equal weights, {} with the prior\n", "",
                             episodes.inserted_equal, episodes.episodes, episodes.inserted_prior);
  for (const char* kind : kMotions) {
    const auto equal_side = &std::pair<double, double>::first;
    const auto prior_side = &std::pair<double, double>::second;
    const PairedSums& motions = episodes.motions.at(kind);
    const PairedSums& spent = episodes.spent.at(kind);
    result.text += fmt::format(
        "{:<9} {:<9} an episode: {:.1f} in {:.2f} s with equal weights, {:.1f} in {:.2f} s with the prior\n", "", kind,
        motions.Mean(equal_side), spent.Mean(equal_side), motions.Mean(prior_side), spent.Mean(prior_side));
  }
  result.details["inserted"][std::string(ToString(cost_kind))] = {
      {"episodes", episodes.episodes}, {"equal_weights", episodes.inserted_equal}, {"prior", episodes.inserted_prior}};
  return true;
}

}  // namespace

ExperimentResult RunPriorsOf(const PriorsProtocol& protocol, const ExperimentRequest& request) {
  workflow::CalibrationOptions options;
  options.poses = protocol.poses;
  options.installations = protocol.installations;
  options.seed = request.seed;
  options.jobs = request.jobs;
  options.partial = request.out + "/priors.calibration.jsonl";
  options.progress = request.progress;
  options.cancellation = request.cancellation;
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kPriorsName},
                     {"version", FEELER_VERSION},
                     {"quick", request.quick},
                     {"poses", protocol.poses},
                     {"installations", protocol.installations},
                     {"mountings", protocol.mountings},
                     {"episodes", protocol.episodes},
                     {"gap", protocol.gap},
                     {"seeds", result.seeds}};
  CellStore cells(PartialFile(request, kPriorsName), result.settings);
  const workflow::Calibration calibration = workflow::Calibrate(env::LoadTask("plug"), options);
  if (!calibration.complete) return result;

  result.table.columns = {"cost", "over", "pairs", "unit", "equal_weights", "prior", "gain", "gain_low", "gain_high"};
  const std::vector<double> deviation = perception::PriorDeviation(calibration.table);
  result.text = fmt::format(
      "What the camera's errors are worth as a prior: plug, seed {}. Standard deviations {:.1f}, {:.1f}, {:.1f} mm.\n",
      request.seed, 1e3 * deviation.at(0), 1e3 * deviation.at(1), 1e3 * deviation.at(2));
  for (const perception::UncertaintyRule& rule : calibration.table.rules) {
    const std::vector<int> counts = perception::CountsFor(calibration.table.axes, rule.half);
    result.details["problems"].push_back({{"farthest_m", rule.farthest_m}, {"counts", counts}});
  }
  result.details["deviation_m"] = deviation;
  result.text += fmt::format("\n{:<9} {:<18} {:>6} {:>6} {:>9} {:>9} {:>7} {}\n", "cost", "over", "pairs", "unit",
                             "equal", "prior", "gain %", "95 % interval");
  for (const CostKind kind : {CostKind::kDistance, CostKind::kTime}) {
    if (!Compare(kind, calibration, protocol, request, cells, result)) return result;
  }
  result.complete = true;
  workflow::RemovePartial(options);
  return result;
}

ExperimentResult RunPriors(const ExperimentRequest& request) {
  PriorsProtocol protocol;
  if (request.quick) {
    protocol.poses = 40;
    protocol.installations = 4;
    protocol.mountings = 2;
    protocol.episodes = 2;
    protocol.gap = 1.5;
  }
  return RunPriorsOf(protocol, request);
}

}  // namespace feeler::evaluation
