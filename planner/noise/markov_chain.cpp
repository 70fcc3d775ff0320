#include "feeler/planner/noise/markov_chain.h"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <limits>

namespace feeler::planner {
namespace {

/// Components of more states are settled by sweeps instead of a dense system.
constexpr Eigen::Index kDense = 200;
constexpr int kMostSweeps = 10'000;
constexpr double kSettled = 1e-15;
/// What leaves a component with less is rounding: there is no way out.
constexpr double kNoWayOut = 1e-12;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

}  // namespace

void MarkovChain::FindComponents() {
  const auto count = static_cast<std::uint32_t>(first_.size());
  components_ = {};
  std::vector<std::uint32_t> number(count, kNone), low(count, 0), open;
  std::vector<bool> is_open(count, false);
  std::vector<std::pair<std::uint32_t, std::size_t>> path;  // states under way, and the step to look at next
  std::uint32_t next_number = 0;
  const auto enter = [&](std::uint32_t state) {
    number[state] = low[state] = next_number++;
    open.push_back(state);
    is_open[state] = true;
    path.emplace_back(state, first_[state]);
  };
  for (std::uint32_t root = 0; root < count; ++root) {
    if (number[root] == kNone) enter(root);
    while (!path.empty()) {
      const std::uint32_t state = path.back().first;
      if (path.back().second < StepsEnd(state)) {
        const std::uint32_t next = steps_[path.back().second++].first;
        if (number[next] == kNone) {
          enter(next);
        } else if (is_open[next]) {
          low[state] = std::min(low[state], number[next]);
        }
        continue;
      }
      path.pop_back();
      if (!path.empty()) low[path.back().first] = std::min(low[path.back().first], low[state]);
      if (low[state] != number[state]) continue;
      do {
        components_.states.push_back(open.back());
        is_open[open.back()] = false;
        open.pop_back();
      } while (components_.states.back() != state);
      components_.ends.push_back(components_.states.size());
    }
  }
}

double MarkovChain::Alone(std::uint32_t state, double at, double endless, const std::vector<double>& x) const {
  double sum = at;
  double stays = 0.0;
  for (std::size_t s = first_[state]; s < StepsEnd(state); ++s) {
    const auto [next, probability] = steps_[s];
    if (next == state) {
      stays += probability;
    } else {
      sum += probability * x[next];
    }
  }
  return 1.0 - stays > kNoWayOut ? sum / (1.0 - stays) : endless;
}

void MarkovChain::SolveComponent(std::span<const std::uint32_t> component, const std::vector<double>& at,
                                 double endless, std::vector<double>& x) {
  const auto size = static_cast<Eigen::Index>(component.size());
  for (std::size_t i = 0; i < component.size(); ++i) place_[component[i]] = static_cast<std::uint32_t>(i);
  // x = known + inside x, over the component.
  Eigen::VectorXd known(size);
  std::vector<Eigen::Triplet<double>> inside;
  double leaves = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) {
    const std::uint32_t state = component[static_cast<std::size_t>(i)];
    known[i] = at[state];
    double stays = 0.0;
    for (std::size_t s = first_[state]; s < StepsEnd(state); ++s) {
      const auto [next, probability] = steps_[s];
      if (place_[next] == kNone) {
        known[i] += probability * x[next];
        continue;
      }
      stays += probability;
      inside.emplace_back(i, static_cast<Eigen::Index>(place_[next]), probability);
    }
    leaves += std::max(0.0, 1.0 - stays);
  }
  Eigen::VectorXd solved = Eigen::VectorXd::Constant(size, endless);
  if (leaves > kNoWayOut && size <= kDense) {
    Eigen::MatrixXd system = Eigen::MatrixXd::Identity(size, size);
    for (const auto& step : inside) system(step.row(), step.col()) -= step.value();
    solved = system.partialPivLu().solve(known);
  } else if (leaves > kNoWayOut) {
    Eigen::SparseMatrix<double, Eigen::RowMajor> steps(size, size);
    steps.setFromTriplets(inside.begin(), inside.end());
    solved.setZero();
    double change = std::numeric_limits<double>::infinity();
    for (int sweep = 0; sweep < kMostSweeps && change > kSettled; ++sweep) {
      change = 0.0;
      for (Eigen::Index i = 0; i < size; ++i) {
        const double its = known[i] + steps.row(i).dot(solved);
        change = std::max(change, std::abs(its - solved[i]) / std::max(1.0, std::abs(its)));
        solved[i] = its;
      }
    }
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    const std::uint32_t state = component[static_cast<std::size_t>(i)];
    x[state] = solved[i];
    place_[state] = kNone;
  }
}

std::vector<double> MarkovChain::ExpectedSums(const std::vector<double>& at, double endless) {
  if (place_.size() != first_.size()) {
    FindComponents();
    place_.assign(first_.size(), kNone);
  }
  std::vector<double> x(first_.size(), 0.0);
  std::size_t begin = 0;
  for (const std::size_t end : components_.ends) {
    const std::uint32_t state = components_.states[begin];
    if (end - begin == 1) {
      x[state] = Alone(state, at[state], endless, x);
    } else {
      SolveComponent(std::span(components_.states).subspan(begin, end - begin), at, endless, x);
    }
    begin = end;
  }
  return x;
}

}  // namespace feeler::planner
