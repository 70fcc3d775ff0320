#include "feeler/policies/io/pomdp_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "feeler/core/error.h"
#include "feeler/planner/noise/noisy_problem.h"

namespace feeler::policies {
namespace {

using planner::Hypothesis;
using planner::Problem;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::array<int, 3> CellKey(const Cell& c) { return {c.x(), c.y(), c.z()}; }

bool Applicable(const Problem& problem, const Cell& r, const GuardedMove& move) {
  return problem.workspace.Contains(r + move.cells * UnitCell(move.direction));
}

/// Moves that have room in the workspace.
std::vector<GuardedMove> ListMoves(const Problem& problem) {
  std::vector<GuardedMove> moves;
  const Cell size = problem.workspace.Size();
  for (const Direction d : kDirections) {
    for (const int length : problem.move_lengths) {
      if (length < size[AxisOf(d)]) moves.push_back({d, length});
    }
  }
  return moves;
}

/// Cells reachable from the start under some hypothesis, in order of discovery.
std::vector<Cell> ListCells(const Problem& problem, const std::vector<GuardedMove>& moves, std::size_t max_cells) {
  std::vector<Cell> cells = {problem.start};
  std::set<std::array<int, 3>> listed = {CellKey(problem.start)};
  for (const Hypothesis& h : problem.hypotheses) {
    std::vector<Cell> open = {problem.start};
    std::set<std::array<int, 3>> seen = {CellKey(problem.start)};
    while (!open.empty()) {
      const Cell r = open.back();
      open.pop_back();
      for (const GuardedMove& move : moves) {
        if (!Applicable(problem, r, move)) continue;
        const Cell next = r + planner::Simulate(problem, r, move, h).cells * UnitCell(move.direction);
        if (!seen.insert(CellKey(next)).second) continue;
        open.push_back(next);
        if (listed.insert(CellKey(next)).second) cells.push_back(next);
      }
    }
    if (cells.size() > max_cells) break;
  }
  return cells;
}

/// Cost at which an optimal policy for a pair of hypotheses tells it apart.
struct PairCost {
  double from_start = 0.0;
  double worst = 0.0;  ///< over the cells that a history consistent with both reaches
};

PairCost PairBound(const Problem& problem, const PomdpModel& model, std::size_t a, std::size_t b) {
  const std::size_t cells = model.cells.size();
  // Cells that the robot can be in while both are possible.
  std::vector<std::uint8_t> joint(cells, 0);
  std::vector<std::size_t> open = {0};
  joint[0] = 1;
  while (!open.empty()) {
    const std::size_t r = open.back();
    open.pop_back();
    for (std::size_t m = 0; m < model.moves.size(); ++m) {
      const auto next = static_cast<std::size_t>(model.At(m, r, a).cell);
      if (next != static_cast<std::size_t>(model.At(m, r, b).cell) || joint[next] != 0) continue;
      joint[next] = 1;
      open.push_back(next);
    }
  }
  std::vector<double> cost(cells, kInfinity);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t r = 0; r < cells; ++r) {
      if (joint[r] == 0) continue;
      for (std::size_t m = 0; m < model.moves.size(); ++m) {
        if (!Applicable(problem, model.cells[r], model.moves[m])) continue;
        const PomdpModel::Step& under_a = model.At(m, r, a);
        const PomdpModel::Step& under_b = model.At(m, r, b);
        const double through = under_a.cell != under_b.cell
                                   ? std::max(under_a.cost, under_b.cost)
                                   : under_a.cost + cost[static_cast<std::size_t>(under_a.cell)];
        if (through < cost[r]) cost[r] = through, changed = true;
      }
    }
  }
  double worst = 0.0;
  for (std::size_t r = 0; r < cells; ++r) {
    if (joint[r] != 0) worst = std::max(worst, cost[r]);
  }
  return {cost[0], worst};
}

/// A round number not below `value`: three digits, so that files stay readable.
double RoundUp(double value) {
  if (value <= 1.0) return 1.0;
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2.0);
  double rounded = std::ceil(value / unit) * unit;
  while (rounded < value) rounded += unit;
  return rounded;
}

}  // namespace

std::string PomdpModel::CellName(std::size_t cell) const {
  const auto number = [](int n) { return n < 0 ? fmt::format("m{}", -n) : fmt::format("{}", n); };
  const Cell& c = cells[cell];
  return fmt::format("r{}_{}_{}", number(c.x()), number(c.y()), number(c.z()));
}

std::string PomdpModel::MoveName(std::size_t move) const {
  const GuardedMove& m = moves[move];
  return fmt::format("{}{}{}", SignOf(m.direction) > 0 ? "plus_" : "minus_", "xyz"[AxisOf(m.direction)], m.cells);
}

std::string PomdpModel::DeclarationName(std::size_t declaration) const {
  std::string name = "declare";
  for (const int h : declarations[declaration]) name += fmt::format("_{}", h);
  return name;
}

double CostBound(const Problem& problem, const PomdpModel& model) {
  const std::size_t count = problem.hypotheses.size();
  double longest_move = 0.0;
  for (const GuardedMove& move : model.moves) {
    longest_move = std::max({longest_move, problem.cost.Of({move.cells, false}, move.direction),
                             problem.cost.Of({move.cells - 1, true}, move.direction)});
  }
  double worst_pair = 0.0;
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) {
      if (planner::IsGoal(problem, {problem.hypotheses[a], problem.hypotheses[b]})) continue;
      const PairCost pair = PairBound(problem, model, a, b);
      if (pair.from_start == kInfinity) {
        throw NegativeResult(problem.name.empty() ? "problem" : problem.name,
                             fmt::format("hypotheses {} and {} cannot be told apart", a, b));
      }
      worst_pair = std::max(worst_pair, pair.worst);
    }
  }
  if (worst_pair == 0.0) return 0.0;
  // Where moves cannot be undone there are dead ends for some pair; an optimal policy visits no belief twice, and so
  // no cell twice between two splits.
  if (worst_pair == kInfinity) worst_pair = static_cast<double>(model.cells.size()) * longest_move;
  return static_cast<double>(count - 1) * (worst_pair + longest_move);
}

PomdpModel MakePomdpModel(const Problem& problem, double upper_bound, std::size_t max_steps) {
  PomdpModel model;
  model.moves = ListMoves(problem);
  const std::size_t count = problem.hypotheses.size();
  const std::size_t per_cell = std::max<std::size_t>(1, model.moves.size() * count);
  const std::size_t max_cells = max_steps / per_cell;
  model.cells = ListCells(problem, model.moves, max_cells);
  if (model.cells.size() > max_cells) {
    throw InputError(problem.name.empty() ? "problem" : problem.name,
                     fmt::format("has more than {} transitions", max_steps), "export a smaller problem");
  }
  model.declarations = planner::LargestGoalSets(problem);
  double total_weight = 0.0;
  for (const Hypothesis& h : problem.hypotheses) total_weight += h.weight;
  for (const Hypothesis& h : problem.hypotheses) model.prior.push_back(h.weight / total_weight);

  std::map<std::array<int, 3>, int> index;
  for (std::size_t i = 0; i < model.cells.size(); ++i) index[CellKey(model.cells[i])] = static_cast<int>(i);
  model.steps.reserve(model.cells.size() * per_cell);
  for (const GuardedMove& move : model.moves) {
    for (std::size_t r = 0; r < model.cells.size(); ++r) {
      const Cell& cell = model.cells[r];
      for (const Hypothesis& h : problem.hypotheses) {
        PomdpModel::Step step{static_cast<int>(r), -1.0};  // stays and pays the penalty, set below
        if (Applicable(problem, cell, move) && !planner::Blocked(problem, cell, h)) {
          const Outcome outcome = planner::Simulate(problem, cell, move, h);
          const auto next = index.find(CellKey(cell + outcome.cells * UnitCell(move.direction)));
          // A cell that is free under h and yet never reached under it may lead out of the listed ones.
          if (next != index.end()) step = {next->second, problem.cost.Of(outcome, move.direction)};
        }
        model.steps.push_back(step);
      }
    }
  }
  const double bound = std::isfinite(upper_bound) ? upper_bound : CostBound(problem, model);
  model.penalty = RoundUp(bound / *std::min_element(model.prior.begin(), model.prior.end()));
  for (PomdpModel::Step& step : model.steps) {
    if (step.cost < 0.0) step.cost = model.penalty;
  }
  return model;
}

}  // namespace feeler::policies
