#include "feeler/planner/noise/noisy_bound.h"

#include <algorithm>
#include <limits>

namespace feeler::planner {
namespace {

/// Larger tables are not made (orientations multiply them); then only isolated hypotheses are bounded.
constexpr std::size_t kMostTableBytes = std::size_t{1} << 30;
/// Differences of probabilities below this are rounding.
constexpr double kNoLevel = 1e-14;

Cell SpreadOf(const Problem& problem) {
  return problem.goal == GoalKind::kInsertable ? problem.insertable_spread : Cell(Cell::Zero());
}

std::array<int, 4> KeyOf(const Cell& offset, int orientation) {
  return {offset.x(), offset.y(), offset.z(), orientation};
}

}  // namespace

StepCosts NoisyStepCosts(const NoisyProblem& noisy) {
  const CostWeights& cost = noisy.problem.cost;
  const Noise& noise = noisy.noise;
  // An attempt is a step that is made, spent or ends the move; a move has at most as many as its length.
  const double share = cost.per_action / noisy.problem.move_lengths.back();
  const double lost = noise.false_stop + std::min(noise.slip, noise.missed_contact);
  const double slips_seen = std::max(0.0, noise.slip - noise.missed_contact);
  const double advances = 1.0 - noise.false_stop - noise.slip;
  const double free = noise.false_stop * cost.per_contact + (1.0 - noise.false_stop) * cost.per_cell + share;
  const double blocked = (1.0 - noise.missed_contact) * cost.per_contact + noise.missed_contact * cost.per_cell + share;
  StepCosts costs;
  costs.free = free / advances;
  costs.contact = blocked / (1.0 - lost);
  costs.look = std::max(0.0, costs.free * (advances - slips_seen) / (advances + slips_seen));
  return costs;
}

NoisyBound::NoisyBound(const NoisyProblem& noisy)
    : noisy_(noisy), most_(noisy.WrongCost() / 2.0), weight_(noisy.problem.hypotheses.size(), 0.0) {
  const Problem& problem = noisy.problem;
  const StepCosts costs = NoisyStepCosts(noisy);
  const Cell spread = SpreadOf(problem);
  const CertificateGrid grid(ActiveRegion(*problem.map), costs, spread + Cell::Ones());
  const std::size_t bytes = grid.cells * CertificateTable::kMasks * sizeof(std::uint16_t) *
                            static_cast<std::size_t>(problem.map->orientations());
  if (bytes <= kMostTableBytes) table_ = std::make_unique<const CertificateTable>(*problem.map, costs, spread);
  if (problem.goal == GoalKind::kSingleton) {
    pairs_ = std::make_unique<const PairCertificates>(problem.map, costs, spread);
  }
  std::map<std::array<int, 4>, std::int32_t> at;
  for (std::size_t i = 0; i < problem.hypotheses.size(); ++i) {
    const Hypothesis& h = problem.hypotheses[i];
    at[KeyOf(h.offset, h.orientation)] = static_cast<std::int32_t>(i);
  }
  for (const Hypothesis& h : problem.hypotheses) {
    std::array<std::int32_t, 6> neighbours{};
    for (const Direction d : kDirections) {
      const Cell there = h.offset + (spread[AxisOf(d)] + 1) * UnitCell(d);
      const auto found = at.find(KeyOf(there, h.orientation));
      neighbours[static_cast<std::size_t>(IndexOf(d))] = table_ && found != at.end() ? found->second : -1;
    }
    neighbours_.push_back(neighbours);
  }
}

double NoisyBound::Certificate(const Cell& robot, std::uint32_t hypothesis, int mask) const {
  const Hypothesis& h = noisy_.problem.hypotheses[hypothesis];
  const Cell displacement = robot - h.offset;
  if (table_->At(displacement, mask, h.orientation) == kNoCertificate) return most_;
  return std::min(most_, table_->Further(displacement, mask, h.orientation) * table_->grid().unit);
}

double NoisyBound::Isolated(const Cell& robot, const WeightedHypothesis& h, std::span<const WeightedHypothesis> belief,
                            double above) {
  const Hypothesis& mine = noisy_.problem.hypotheses[h.hypothesis];
  int nearest = std::numeric_limits<int>::max();
  Cell offset = Cell::Zero();
  double level = 0.0;
  for (const WeightedHypothesis& other : belief) {
    if (other.hypothesis == h.hypothesis || other.weight <= above + kNoLevel) continue;
    const Hypothesis& its = noisy_.problem.hypotheses[other.hypothesis];
    if (its.orientation != mine.orientation) continue;
    const Cell apart = its.offset - mine.offset;
    if (apart.cwiseAbs().sum() >= nearest) continue;
    nearest = apart.cwiseAbs().sum();
    offset = apart;
    level = std::min(h.weight, other.weight) - above;
  }
  if (level <= kNoLevel) return 0.0;
  const PairCertificates::Plane*& plane = planes_[KeyOf(offset, mine.orientation)];
  if (plane == nullptr) plane = &pairs_->Get(offset, mine.orientation);
  const std::uint32_t units = plane->At(robot - mine.offset);
  return level * (units >= kNoCertificate ? most_ : std::min(most_, units * plane->grid.unit));
}

double NoisyBound::operator()(const Cell& robot, std::span<const WeightedHypothesis> belief) {
  for (const WeightedHypothesis& h : belief) weight_[h.hypothesis] = h.weight;
  double sum = 0.0;
  for (const WeightedHypothesis& h : belief) {
    // Levels down to which each neighbour stays, and its bit; at the end zero.
    std::array<std::pair<double, int>, 7> levels{};
    for (std::size_t k = 0; k < 6; ++k) {
      const std::int32_t other = neighbours_[h.hypothesis][k];
      if (other < 0) continue;
      std::pair<double, int> level{std::min(h.weight, weight_[static_cast<std::size_t>(other)]), 1 << k};
      for (std::pair<double, int>& at : levels) {
        if (level.first > at.first) std::swap(level, at);
      }
    }
    if (pairs_ && h.weight - levels[0].first > kNoLevel) sum += Isolated(robot, h, belief, levels[0].first);
    int mask = 0;
    for (std::size_t k = 0; k < 6; ++k) {
      mask |= levels[k].second;
      const double height = levels[k].first - levels[k + 1].first;
      if (height > kNoLevel) sum += height * Certificate(robot, h.hypothesis, mask);
    }
  }
  for (const WeightedHypothesis& h : belief) weight_[h.hypothesis] = 0.0;
  return sum;
}

std::size_t NoisyBound::bytes() const { return (table_ ? table_->bytes() : 0) + (pairs_ ? pairs_->bytes() : 0); }

}  // namespace feeler::planner
