#include "feeler/planner/noise/noisy_pomdp.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "feeler/planner/noise/noisy_outcomes.h"

namespace feeler::planner {
namespace {

/// Robot cell and contact flag.
using Reading = std::array<int, 4>;

class Writer {
 public:
  explicit Writer(const NoisyProblem& noisy) : noisy_(noisy), problem_(noisy.problem), outcomes_(noisy.noise) {}

  Pomdp Write() {
    ListMoves();
    ListStates();
    goal_sets_ = LargestGoalSets(problem_);
    done_ = static_cast<std::uint32_t>(places_.size());
    const double actions = static_cast<double>(moves_.size() + goal_sets_.size());
    RequireFits(problem_.name, static_cast<double>(places_.size()), actions,
                static_cast<double>(places_.size()) * actions * 4.0);
    Names();
    for (const GuardedMove& move : moves_) {
      for (const Place& place : places_) AddMove(place, move);
      AddDone();
    }
    for (const std::vector<int>& set : goal_sets_) {
      for (const Place& place : places_) {
        const bool right = std::ranges::count(set, place.hypothesis) > 0;
        AddEnd(right ? 0.0 : noisy_.WrongCost());
      }
      AddDone();
    }
    for (std::size_t a = 0; a < pomdp_.action_count(); ++a) {
      for (const Place& place : places_) {
        const SparseEntry seen{readings_.at(place.reading), 1.0};
        pomdp_.observation_rows.Append({&seen, 1});
      }
      const SparseEntry end{static_cast<std::uint32_t>(readings_.size()), 1.0};
      pomdp_.observation_rows.Append({&end, 1});
    }
    return std::move(pomdp_);
  }

 private:
  struct Place {
    Reading reading{};
    int hypothesis = 0;
  };

  static Cell CellOf(const Reading& reading) { return {reading[0], reading[1], reading[2]}; }
  bool Applicable(const Cell& robot, const GuardedMove& move) const {
    return problem_.workspace.Contains(robot + move.cells * UnitCell(move.direction));
  }
  const NoisyMove& Does(const Place& place, const GuardedMove& move) {
    const Hypothesis& h = problem_.hypotheses[static_cast<std::size_t>(place.hypothesis)];
    return outcomes_.Of(move.cells, Simulate(problem_, CellOf(place.reading), move, h).cells);
  }
  Reading After(const Place& place, const GuardedMove& move, const Outcome& outcome) const {
    const Cell cell = CellOf(place.reading) + outcome.cells * UnitCell(move.direction);
    return {cell.x(), cell.y(), cell.z(), outcome.contact ? 1 : 0};
  }

  void ListMoves() {
    const Cell size = problem_.workspace.Size();
    for (const Direction d : kDirections) {
      for (const int length : problem_.move_lengths) {
        if (length < size[AxisOf(d)]) moves_.push_back({d, length});
      }
    }
  }

  /// States that can be met, per hypothesis in order of discovery.
  void ListStates() {
    const Reading start{problem_.start.x(), problem_.start.y(), problem_.start.z(), 0};
    double weights = 0.0;
    for (const Hypothesis& h : problem_.hypotheses) weights += h.weight;
    for (int h = 0; h < static_cast<int>(problem_.hypotheses.size()); ++h) {
      std::size_t next = places_.size();
      const auto add = [&](const Reading& reading) {
        readings_.try_emplace(reading, static_cast<std::uint32_t>(readings_.size()));
        if (!number_.try_emplace({reading, h}, static_cast<std::uint32_t>(places_.size())).second) return;
        places_.push_back({reading, h});
      };
      pomdp_.start.push_back(
          {static_cast<std::uint32_t>(next), problem_.hypotheses[static_cast<std::size_t>(h)].weight / weights});
      add(start);
      for (; next < places_.size(); ++next) {
        for (const GuardedMove& move : moves_) {
          const Place place = places_[next];
          if (!Applicable(CellOf(place.reading), move)) continue;
          for (const NoisyOutcome& o : Does(place, move).outcomes) add(After(place, move, o.outcome));
        }
      }
      RequireFits(problem_.name, static_cast<double>(places_.size()), static_cast<double>(moves_.size()), 0.0);
    }
  }

  void Names() {
    pomdp_.name = problem_.name;
    pomdp_.values_are_costs = true;
    const auto number = [](int n) { return n < 0 ? fmt::format("m{}", -n) : fmt::format("{}", n); };
    const auto name = [&](const Reading& r) {
      return fmt::format("{}{}_{}_{}", r[3] != 0 ? 'c' : 'r', number(r[0]), number(r[1]), number(r[2]));
    };
    for (const Place& place : places_) {
      pomdp_.states.push_back(fmt::format("{}_h{}", name(place.reading), place.hypothesis));
    }
    pomdp_.states.emplace_back("done");
    for (const GuardedMove& m : moves_) {
      pomdp_.actions.push_back(
          fmt::format("{}{}{}", SignOf(m.direction) > 0 ? "plus_" : "minus_", "xyz"[AxisOf(m.direction)], m.cells));
    }
    for (const std::vector<int>& set : goal_sets_) {
      std::string action = "declare";
      for (const int h : set) action += fmt::format("_{}", h);
      pomdp_.actions.push_back(action);
    }
    pomdp_.observations.resize(readings_.size());
    for (const auto& [reading, index] : readings_) pomdp_.observations[index] = name(reading);
    pomdp_.observations.emplace_back("end");
  }

  void AddEnd(double cost) {
    const SparseEntry end{done_, 1.0};
    pomdp_.transitions.Append({&end, 1});
    pomdp_.reward.push_back(-cost);
  }
  void AddDone() { AddEnd(0.0); }

  void AddMove(const Place& place, const GuardedMove& move) {
    if (!Applicable(CellOf(place.reading), move)) return AddEnd(noisy_.WrongCost());
    const NoisyMove& does = Does(place, move);
    std::vector<SparseEntry> row;
    for (const NoisyOutcome& o : does.outcomes) {
      row.push_back({number_.at({After(place, move, o.outcome), place.hypothesis}), o.probability});
    }
    std::ranges::sort(row, {}, &SparseEntry::index);
    pomdp_.transitions.Append(row);
    pomdp_.reward.push_back(-does.Cost(problem_.cost, move.direction));
  }

  const NoisyProblem& noisy_;
  const Problem& problem_;
  NoisyMoves outcomes_;
  std::vector<GuardedMove> moves_;
  std::vector<std::vector<int>> goal_sets_;
  std::vector<Place> places_;
  std::map<std::pair<Reading, int>, std::uint32_t> number_;
  std::map<Reading, std::uint32_t> readings_;
  std::uint32_t done_ = 0;
  Pomdp pomdp_;
};

}  // namespace

Pomdp MakeNoisyPomdp(const NoisyProblem& noisy) {
  Validate(noisy);
  return Writer(noisy).Write();
}

}  // namespace feeler::planner
