#include "feeler/planner/bounds/certificates/local_certificate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/bounds/certificates/guarded_certificates.h"

namespace feeler::planner {
namespace {

constexpr int kMostBits = 8;
constexpr int kFewestBits = 3;

int BitsThatFit(const Problem& problem) {
  const std::int64_t cells = problem.workspace.Count() * static_cast<std::int64_t>(problem.hypotheses.size());
  for (int bits = kMostBits; bits >= kFewestBits; --bits) {
    if (cells <= LocalCertificateTable::kMostEntries >> bits) return bits;
  }
  return 0;
}

}  // namespace

bool LocalCertificateTable::Fits(const Problem& problem) { return BitsThatFit(problem) > 0; }

LocalCertificateTable::LocalCertificateTable(const Problem& problem, const StepCosts& costs)
    : workspace_(problem.workspace), size_(workspace_.Size()), bits_(BitsThatFit(problem)) {
  plane_size_ = static_cast<std::size_t>(workspace_.Count());
  const std::size_t n = problem.hypotheses.size();
  others_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<std::pair<int, int>> nearest;  // distance, index
    for (std::size_t j = 0; j < n; ++j) {
      const Hypothesis& a = problem.hypotheses[i];
      const Hypothesis& b = problem.hypotheses[j];
      if (i == j || IsGoal(problem, {a, b})) continue;
      nearest.emplace_back((a.offset - b.offset).cwiseAbs().sum() + (a.orientation != b.orientation ? 1 : 0),
                           static_cast<int>(j));
    }
    std::ranges::sort(nearest);
    if (nearest.size() > static_cast<std::size_t>(bits_)) nearest.resize(static_cast<std::size_t>(bits_));
    for (const auto& [distance, j] : nearest) others_[i].push_back(j);
  }
  // The units of the grid tables serve here too.
  const TableUnits units(costs);
  unit_ = units.unit;
  values_.assign((plane_size_ * n) << bits_, 0);
  for (std::size_t i = 0; i < n; ++i) {
    if (costs.lengths.empty()) {
      Fill(problem, static_cast<int>(i), units.free_units, units.contact_units, units.start_units);
    } else {
      FillGuarded(problem, static_cast<int>(i), units);
    }
  }
}

void LocalCertificateTable::FillGuarded(const Problem& problem, int hypothesis, const TableUnits& units) {
  GuardedWalks walks;
  walks.size = size_;
  walks.lengths = problem.move_lengths;
  walks.step_cost = units.free_units;
  walks.beyond_step = units.beyond_units;
  walks.contact_cost = units.contact_units;
  walks.action_cost = units.start_units;
  const auto& mine = problem.hypotheses[static_cast<std::size_t>(hypothesis)];
  const auto& others = others_[static_cast<std::size_t>(hypothesis)];
  const auto travel_cells = [&](const Cell& here, Direction d, const Hypothesis& h) {
    return static_cast<std::uint8_t>(Simulate(problem, here, {d, walks.lengths.back()}, h).cells);
  };
  for (const Direction d : kDirections) {
    const auto k = static_cast<std::size_t>(IndexOf(d));
    for (int z = workspace_.min.z(); z <= workspace_.max.z(); ++z) {
      for (int y = workspace_.min.y(); y <= workspace_.max.y(); ++y) {
        for (int x = workspace_.min.x(); x <= workspace_.max.x(); ++x) {
          const Cell here(x, y, z);
          int longest = 0;
          if (!Blocked(problem, here, mine)) {
            for (const int length : walks.lengths) {
              if (workspace_.Contains(here + length * UnitCell(d))) longest = length;
            }
          }
          const auto cell = static_cast<std::uint32_t>(walks.travel[k].size());
          const std::uint8_t travel = longest > 0 ? travel_cells(here, d, mine) : 0;
          walks.travel[k].push_back(travel);
          walks.longest[k].push_back(static_cast<std::uint8_t>(longest));
          if (longest == 0) continue;
          GuardedWalks::Telling telling{cell, d, {}};
          bool tells = false;
          for (std::size_t i = 0; i < others.size(); ++i) {
            telling.travel[i] = travel_cells(here, d, problem.hypotheses[static_cast<std::size_t>(others[i])]);
            tells = tells || telling.travel[i] != travel;
          }
          if (tells) walks.telling.push_back(telling);
        }
      }
    }
  }
  FillGuardedCertificates(walks, bits_, &values_[(static_cast<std::size_t>(hypothesis) << bits_) * plane_size_]);
}

void LocalCertificateTable::Fill(const Problem& problem, int hypothesis, std::uint32_t free_units,
                                 std::uint32_t contact_units, std::uint32_t start_units) {
  CertificateWalks walks;
  walks.start_cost = start_units;
  walks.step_cost = free_units;
  walks.strides = GridStrides(size_);
  walks.enters.assign(plane_size_, 0);
  const auto& mine = problem.hypotheses[static_cast<std::size_t>(hypothesis)];
  const auto& others = others_[static_cast<std::size_t>(hypothesis)];
  for (int z = workspace_.min.z(); z <= workspace_.max.z(); ++z) {
    for (int y = workspace_.min.y(); y <= workspace_.max.y(); ++y) {
      for (int x = workspace_.min.x(); x <= workspace_.max.x(); ++x) {
        const Cell here(x, y, z);
        if (Blocked(problem, here, mine)) continue;
        const auto from = static_cast<std::uint32_t>(Index(here));
        for (const Direction d : kDirections) {
          if (!workspace_.Contains(here + UnitCell(d))) continue;
          const bool free = problem.map->StepFree(here - mine.offset, d, mine.orientation);
          std::uint32_t shows = 0;
          for (std::size_t i = 0; i < others.size(); ++i) {
            const Hypothesis& other = problem.hypotheses[static_cast<std::size_t>(others[i])];
            if (problem.map->StepFree(here - other.offset, d, other.orientation) != free) shows |= 1U << i;
          }
          std::uint32_t to = from;
          if (free) {
            to = static_cast<std::uint32_t>(static_cast<std::int64_t>(from) +
                                            SignOf(d) * walks.strides[static_cast<std::size_t>(AxisOf(d))]);
            walks.enters[to] |= static_cast<std::uint8_t>(1U << IndexOf(d));
          }
          if (shows != 0) walks.probes.push_back({from, to, free ? free_units : contact_units, d, !free, shows});
        }
      }
    }
  }
  FillCertificates(walks, bits_, &values_[(static_cast<std::size_t>(hypothesis) << bits_) * plane_size_]);
}

LocalCertificateHeuristic::LocalCertificateHeuristic(const Problem& problem, const HypothesisSets& sets,
                                                     const LocalCertificateTable& table)
    : sets_(sets), table_(table), member_(problem.hypotheses.size(), 0) {
  for (std::size_t i = 0; i < problem.hypotheses.size(); ++i) {
    const Hypothesis& h = problem.hypotheses[i];
    index_[{h.offset.x(), h.offset.y(), h.offset.z(), h.orientation}] = static_cast<int>(i);
  }
}

const LocalCertificateHeuristic::Terms& LocalCertificateHeuristic::Prepare(SetId set) {
  if (set >= terms_.size()) terms_.resize(sets_.count());
  Terms& terms = terms_[set];
  if (terms.ready) return terms;
  terms = {static_cast<std::uint32_t>(planes_.size()), sets_.info(set).size, true};
  std::vector<std::pair<int, double>> members;
  sets_.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t layer, int bit) {
    members.emplace_back(index_.at({h.x(), h.y(), h.z(), orientation}), sets_.Weight(layer, bit));
  });
  for (const auto& [i, weight] : members) member_[static_cast<std::size_t>(i)] = 1;
  for (const auto& [i, weight] : members) {
    const auto& others = table_.others(i);
    std::size_t mask = 0;
    for (std::size_t k = 0; k < others.size(); ++k) {
      mask |= static_cast<std::size_t>(member_[static_cast<std::size_t>(others[k])]) << k;
    }
    planes_.push_back(((static_cast<std::size_t>(i) << table_.others_per_hypothesis()) + mask) * table_.plane_size());
    weights_.push_back(weight);
  }
  for (const auto& [i, weight] : members) member_[static_cast<std::size_t>(i)] = 0;
  return terms;
}

double LocalCertificateHeuristic::Weighted(SetId set, const Cell& robot) {
  if (sets_.info(set).goal) return 0.0;
  const Terms& terms = Prepare(set);
  const std::uint16_t* const here = table_.values() + table_.Index(robot);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < terms.count; ++i) {
    const std::uint16_t value = here[planes_[terms.first + i]];
    if (value == LocalCertificateTable::kUnreachable) return std::numeric_limits<double>::infinity();
    sum += weights_[terms.first + i] * value;
  }
  return sum * table_.unit();
}

}  // namespace feeler::planner
