#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// The tiger problem of Kaelbling, Littman and Cassandra (1998).
inline const std::string kTiger = R"(# tiger
discount: 0.95
values: reward
states: tiger-left tiger-right
actions: listen open-left open-right
observations: obs-left obs-right
T:listen
identity
T:open-left
uniform
T:open-right
uniform
O:listen
0.85 0.15
0.15 0.85
O:open-left
uniform
O:open-right
uniform
R:listen : * : * : * -1
R:open-left : tiger-left : * : * -100
R:open-left : tiger-right : * : * 10
R:open-right : tiger-left : * : * 10
R:open-right : tiger-right : * : * -100
)";

/// Dense tables, drawn at random and written as a file of Cassandra's format.
inline std::string RandomModelText(std::uint64_t seed, int states, int actions, int observations, double discount) {
  RandomStream random(seed, 0, "random-pomdp");
  const auto row = [&](int count) {
    std::vector<double> p;
    double sum = 0.0;
    for (int i = 0; i < count; ++i) {
      p.push_back(random.Uniform() < 0.3 && i > 0 ? 0.0 : random.Uniform(0.05, 1.0));
      sum += p.back();
    }
    std::string text;
    for (const double x : p) text += " " + std::to_string(x / sum);
    return text + "\n";
  };
  std::string text = "discount: " + std::to_string(discount) + "\nvalues: reward\nstates: " + std::to_string(states) +
                     "\nactions: " + std::to_string(actions) + "\nobservations: " + std::to_string(observations) + "\n";
  for (int a = 0; a < actions; ++a) {
    text += "T: " + std::to_string(a) + "\n";
    for (int s = 0; s < states; ++s) text += row(states);
    text += "O: " + std::to_string(a) + "\n";
    for (int s = 0; s < states; ++s) text += row(observations);
    for (int s = 0; s < states; ++s) {
      text += "R: " + std::to_string(a) + " : " + std::to_string(s) + " : * : * " +
              std::to_string(random.Uniform(-5.0, 5.0)) + "\n";
    }
  }
  return text;
}

struct Interval {
  double low = 0.0, high = 0.0;
};

/// V* of the initial belief by looking `horizon` steps ahead through every action and observation, with nothing but the
/// tables of the model: what lies beyond is between the least and the greatest reward for ever.
inline Interval LookAheadOracle(const Pomdp& pomdp, int horizon) {
  const std::size_t count = pomdp.state_count();
  const auto [least, greatest] = std::ranges::minmax(pomdp.reward);
  const std::function<Interval(const std::vector<double>&, int)> value = [&](const std::vector<double>& b, int left) {
    if (left == 0) return Interval{least / (1.0 - pomdp.discount), greatest / (1.0 - pomdp.discount)};
    Interval best{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
      Interval q;
      std::vector<std::vector<double>> next(pomdp.observation_count(), std::vector<double>(count, 0.0));
      for (std::size_t s = 0; s < count; ++s) {
        q.low += b[s] * pomdp.reward[pomdp.At(a, s)];
        for (const SparseEntry& to : pomdp.transitions.Row(pomdp.At(a, s))) {
          for (const SparseEntry& o : pomdp.observation_rows.Row(pomdp.At(a, to.index))) {
            next[o.index][to.index] += b[s] * to.value * o.value;
          }
        }
      }
      q.high = q.low;
      for (std::vector<double>& n : next) {
        double p = 0.0;
        for (const double x : n) p += x;
        if (p <= 0.0) continue;
        for (double& x : n) x /= p;
        const Interval later = value(n, left - 1);
        q.low += pomdp.discount * p * later.low;
        q.high += pomdp.discount * p * later.high;
      }
      best = {std::max(best.low, q.low), std::max(best.high, q.high)};
    }
    return best;
  };
  std::vector<double> start(count, 0.0);
  for (const SparseEntry& s : pomdp.start) start[s.index] = s.value;
  return value(start, horizon);
}

/// Entries of a sparse row by index.
inline std::map<std::uint32_t, double> AsMap(std::span<const SparseEntry> row) {
  std::map<std::uint32_t, double> map;
  for (const SparseEntry& e : row) map[e.index] = e.value;
  return map;
}

}  // namespace feeler::planner
