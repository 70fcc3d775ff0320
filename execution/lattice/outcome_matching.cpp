#include "feeler/execution/lattice/outcome_matching.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "feeler/execution/contact/continuous_travel.h"

namespace feeler::execution {

double PredictTravel(const planner::ContactMap& map, const TrackedHypothesis& tracked, const Eigen::Vector3d& tool,
                     Direction direction) {
  return ContinuousTravel(map, tool - tracked.position(), direction, tracked.hypothesis.orientation);
}

double Mismatch(const planner::ContactMap& map, const TrackedHypothesis& tracked, const Touch& touch) {
  const double travel = PredictTravel(map, tracked, touch.start, touch.direction);
  return touch.contact ? std::abs(touch.travelled - travel) : std::max(0.0, touch.travelled - travel);
}

std::vector<OutcomeMatch> MatchOutcomes(const planner::ContactMap& map, const std::vector<TrackedHypothesis>& tracked,
                                        const Cell& robot, const GuardedMove& move, const Touch& touch,
                                        const MatchOptions& options) {
  std::vector<OutcomeMatch> matches;
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    const double mismatch = Mismatch(map, tracked[i], touch);
    if (mismatch > options.tolerance_cells) continue;
    const policies::Hypothesis& hypothesis = tracked[i].hypothesis;
    const Outcome outcome = map.Predict(robot - hypothesis.offset, move, hypothesis.orientation);
    auto match = std::find_if(matches.begin(), matches.end(), [&](const auto& m) { return m.outcome == outcome; });
    if (match == matches.end()) {
      matches.push_back({outcome, mismatch, hypothesis.weight, i});
      continue;
    }
    match->weight += hypothesis.weight;
    if (mismatch < match->mismatch) {
      match->mismatch = mismatch;
      match->best = i;
    }
  }
  constexpr double kTie = 1e-6;
  std::stable_sort(matches.begin(), matches.end(), [](const OutcomeMatch& a, const OutcomeMatch& b) {
    const auto rank = [](const OutcomeMatch& m) { return std::floor(m.mismatch / kTie); };
    return rank(a) != rank(b) ? rank(a) < rank(b) : a.weight > b.weight;
  });
  return matches;
}

void Settle(const planner::ContactMap& map, const Cell& robot, const GuardedMove& move, const Touch& touch,
            const Outcome& outcome, const MatchOptions& options, std::vector<TrackedHypothesis>& tracked) {
  std::erase_if(tracked, [&](const TrackedHypothesis& t) {
    return !(map.Predict(robot - t.hypothesis.offset, move, t.hypothesis.orientation) == outcome) ||
           Mismatch(map, t, touch) > options.tolerance_cells;
  });
  for (TrackedHypothesis& t : tracked) {
    const double travel = PredictTravel(map, t, touch.start, touch.direction);
    const double residual = touch.travelled - travel;
    if (touch.contact || residual > 0.0) t.anchor += residual * UnitVector(touch.direction);
  }
}

bool Weigh(const planner::ContactMap& map, const Cell& robot, const GuardedMove& move, const Touch& touch,
           const Outcome& outcome, const MatchOptions& options, planner::NoisyMoves& noise,
           std::vector<TrackedHypothesis>& tracked) {
  constexpr double kImpossible = 1e-9;
  std::vector<double> weights;
  double total = 0.0;
  for (const TrackedHypothesis& t : tracked) {
    const Outcome predicted = map.Predict(robot - t.hypothesis.offset, move, t.hypothesis.orientation);
    const std::vector<planner::NoisyOutcome>& possible = noise.Of(move.cells, predicted.cells).outcomes;
    const auto same = std::ranges::find(possible, outcome, &planner::NoisyOutcome::outcome);
    weights.push_back(same == possible.end() ? 0.0 : t.hypothesis.weight * same->probability);
    total += weights.back();
  }
  if (!(total > 0.0)) return false;
  std::vector<TrackedHypothesis> left;
  double kept = 0.0;
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    if (weights[i] < kImpossible * total) continue;
    TrackedHypothesis t = tracked[i];
    t.hypothesis.weight = weights[i];
    kept += weights[i];
    const Outcome predicted = map.Predict(robot - t.hypothesis.offset, move, t.hypothesis.orientation);
    if (predicted == outcome && Mismatch(map, t, touch) <= options.tolerance_cells) {
      const double residual = touch.travelled - PredictTravel(map, t, touch.start, touch.direction);
      if (touch.contact || residual > 0.0) t.anchor += residual * UnitVector(touch.direction);
    }
    left.push_back(t);
  }
  for (TrackedHypothesis& t : left) t.hypothesis.weight /= kept;
  tracked = std::move(left);
  return true;
}

Outcome OutcomeAsRead(const GuardedMove& move, double travelled_cells, bool contact) {
  constexpr double kTracking = 0.1;
  const int cells = std::clamp(static_cast<int>(std::floor(travelled_cells + kTracking)), 0, move.cells);
  return {cells, contact && cells < move.cells};
}

std::size_t Likeliest(const std::vector<TrackedHypothesis>& tracked) {
  const auto most =
      std::ranges::max_element(tracked, {}, [](const TrackedHypothesis& t) { return t.hypothesis.weight; });
  return static_cast<std::size_t>(most - tracked.begin());
}

void KeepLikely(double confidence, std::vector<TrackedHypothesis>& tracked) {
  std::vector<double> weights;
  double total = 0.0;
  for (const TrackedHypothesis& t : tracked) {
    weights.push_back(t.hypothesis.weight);
    total += weights.back();
  }
  std::ranges::sort(weights, std::greater<>());
  double sum = 0.0;
  double least = 0.0;
  for (const double weight : weights) {
    least = weight;
    sum += weight;
    if (sum >= confidence * total) break;
  }
  std::erase_if(tracked, [&](const TrackedHypothesis& t) { return t.hypothesis.weight < least; });
}

namespace {

/// From the shift found the lattice point lies this far on the side of the edge that was read.
constexpr double kShift = 0.25;

std::optional<Eigen::Vector3d> ShiftAcrossEdge(const planner::ContactMap& map,
                                               const std::vector<TrackedHypothesis>& tracked, const Touch& touch,
                                               const MatchOptions& options) {
  constexpr double kSearch = 0.6;
  std::optional<Eigen::Vector3d> best;
  double least = options.tolerance_cells;
  for (const TrackedHypothesis& t : tracked) {
    for (const Direction side : kDirections) {
      if (AxisOf(side) == AxisOf(touch.direction)) continue;
      TrackedHypothesis shifted = t;
      shifted.anchor += kSearch * UnitVector(side);
      const double mismatch = Mismatch(map, shifted, touch);
      if (mismatch < least - 1e-9) {
        least = mismatch;
        best = kShift * UnitVector(side);
      }
    }
  }
  return best;
}

/// Away from the wall nearest beside the place of a contact.
std::optional<Eigen::Vector3d> ShiftOffWallBeside(const planner::ContactMap& map,
                                                  const std::vector<TrackedHypothesis>& tracked, const Touch& touch) {
  constexpr double kBeside = 0.75;
  std::optional<Eigen::Vector3d> best;
  double nearest = kBeside;
  for (const TrackedHypothesis& t : tracked) {
    for (const Direction side : kDirections) {
      if (AxisOf(side) == AxisOf(touch.direction)) continue;
      const double travel = PredictTravel(map, t, touch.end(), side);
      if (travel < nearest - 1e-9) {
        nearest = travel;
        best = -kShift * UnitVector(side);
      }
    }
  }
  return best;
}

}  // namespace

std::optional<Eigen::Vector3d> GrazeShift(const planner::ContactMap& map, const std::vector<TrackedHypothesis>& tracked,
                                          const Touch& touch, const MatchOptions& options) {
  if (const auto shift = ShiftAcrossEdge(map, tracked, touch, options)) return shift;
  return touch.contact ? ShiftOffWallBeside(map, tracked, touch) : std::nullopt;
}

}  // namespace feeler::execution
