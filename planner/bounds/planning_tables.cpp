#include "feeler/planner/bounds/planning_tables.h"

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <xxhash.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "feeler/planner/belief/hull.h"
#include "feeler/planner/bounds/certificates/certificate.h"
#include "feeler/planner/bounds/cuboids/cuboid_heuristic.h"
#include "feeler/planner/bounds/openings/open_heuristic.h"
#include "feeler/planner/contact/fill_dead_ends.h"

namespace feeler::planner {
namespace {

Cell SpreadOf(const Problem& problem) {
  return problem.goal == GoalKind::kInsertable ? problem.insertable_spread : Cell(Cell::Zero());
}

std::vector<int> OrientationsOf(const Problem& problem) {
  std::vector<int> orientations;
  for (const Hypothesis& h : problem.hypotheses) orientations.push_back(h.orientation);
  std::ranges::sort(orientations);
  orientations.erase(std::unique(orientations.begin(), orientations.end()), orientations.end());
  return orientations;
}

/// A share of another heuristic: as admissible and consistent, and weaker.
class WeakenedHeuristic : public BeliefHeuristic {
 public:
  WeakenedHeuristic(std::unique_ptr<BeliefHeuristic> full, double share) : full_(std::move(full)), share_(share) {}
  double Weighted(SetId set, const Cell& robot) override { return share_ * full_->Weighted(set, robot); }
  double Estimate(SetId set, const Cell& robot) override { return share_ * full_->Estimate(set, robot); }
  std::size_t bytes() const override { return full_->bytes(); }

 private:
  std::unique_ptr<BeliefHeuristic> full_;
  double share_;
};

/// Changes when tables of the same problem come out otherwise.
constexpr int kTablesVersion = 2;

std::string HashOf(const ContactMap& map) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
  XXH3_128bits_reset(state.get());
  for (int o = 0; o < map.orientations(); ++o) {
    const ContactMap::LayerView& layer = map.layer(o);
    XXH3_128bits_update(state.get(), layer.blocked.data(), layer.blocked.size_bytes());
    for (const auto& travel : layer.travel) XXH3_128bits_update(state.get(), travel.data(), travel.size_bytes());
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

/// All that the tables that are kept depend on.
std::string KeyOf(const Problem& problem, const SolverOptions& options) {
  const auto cells = [](const Cell& c) { return fmt::format("{} {} {}", c.x(), c.y(), c.z()); };
  const CostWeights& cost = problem.cost;
  return fmt::format(
      "tables {}; map {} from {} to {}, {}; cost {} {} {} beyond {}; lengths {}; goal {} {}; pitches {}; "
      "orientations {}; hull {}; solver {}; heuristic {}; generous {}",
      kTablesVersion, HashOf(*problem.map), cells(problem.map->domain().min), cells(problem.map->domain().max),
      problem.map->orientations(), cost.per_cell, cost.per_contact, cost.per_action,
      fmt::join(cost.beyond_per_cell, " "), fmt::join(problem.move_lengths, " "), static_cast<int>(problem.goal),
      cells(SpreadOf(problem)), problem.pitches, fmt::join(OrientationsOf(problem), " "),
      cells(HullOf(problem.hypotheses).Size()), static_cast<int>(options.solver), static_cast<int>(options.heuristic),
      problem.generous_workspace);
}

}  // namespace

PlanningTables::PlanningTables(const Problem& problem, const SolverOptions& options, Parallelism jobs,
                               const std::optional<ArrayStore>& store)
    : masks_(*problem.map, store ? &*store : nullptr) {
  const ArrayStore* const kept = store ? &*store : nullptr;
  const StepCosts costs = LowerStepCosts(problem.cost, problem.move_lengths.back());
  const StepCosts motions = MotionCosts(problem.cost, problem.move_lengths);
  pairs_ = std::make_shared<PairCertificates>(problem.map, motions, SpreadOf(problem));
  const bool oriented = problem.map->orientations() > 1;
  if (oriented) {
    flags_ = std::make_shared<const StepFlagsGrid>(*problem.map, jobs, kept);
    oriented_pairs_ = std::make_shared<OrientedPairs>(flags_, costs, kept != nullptr ? kept->Pool("pairs") : nullptr);
    if (options.heuristic == HeuristicKind::kCertificate || options.heuristic == HeuristicKind::kCuboids) {
      oriented_ = std::make_shared<OrientedCertificates>(problem, *flags_, costs, jobs, options.on_tables,
                                                         options.cancellation, kept);
      oriented_lines_ =
          std::make_shared<OrientedLines>(problem, *flags_, costs, jobs, options.on_tables, options.cancellation, kept);
    }
  }
  switch (options.heuristic) {
    case HeuristicKind::kCertificate:
      if (oriented_) break;
      if (!problem.generous_workspace && LocalCertificateTable::Fits(problem)) {
        local_certificate_ = std::make_shared<LocalCertificateTable>(problem, motions);
      } else {
        certificate_ = std::make_shared<CertificateTable>(*problem.map, motions, SpreadOf(problem), kept);
      }
      break;
    case HeuristicKind::kCuboids:
      if (oriented_) break;  // there are no tables of cuboids over orientations
      certificate_ = std::make_shared<CertificateTable>(*problem.map, motions, SpreadOf(problem), kept);
      // Cuboids are bounded by single steps, in the middle of moves too: so must be what is left of them.
      cuboids_ = std::make_shared<CuboidTable>(
          *problem.map, masks_,
          motions.start > 0.0 ? CertificateTable(*problem.map, costs, SpreadOf(problem)) : *certificate_, costs,
          SpreadOf(problem), HullOf(problem.hypotheses).Size(), jobs, options.cancellation, kept);
      break;
    case HeuristicKind::kLines:
      lines_ = oriented ? std::make_shared<LineTable>(*problem.map, costs, SpreadOf(problem),
                                                      HullOf(problem.hypotheses).Size(), OrientationsOf(problem), kept)
                        : std::make_shared<LineTable>(*problem.map, costs, SpreadOf(problem),
                                                      Cell::Constant(LineTable::kLongest), std::vector<int>{0}, kept);
      break;
    case HeuristicKind::kFirstContact: first_contact_ = std::make_shared<FirstContactTable>(*problem.map, costs); break;
  }
  if (options.solver == SolverKind::kCertified && problem.generous_workspace) {
    FillDeadEndsOf(problem, options, jobs, kept);
  }
}

void PlanningTables::FillDeadEndsOf(const Problem& problem, const SolverOptions& options, Parallelism jobs,
                                    const ArrayStore* store) {
  if (problem.map->orientations() > 1) return;
  filled_.map = FillDeadEnds(*problem.map);
  if (!filled_.map) return;
  filled_.openings = FindOpenings(*problem.map, *filled_.map, 0);
  Problem without = problem;
  without.map = filled_.map;
  SolverOptions with_certificates = options;
  with_certificates.heuristic = HeuristicKind::kCertificate;
  filled_.tables = BuildPlanningTables(without, with_certificates, jobs, store);
  filled_.looks = std::make_shared<const LookTable>(
      LookTable::Source{*filled_.map, filled_.tables->masks_, filled_.openings},
      MotionCosts(problem.cost, problem.move_lengths), SpreadOf(problem), HullOf(problem.hypotheses).Size(), jobs,
      options.on_tables, options.cancellation, store);
}

std::unique_ptr<BeliefHeuristic> PlanningTables::MakeHeuristic(const Problem& problem,
                                                               const HypothesisSets& sets) const {
  std::unique_ptr<BeliefHeuristic> heuristic = MakeFullHeuristic(problem, sets);
  if (heuristic_share_ == 1.0) return heuristic;
  return std::make_unique<WeakenedHeuristic>(std::move(heuristic), heuristic_share_);
}

std::unique_ptr<BeliefHeuristic> PlanningTables::MakeFullHeuristic(const Problem& problem,
                                                                   const HypothesisSets& sets) const {
  std::unique_ptr<BeliefHeuristic> heuristic = MakeHeuristicAsIs(problem, sets);
  if (!filled_.looks) return heuristic;
  return std::make_unique<OpenHeuristic>(sets, std::move(heuristic), filled_.map, filled_.looks);
}

std::unique_ptr<BeliefHeuristic> PlanningTables::MakeHeuristicAsIs(const Problem& problem,
                                                                   const HypothesisSets& sets) const {
  if (oriented_) return std::make_unique<OrientedHeuristic>(problem, sets, oriented_, oriented_pairs_, oriented_lines_);
  if (local_certificate_) return std::make_unique<LocalCertificateHeuristic>(problem, sets, *local_certificate_);
  if (lines_ && oriented_pairs_) return std::make_unique<LineHeuristic>(problem, sets, lines_, oriented_pairs_);
  if (lines_) return std::make_unique<LineHeuristic>(sets, lines_, pairs_);
  if (first_contact_) return std::make_unique<FirstContactHeuristic>(sets, first_contact_);
  if (cuboids_) return std::make_unique<CuboidHeuristic>(sets, cuboids_, certificate_, pairs_);
  return std::make_unique<CertificateHeuristic>(sets, certificate_, pairs_);
}

std::size_t PlanningTables::bytes() const {
  std::size_t bytes = masks_.bytes() + pairs_->bytes();
  const auto add = [&](const auto& table) {
    if (table) bytes += table->bytes();
  };
  add(flags_);
  add(certificate_);
  add(oriented_);
  add(oriented_pairs_);
  add(oriented_lines_);
  add(cuboids_);
  add(lines_);
  add(first_contact_);
  add(local_certificate_);
  add(filled_.tables);
  add(filled_.looks);
  return bytes;
}

std::shared_ptr<const PlanningTables> BuildPlanningTables(const Problem& problem, const SolverOptions& options,
                                                          Parallelism jobs, const ArrayStore* store) {
  if (store == nullptr) return std::make_shared<PlanningTables>(problem, options, jobs);
  const ArrayStore keyed = store->WithKey(KeyOf(problem, options));
  const auto lock = keyed.Lock(options.cancellation);
  return std::make_shared<PlanningTables>(problem, options, jobs, keyed);
}

}  // namespace feeler::planner
